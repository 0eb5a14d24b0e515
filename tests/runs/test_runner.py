"""Results of tasks are found by what they follow from; what is stopped loses
nothing."""

import contextlib
import signal

import numpy as np
import pytest
from commands import geomech
from tasks import doubled

from geomech import plots, scenes
from geomech.mathematics.geometry import connection
from geomech.questions.swimmers.trajectory import Trajectory
from geomech.runs import backend, store
from geomech.runs import runner as runners
from geomech.runs.cost import Cost
from geomech.runs.runner import digest_context, runner, store_results
from geomech.runs.store import Store
from geomech.shell import terminal
from geomech.shell.pipeline import allow
from geomech.studies.terradynamics import walking
from rft.balance.listening import listening, no_listener

VISCOUS = scenes.load("three-link-viscous")


@contextlib.contextmanager
def counted(stop=None):
    """Yield the list of results that are stored; a signal comes after ``stop`` of
    them."""
    computed = []
    put = Store.put

    def put_or_stop(self, key, value, kind):
        if len(computed) == stop:
            raise terminal.Stopped(signal.SIGTERM)
        computed.append(value)
        put(self, key, value, kind)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "put", put_or_stop)
        yield computed


def resumed(path, ask, context=(), keep=False):
    """Return the answer, and how many results were computed for it."""
    with counted() as computed, store_results(path, context, keep=keep):
        return ask(), len(computed)


def stopped(path, after, ask):
    """Return what is said of a request that a signal stops after some results."""
    with pytest.raises(terminal.Stopped) as ended:  # noqa: SIM117
        with counted(after), store_results(path):
            ask()
    return "".join(getattr(ended.value, "__notes__", ""))


def fails(by, x):
    if x == 2 / 7:
        raise ValueError("no such thing")
    return by * x


def within(by, x) -> float:
    """Ask for tasks within a task."""
    return float(sum(runner().map(doubled, by, [x, x], 2)).sum())


def calls(task=doubled, counts=(3, 2)):
    """Return the results of a request of some tasks for each count."""
    results = []
    for k, n in enumerate(counts):
        results += runner().map(task, np.array([k + 1.0]), np.arange(n) / 7, n)
    return results


def test_a_request_that_ends_well_or_is_refused_soon_leaves_nothing(tmp_path):
    assert resumed(tmp_path / "p", calls)[1] == 5
    with pytest.raises(ValueError, match="no such"):
        resumed(tmp_path / "p", lambda: calls(fails, (5,)))
    assert list(tmp_path.iterdir()) == []


def test_what_took_long_is_kept_whatever_ends_it(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "CHECKPOINT", -1.0)
    with pytest.raises(ValueError, match="no such") as ended:
        resumed(tmp_path / "p", lambda: calls() + calls(fails, (5,)))
    assert ended.value.__notes__[0].startswith("7 results are stored")
    assert resumed(tmp_path / "p", calls)[1] == 0


def ask_again(by=1.0, sevenths=(0, 1), off=0.0, task=doubled):
    items = np.array(sevenths) / 7 + off
    return list(runner().map(task, np.array([by]), items, len(items)))


@pytest.mark.parametrize(
    ("ask", "context", "n_computed"),
    [
        (ask_again, (), 0),
        (lambda: ask_again(sevenths=(2, 0, 3, 1)), (), 1),
        (lambda: ask_again(by=1 + 1e-15), (), 2),
        (lambda: ask_again(off=1e-15), (), 2),
        (lambda: ask_again(task=within), (), 2),
        (ask_again, ("another version",), 2),
    ],
    ids=["same", "order", "common", "item", "task", "context"],
)
def test_results_are_found_by_what_they_follow_from(ask, context, n_computed, tmp_path):
    stopped(tmp_path / "p", 3, calls)
    assert resumed(tmp_path / "p", ask, context, keep=True)[1] == n_computed


def test_another_back_end_has_other_results(tmp_path):
    stopped(tmp_path / "p", 3, calls)
    with backend.preferring("numba"):
        assert resumed(tmp_path / "p", calls)[1] == 5


def test_no_faster_back_end_is_taken_than_at_first(tmp_path):
    with backend.at_most("numpy"):
        stopped(tmp_path / "p", 2, calls)
    with backend.preferring("numba"), store_results(tmp_path / "p"):
        assert backend.preferred() == "numpy"
        cost = Cost(10**6, 1.0, 0.0, numpy_seconds=5.0)
        allow(Trajectory(VISCOUS), cost, yes=True)
        assert backend.preferred() == "numpy"


@pytest.mark.parametrize("seconds", [0.1, 50.0])
def test_assumed_seconds_decide_on_the_back_end_and_no_clock(seconds):
    for assumed, expected in ((1.49, "numpy"), (1.5, backend.fastest())):
        with backend.preferring("numpy"), listening(no_listener):
            cost = Cost(1, seconds, 0.0, numpy_seconds=assumed)
            allow(Trajectory(VISCOUS), cost, yes=True)
            assert backend.preferred() == expected


def test_what_has_no_digest_is_computed_and_not_stored(tmp_path):
    def ask():
        generators = runner().map(lambda by, x: by * next(x), 2, [iter([3])], 1)
        return [*generators, *runner().map(doubled, 2, [8], 1)]

    assert resumed(tmp_path / "p", ask) == ([6, 16], 1)


