"""What is stopped resumes where it was, to the last digit, whoever computes; what has changed is computed again."""

import contextlib
import dataclasses
import json
import re
import signal
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from commands import geomech
from tasks import doubled, who
from test_store import HARD, same

from geomech import api, load_result, plots, scenes
from geomech.mathematics.geometry import connection
from geomech.mathematics.systems.capabilities import with_solver
from geomech.questions.swimmers.trajectory import Trajectory
from geomech.run import pending, store
from geomech.run import runner as runners
from geomech.run.digest import Undigestible
from geomech.run.runner import Runner, digest_context, runner
from geomech.run.store import Store
from geomech.run.workers import using
from geomech.scenes import inputs, kinds
from geomech.shell import cli, terminal
from geomech.shell.pipeline import allow, storing
from geomech.studies.displacement import tiered
from geomech.studies.estimates import cost, estimate
from geomech.studies.optimisation import build_request, search
from geomech.studies.optimisation.variables import displacement, values
from geomech.studies.scene_tables import SceneTables
from geomech.studies.terradynamics import walking
from rft import Backbone, DisturbedGround, Granular, Transient
from rft import BodyInertia as Heavy
from rft.balance import backend
from rft.core.premise import Premise
from rft.core.refusal import Refusal
from rft.effects import Effect
from rft.laws import LAWS
from rft.motion.stepping import Stepping