def test_marches_are_found_by_what_they_follow_from(tmp_path, monkeypatch):
    monkeypatch.setattr(runners, "CHECKPOINT", -1.0)

    def march(name):
        def step(state):
            return state + 1, np.array([state])

        return runner().iterate(step, 0, 10, (name,), np.ndarray)

    for name, n_computed in (("one", 10), ("one", 0), ("other", 10)):
        found = resumed(tmp_path / "p", lambda: march(name), keep=True)
        assert found == ((10, [np.array([k]) for k in range(10)]), n_computed)


# Commands

MARCH = """[[effects]]
kind = "body-inertia"
mass = 0.1
frequency = 0.5
length = 0.3
drag = 2.1
"""
COARSE_WALK = "\n[numerics]\nsteps = 8\nelements = 4\nduration = 1.0\n"
SMALL = {
    "march.toml": f"{VISCOUS.text}[numerics]\nphases = 16\ncycles = 1\n{MARCH}",
    "walk.toml": scenes.load("xplorer").text + COARSE_WALK,
    "rod.toml": scenes.load("c-leg").text,
    "s.toml": VISCOUS.text + "[numerics]\nphases = 64\ngrid = 9\n",
}
SWEEP = "--over medium.ratio=2,3 --over gait.amplitude=0.2:1:80"
COMMANDS = [
    "displacement march.toml --amplitudes 0.2 --tol 0.1 --json",
    "displacement s.toml --amplitudes 0.5 --plot out.png",
    "trajectory march.toml --cycles 2 -o out.csv",
    "accuracy rod.toml -o out.nc",
    "accuracy s.toml -o out.nc",
    "ccf s.toml --plot out.png",
    "run s.toml -o out",
    f"sweep s.toml {SWEEP} -o out.nc",
    "sweep walk.toml --over robot.mass=0.1:0.2:9 -o out.nc",
]


@pytest.fixture
def cache(tmp_path_factory, monkeypatch):
    """A folder in place of the user's cache folder, which holds compiled code."""
    folder = tmp_path_factory.mktemp("cache")

    def file(question):
        return folder / f"{question.hex()}.partial"

    monkeypatch.setattr(store, "cache_file", file)
    return folder


@pytest.fixture
def small(tmp_path, monkeypatch, cache):
    """A folder with small scenes, whose requests have many parts."""
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 40)
    monkeypatch.setattr(runners, "CHECKPOINT", -1.0)
    monkeypatch.setattr(walking, "PILOT", 0.0)
    monkeypatch.setattr(walking, "BATCH", 2)
    monkeypatch.setattr(type(scenes.load("c-leg")), "ladder", (4, 8, 16, 32))
    for file, content in SMALL.items():
        (tmp_path / file).write_text(content)
    return tmp_path


@pytest.mark.parametrize("line", COMMANDS)
def test_a_stopped_command_says_what_is_kept_and_where(line, small, cache):
    for after, n_kept in ((2, 2), (1, 3)):
        with counted(after):
            code, out, err = geomech(*line.split(), cwd=small)
        assert (code, out) == (143, ""), err
        (path,) = [*small.rglob("*.partial"), *cache.glob("*.partial")]
        if path.parent == small:
            path = path.relative_to(small)
        kept = f"{n_kept} results are stored in {path}: repeat the command"
        assert kept in err


def test_results_stay_until_they_are_saved(small, monkeypatch):
    def no_room(*_):
        raise OSError(28, "No space left on device")

    line = ["displacement", "march.toml", "--amplitudes", "0.5", "--plot", "d.png"]
    monkeypatch.setattr(store, "CHECKPOINT", -1.0)
    with monkeypatch.context() as patch:
        patch.setattr(plots, "save", no_room)
        assert geomech(*line, cwd=small)[0] == 2
    with counted() as computed:
        assert geomech(*line, cwd=small)[0] == 0
    assert computed == []


LAW = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Ratio:
    power: float
    law = "of-a-run"

    def traction(self, v_t, v_n, eps=0.0):
        return v_t, 3.0 * v_n
"""


@pytest.mark.usefixtures("own_parts")
def test_edited_code_resumes_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 40)
    text = VISCOUS.text.replace("viscous", "of-a-run").replace("ratio", "power")
    (tmp_path / "s.toml").write_text(text)
    line = ["connection", "s.toml", "--grid", "7", "--plugin", "law.py", "-o", "f.nc"]
    counts = []
    for law, stop in ((LAW, 2), (LAW.replace("3.0", "2.9"), None), (LAW, None)):
        (tmp_path / "law.py").write_text(law)
        with counted(stop) as computed:
            geomech(*line, cwd=tmp_path)
        counts.append(len(computed))
    stopped_after, edited, whole = counts
    assert edited == whole > stopped_after == 2


def test_results_follow_from_the_files_that_a_scene_names(tmp_path):
    medium = tmp_path / "m.toml"
    medium.write_text("ratio = 2.0")
    first = digest_context([medium])
    medium.write_text("ratio = 3.0")
    assert digest_context([medium]) != first