GLASS, VISCOUS = scenes.load("three-link-glass"), scenes.load("three-link-viscous")
ASKED = Trajectory(VISCOUS)


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    """In place of the user's cache folder, which has compiled code, too."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setattr(
        store, "cache_file", lambda question: folder / f"{question.hex()}.partial"
    )
    return folder


@pytest.fixture
def step_by_step(monkeypatch):
    """A piece for each step; written as it comes."""
    monkeypatch.setattr(runners, "CHECKPOINT", -1.0)


@contextlib.contextmanager
def counted(stop=None):
    """What is computed and stored, in a list; stopped by a signal after so many. Nothing is computed that has no key."""
    computed, real, digest = [], Store.put, runners.digest

    def putting(self, key, value, kind):
        if len(computed) == stop:
            raise terminal.Stopped(signal.SIGTERM)
        computed.append(value)
        real(self, key, value, kind)

    def telling(*what):
        try:
            return digest(*what)
        except Undigestible as error:
            raise AssertionError(error) from None

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "put", putting)
        patch.setattr(runners, "digest", telling)
        yield computed


def asked(path, ask, context=()):
    """(what it gives, how many tasks of it are computed), with what is stored."""
    with counted() as computed, runners.store_results(path, context):
        return ask(), len(computed)


def stopped(path, after, ask, context=()):
    """What the stop says."""
    with (
        pytest.raises(terminal.Stopped) as ended,
        counted(after),
        runners.store_results(path, context),
    ):
        ask()
    return "".join(getattr(ended.value, "__notes__", ""))


def hard(_, x) -> tuple[np.ndarray, tuple[np.ndarray, float, int], float]:
    return HARD[np.ndarray], HARD[tuple[np.ndarray, float, int]], float(x)


def fails(by, x):
    if x == 2 / 7:
        raise ValueError("no such thing")
    return by * x


def within(by, x) -> float:
    """A task that asks for tasks itself."""
    return float(sum(runner().map(doubled, by, [x, x], 2)).sum())


def calls(task=doubled, of=(3, 2)):
    """Requests of some tasks each."""
    return [
        x
        for k, n in enumerate(of)
        for x in runner().map(task, np.array([k + 1.0]), np.arange(n) / 7, n)
    ]


@pytest.mark.parametrize("task", [doubled, hard, within])
def test_what_is_stopped_resumes_where_it_was(task, tmp_path):
    ask, path = lambda: calls(task), tmp_path / "p"
    whole = ask()
    for stop in (1, 2, 3, 4):
        said = stopped(path, stop, ask)
        assert (
            said
            == f"{stop} results so far are kept in {path}: the same command goes on from there"
        )
        again, computed = asked(path, ask)
        assert computed == 5 - stop and same(again, whole)
        assert not path.exists()


def test_a_request_that_ends_well_or_is_refused_soon_leaves_nothing(tmp_path):
    assert asked(tmp_path / "p", calls)[1] == 5
    with pytest.raises(ValueError, match="no such"):
        asked(tmp_path / "p", lambda: calls(fails, (5,)))
    assert list(tmp_path.iterdir()) == []


def test_what_took_long_is_kept_whatever_ends_it(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "CHECKPOINT", -1.0)
    with pytest.raises(ValueError, match="no such") as ended:
        asked(tmp_path / "p", lambda: calls() + calls(fails, (5,)))
    assert ended.value.__notes__[0].startswith("7 results so far are kept")
    assert asked(tmp_path / "p", calls)[1] == 0


def test_results_are_found_by_what_they_follow_from_and_nothing_else(tmp_path):
    """Not by their order or number; context, task, what tasks share, item and back end all count."""
    path = tmp_path / "p"
    stopped(path, 5, lambda: calls(of=(3, 3)))
    one, sevenths = np.array([1.0]), np.arange(4) / 7
    for ask, context, computed in (
        (lambda: calls(of=(3, 2)), (), 0),
        (lambda: calls(of=(2, 1)), ("another version",), 3),
        (lambda: calls(within, of=(2, 1)), (), 3),
        (lambda: list(runner().map(doubled, one, sevenths[[2, 0, 3, 1]], 4)), (), 1),
        (lambda: list(runner().map(doubled, one + 1e-15, sevenths[:2], 2)), (), 2),
        (
            lambda: list(
                runner().map(doubled, one, [sevenths[0], sevenths[1] + 1e-15], 2)
            ),
            (),
            1,
        ),
    ):
        with counted() as done, runners.store_results(path, context, keep=True):
            ask()
        assert len(done) == computed
    with backend.preferring("numba"):
        assert asked(path, lambda: calls(of=(3, 2)))[1] == 5


def test_no_faster_back_end_is_taken_than_at_first(tmp_path):
    """Where the first had workers without compiled code; what is preferred follows from the request."""
    ask = lambda: [x[2] for x in runner().map(who, None, range(4), 4)]
    patch = pytest.MonkeyPatch()
    patch.setattr(backend, "fastest", lambda: "numpy")
    with backend.preferring("numpy"):
        with patch.context():
            stopped(tmp_path / "p", 2, calls)
        patch.undo()
    patch = pytest.MonkeyPatch()
    with patch.context() as there:
        there.setattr(runners, "fastest", lambda: "numba")
        with (
            backend.preferring("numba"),
            runners.store_results(tmp_path / "p", keep=True),
        ):
            assert ask() == 4 * ["numpy"]
            allow(ASKED, cost.Cost(10**6, 1.0, 0.0), yes=True)
            assert ask() == 4 * ["numpy"]


def test_a_count_of_balances_decides_on_the_back_end_and_no_clock():
    for balances, expected in ((99_999, "numpy"), (100_000, backend.fastest())):
        for seconds in (0.1, 50.0):
            with backend.preferring("numpy"):
                allow(ASKED, cost.Cost(balances, seconds, 0.0), yes=True)
                assert backend.preferred() == expected


def test_a_command_begins_with_numpy(monkeypatch, capsys):
    """Whose first call takes least."""
    preferred = []
    monkeypatch.setattr("geomech.run.backend.prefer", preferred.append)
    with pytest.raises(SystemExit):
        cli.main(["scenes"])
    assert preferred == ["numpy"]


def test_others_resume_too(tmp_path, monkeypatch):
    """Two processes what one alone has left, and the other way round."""
    monkeypatch.setattr(pending, "WORTH_PROCESSES", 0.0)
    ask, whole = lambda: calls(of=(8, 8)), calls(of=(8, 8))
    for first, second in ((2, 1), (1, 2)):
        with using(first):
            stopped(tmp_path / str(first), 11, ask)
        with using(second):
            found, computed = asked(tmp_path / str(first), ask)
        assert computed == 5 and same(found, whole)


def test_what_has_no_digest_is_computed_and_not_stored(tmp_path):
    with runners.store_results(tmp_path / "p") as some:
        assert list(runner().map(doubled, 2, [8], 1)) == [16]
        assert list(runner().map(lambda by, x: by * next(x), 2, [iter([3])], 1)) == [6]
        assert len(some.store.new) == 1


def test_studies_resume_to_the_last_digit(tmp_path, monkeypatch):
    """Error studies, searches from several starts, fields with what moving costs; seconds are those of the first
    time."""
    few = [
        dataclasses.replace(k, values=k.values[:2])
        for k in tiered.SETTINGS
        if k.tier == "direct"
    ]
    monkeypatch.setattr(tiered, "SETTINGS", few)
    monkeypatch.setattr(tiered, "TRUTH_PHASES", 64)
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 100)
    monkeypatch.setattr(type(scenes.load("c-leg")), "ladder", (4, 8, 16, 32))
    scene = GLASS.with_numerics(grid=5, phases=16, harmonics=3)
    request = build_request(
        VISCOUS.with_numerics(phases=32), "efficiency", harmonics=1, starts=2
    )

    def field():
        study = SceneTables(scene)
        return [
            study.compute_metric().coefficients,
            study.fitted.A,
            study.fitted.residual,
        ]

    told = lambda found: values(found) + displacement(found)
    numbers = lambda: [json.dumps([float(v) for v in told(search(request))])]

    def errors(scene, runs=None):
        found = api.accuracy(scene, runs=runs)
        names = [name for name in ("error", "force_error") if name in found]
        return [found[name].values for name in names]

    for ask, after in (
        (lambda: errors(scene, 1), 5),
        (lambda: errors(scenes.load("c-leg")), 2),
        (field, 4),
        (numbers, 1),
    ):
        path = tmp_path / "p"
        with counted() as every, runners.store_results(path):
            whole = ask()
        stopped(path, after, ask)
        again, computed = asked(path, ask)
        assert (
            all(map(np.array_equal, again, whole))
            and computed == len(every) - after > 0
        )


# One after the other.


EFFECTS = {
    "transient": [Transient(travel_m=0.009)],
    "heavy and disturbed": [
        Heavy(mass=0.4, frequency=0.7, length=0.3, drag=2.1),
        DisturbedGround(weakening=0.6, radius_m=0.024),
    ],
    "heavy": [Heavy(mass=0.4, frequency=0.7, length=0.3, drag=2.1)],
}
SOLVER = {"backend": "numpy", "pieces": 5}
T = 2 * np.pi * np.arange(8) / 8


def march(effects, cycles=None):
    """All of a run of two gaits."""
    body = Backbone(elements=5, length=0.3)
    system = dataclasses.replace(
        VISCOUS.system,
        medium=Granular(C=1.6, gamma0=0.3),
        body=body,
        effects=tuple(effects),
    )
    system, size = (
        with_solver(system, {**SOLVER, "cycles": cycles}),
        np.array([0.5, -0.7])[:, None, None],
    )
    turns = T[:, None] - 0.9 * np.arange(body.joints)
    return tuple(
        system.time_steps(
            np.cos(turns) * size + 0.05,
            -np.sin(turns) * size,
            cycles,
            work=True,
            path=True,
        )
    )


@contextlib.contextmanager
def steps():
    """The steps that are taken, in a list."""
    taken, real = [], Stepping.step

    def step(self, state, with_work=False):
        taken.append(state.count)
        return real(self, state, with_work)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Stepping, "step", step)
        yield taken


@pytest.mark.parametrize("effects", EFFECTS)
def test_a_march_resumes_where_it_was(effects, tmp_path, monkeypatch):
    """What the ground and the body remember, and the kicks towards the limit cycle, as if it had never been stopped."""
    ask = lambda: march(EFFECTS[effects], 3 if "disturbed" in effects else None)
    with steps() as every:
        whole = ask()
    monkeypatch.setattr(runners, "CHECKPOINT", -1.0)
    for after in (len(every) - 3,):
        said = stopped(tmp_path / str(after), after, ask)
        assert (
            said
            == f"{after} results so far are kept in {tmp_path / str(after)}: the same command goes on from there"
        )
        with steps() as rest:
            found, _ = asked(tmp_path / str(after), ask)
        assert len(rest) == len(every) - after
        for a, b in zip(found, whole, strict=True):
            assert (
                np.array_equal(a, b)
                if not isinstance(a, tuple)
                else all(map(np.array_equal, a, b))
            )


def test_a_march_loses_little(tmp_path, monkeypatch):
    """Pieces take two seconds, or a cycle; they are written as soon."""
    clock = [0.0]
    monkeypatch.setattr(runners.time, "monotonic", lambda: clock[0])

    def step(state):
        clock[0] += 0.7
        return state + 1, np.array([state])

    with counted() as pieces, runners.store_results(tmp_path / "p", keep=True) as some:
        assert some.iterate(step, 0, 10, ("test",), np.ndarray) == (
            10,
            [np.array([k]) for k in range(10)],
        )
        assert [len(rows) for _, rows in pieces] == [3, 3, 3, 1] and len(
            some.store.new
        ) <= 1
    with counted() as pieces, runners.store_results(tmp_path / "p"):
        assert (
            runner().iterate(step, 0, 10, ("test",), np.ndarray)[0] == 10
            and pieces == []
        )
        assert (
            runner().iterate(step, 0, 10, ("other",), np.ndarray)[0] == 10
            and len(pieces) == 4
        )


class Named(NamedTuple):
    steps: np.ndarray


@dataclasses.dataclass(frozen=True)
class Own(Effect):
    """Remembers in a way of its own."""

    form: object = Named
    breaks = Premise.MEMORYLESS
    kind = "own"

    def check(self, medium):
        pass

    def begin(self, problem, site):
        return self.form(steps=np.zeros((1, 1)))

    def apply(self, problem, site, past):
        return problem

    def after(self, problem, site, past, v):
        return self.form(
            steps=(past["steps"] if isinstance(past, dict) else past.steps) + 1
        )


@pytest.mark.parametrize("form", [Named, dict])
def test_what_others_remember_is_kept(form, tmp_path, step_by_step):
    ask = lambda: march([Own(form)], 2)
    whole = ask()
    assert stopped(tmp_path / "p", 12, ask).startswith("12 results")
    with steps() as rest:
        found, _ = asked(tmp_path / "p", ask)
    assert len(rest) == 4 and all(map(np.array_equal, found[:4], whole[:4]))


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_a_walk_resumes_where_it_was(engine, tmp_path):
    """With its limit cycle and its errors, and in three dimensions with all that bodies do."""
    if engine == "mujoco":
        pytest.importorskip(
            "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
        )
    scene = scenes.load("xplorer")
    few = dataclasses.replace(scene.numerics, steps=8, elements=4, duration=0.3)
    ask = lambda: walking.walked(
        [dataclasses.replace(scene, numerics=few)], engine, settling=True
    )[0]
    with counted() as every, runners.store_results(tmp_path / "p"):
        whole = ask()
    assert len(every) > 7  # of the walk and of those that tell its errors
    after = len(every) // 2
    assert stopped(tmp_path / "p", after, ask).startswith(
        f"{after} results so far are kept"
    )
    found, strides = asked(tmp_path / "p", ask)
    assert strides == len(every) - after and found[1:] == whole[1:]
    for a, b in zip(found.walk[:6], whole.walk[:6], strict=True):
        np.testing.assert_array_equal(a, b)


def test_gaits_are_kept_group_by_group(tmp_path, monkeypatch):
    amplitudes = np.array([0.4, 0.9, 1.3])
    monkeypatch.setattr(estimate, "gaits_per_batch", lambda system, phases: 1)
    ask = lambda: estimate.direct(GLASS, GLASS.gait, amplitudes, 32)
    whole = ask()
    stopped(tmp_path / "p", 2, ask)
    found, groups = asked(tmp_path / "p", ask)
    assert groups == 1 and same(found, whole)


# Commands.


@pytest.fixture
def fine(monkeypatch):
    """Small parts."""
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 40)


HEAVY = "[[effects]]\nkind = 'body-inertia'\nmass = 0.1\nfrequency = 0.5\nlength = 0.3\ndrag = 2.1\n"
FIELD = ["connection", "three-link-viscous", "--grid", "9", "-o"]
SMALL = {
    "march.toml": f"{VISCOUS.text}[numerics]\nphases = 16\ncycles = 1\n{HEAVY}",
    "walk.toml": scenes.load("xplorer").text
    + "\n[numerics]\nsteps = 8\nelements = 4\nduration = 1.0\n",
    "rod.toml": scenes.load("c-leg").text,
    "s.toml": VISCOUS.text + "[numerics]\nphases = 64\ngrid = 9\n",
}
OVER = ["--over", "medium.ratio=2,3", "--over", "gait.amplitude=0.2:1:80"]
COMMANDS = {
    "displacement march.toml": ["--amplitudes", "0.2", "--tol", "0.1", "--json"],
    "displacement s.toml": ["--amplitudes", "0.5", "--plot", "out.png"],
    "trajectory march.toml": ["--cycles", "2", "-o", "out.csv"],
    "trajectory march.toml --cycles 1": ["--plot", "out.png"],
    "walk walk.toml": ["-o", "out.nc"],
    "accuracy rod.toml": ["-o", "out.nc"],
    "accuracy s.toml": ["-o", "out.nc"],
    "ccf s.toml": ["--plot", "out.png"],
    "optimize s.toml": [
        "--objective",
        "displacement",
        "--starts",
        "3",
        "--harmonics",
        "1",
        "--workers",
        "1",
        "-o",
        "out.toml",
    ],
    "run s.toml": ["-o", "out"],
    "sweep s.toml": [*OVER, "-o", "out.nc"],
    "sweep walk.toml": ["--over", "robot.mass=0.1:0.2:9", "-o", "out.nc"],
}


@pytest.fixture
def small(tmp_path, monkeypatch, fine, step_by_step):
    """Small scenes whose requests are made of many tasks."""
    monkeypatch.setattr(walking, "PILOT", 0.0)
    monkeypatch.setattr(walking, "BATCH", 2)
    monkeypatch.setattr(type(scenes.load("c-leg")), "ladder", (4, 8, 16, 32))
    for file, content in SMALL.items():
        (tmp_path / file).write_text(content)
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_resume(command, small, own_cache):
    """Each says what is kept, and where, and computes it once."""
    args = [*command.split(), *COMMANDS[command]]
    counts = []
    for after in (2, 1):
        with counted(after):
            code, out, err = geomech(*args, cwd=small)
        places = [*small.rglob("*.partial"), *own_cache.glob("*.partial")]
        assert (code, out, len(places)) == (143, "", 1), err
        (name,) = {
            places[0].relative_to(small)
            if places[0].is_relative_to(small)
            else places[0]
        }
        assert (
            f" results so far are kept in {name}: the same command goes on from there: geomech {args[0]} "
            in err
        )
        assert str(name) == f".{args[-1]}.partial" or "--json" in args
        counts.append(int(re.search(r"stopped by SIGTERM: (\d+) results", err)[1]))
    assert counts == [2, 3]


def test_a_command_that_resumes_leaves_its_results_and_nothing_else(small):
    args = ["trajectory", "march.toml", "--cycles", "2", "-o"]
    with counted(30):
        assert geomech(*args, "t.csv", cwd=small)[0] == 143
    with steps() as taken:
        assert (
            geomech(*args, "t.csv", cwd=small)[0]
            == geomech(*args, "whole.csv", cwd=small)[0]
            == 0
        )
    assert len(taken) % 32 == 2  # whole cycles twice, but for 30 steps
    assert (small / "t.csv").read_bytes() == (small / "whole.csv").read_bytes()
    assert {p.name for p in small.iterdir()} == {*SMALL, "t.csv", "whole.csv"}


def test_results_stay_until_they_are_saved(small, monkeypatch):
    """A failure to draw costs no computing."""
    args = ["displacement", "march.toml", "--amplitudes", "0.5", "--plot", "d.png"]
    monkeypatch.setattr(store, "CHECKPOINT", -1.0)
    with monkeypatch.context() as patch:
        patch.setattr(
            plots,
            "save",
            lambda *some: (_ for _ in ()).throw(OSError(28, "No space left on device")),
        )
        code, _, err = geomech(*args, cwd=small)
    assert (
        code == 2
        and "left on device; " in err
        and " results so far are kept in .d.png.partial: " in err
    )
    with steps() as taken:
        assert geomech(*args, cwd=small)[0] == 0
    assert (
        taken == []
        and (small / "d.png").exists()
        and not (small / ".d.png.partial").exists()
    )


def test_what_is_printed_is_kept_in_the_cache_and_not_where_the_command_runs(
    small, own_cache
):
    args = ["displacement", "march.toml", "--amplitudes", "0.2", "--tiers", "direct"]
    with counted(20):
        assert geomech(*args, cwd=small)[0] == 143
    with counted(3):
        assert (
            geomech(*args, "--json", cwd=small)[0] == 143
        )  # it is the same that is computed
    with counted(5):
        assert geomech(*args[:3], "0.3", *args[4:], cwd=small)[0] == 143
    assert len(list(own_cache.iterdir())) == 2 and {
        p.name for p in small.iterdir()
    } == {*SMALL}
    assert geomech(*args, cwd=small)[0] == 0
    assert len(list(own_cache.iterdir())) == 1


def same_but_seconds(*paths):
    """Whether results are the same to the last bit, but for the time they took."""
    one, two = (load_result(path).without("seconds").to_xarray() for path in paths)
    return one.identical(two)


def test_another_request_leaves_what_is_kept_of_the_first(tmp_path, fine):
    """As long as it is not done itself."""
    with counted(3):
        geomech(*FIELD, "f.nc", cwd=tmp_path)
    with counted(2):
        code, _, err = geomech(
            *[x.replace("9", "8") for x in FIELD], "f.nc", cwd=tmp_path
        )
    assert code == 143 and "5 results so far are kept in .f.nc.partial" in err
    with counted() as every:
        assert geomech(*FIELD, "whole.nc", cwd=tmp_path)[0] == 0
    with counted() as rest:
        assert geomech(*FIELD, "f.nc", cwd=tmp_path)[::2] == (0, "")
    assert len(rest) == len(every) - 3
    assert same_but_seconds(tmp_path / "f.nc", tmp_path / "whole.nc")
    assert {p.name for p in tmp_path.iterdir()} == {"f.nc", "whole.nc"}


POWER = """
from dataclasses import dataclass
import numpy as np

@dataclass(frozen=True)
class Power:
    power: float
    law = "power-of-jobs"

    def traction(self, v_t, v_n, eps=0.0):
        drag = (np.sqrt(v_t**2 + v_n**2 + eps**2) + 1e-300) ** (self.power - 1)
        return drag * v_t, 3.0 * drag * v_n
"""


def test_edited_code_resumes_nothing(tmp_path, fine, monkeypatch):
    """That of a law in a file of one's own, which a stopped command has used."""
    for name in ("_sources", "_files"):
        monkeypatch.setattr(kinds, name, {})
    monkeypatch.setattr(LAWS, "_parts", dict(LAWS))
    text = VISCOUS.text.replace('law = "viscous"', 'law = "power-of-jobs"').replace(
        "ratio = 2.0", "power = 1.0"
    )
    (tmp_path / "s.toml").write_text(text)
    args = ["connection", "s.toml", "--grid", "7", "-o", "f.nc", "--plugin", "power.py"]
    counts = []
    for law in (POWER, POWER, POWER.replace("3.0", "2.9"), POWER):
        (tmp_path / "power.py").write_text(law)
        with counted(2):
            code, _, err = geomech(*args, cwd=tmp_path)
        assert code == 143, err
        counts.append(re.search(r"(\d+) results so far", err)[1])
    with counted() as every:
        assert geomech(*args[:5], "whole.nc", *args[6:], cwd=tmp_path)[0] == 0
    with counted() as rest:
        assert geomech(*args, cwd=tmp_path)[0] == 0
    assert counts == ["2", "4", "6", "8"] and len(rest) == len(every) - 6 > 0
    assert same_but_seconds(tmp_path / "f.nc", tmp_path / "whole.nc")


def test_two_at_once_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with storing(ASKED, Path("f.nc"), []):
        for args in (
            FIELD,
            ["sweep", "three-link-viscous", "--over", "gait.amplitude=1", "-o"],
        ):
            for name in ("f.nc", f"../{tmp_path.name}/f.nc"):
                code, out, err = geomech(*args, name)
                assert (code, out, err.count("\n")) == (2, "", 1)
                assert err.startswith(
                    f"error: another computation to {name} is under way: wait for it"
                )
        assert geomech(*FIELD, "g.nc")[::2] == (0, "")
    assert [p.name for p in tmp_path.iterdir()] == ["g.nc"]


def test_what_is_printed_is_no_obstacle_to_another(own_cache, monkeypatch):
    monkeypatch.setattr(store, "CHECKPOINT", -1.0)
    with storing(ASKED, None, []):
        first = calls()
        assert len(list(own_cache.glob("*.partial"))) == 1
        with storing(ASKED, None, []):
            assert same(calls(), first)
        assert len(list(own_cache.glob("*.partial"))) == 1
    assert list(own_cache.iterdir()) == []


def test_what_a_scene_is_read_from_belongs_to_what_results_follow_from(tmp_path):
    """What is in other files, that is; a scene itself is an argument."""
    (tmp_path / "m.toml").write_text("ratio = 2.0")
    first = digest_context([tmp_path / "m.toml"])
    assert digest_context([tmp_path / "m.toml", tmp_path / "no.toml"]) == first
    (tmp_path / "m.toml").write_text("ratio = 3.0")
    assert digest_context([tmp_path / "m.toml"]) != first


def test_nothing_is_stored_over_an_input(tmp_path):
    (tmp_path / ".f.nc.partial").write_text(VISCOUS.text)
    name = str(tmp_path / ".f.nc.partial")
    scene = dataclasses.replace(VISCOUS, name=name)
    with (
        pytest.raises(Refusal, match="it is an input"),
        storing(Trajectory(scene), tmp_path / "f.nc", inputs(scene)),
    ):
        pass


def test_without_a_store_nothing_is_told_apart():
    assert (
        Runner().call(within, np.array([2.0]), 0.5) == 2.0 and Runner().key(1) is None
    )
