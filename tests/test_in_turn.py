"""What is computed piece after piece goes on where it was stopped, to the last digit: steps in time, strides, rounds."""

import contextlib
import dataclasses
import importlib
import json
import re
import signal
import types
from typing import NamedTuple

import numpy as np
import pytest
from test_cli import geomech

from geomech import scene as scenes
from geomech import terminal, workers
from geomech.commands.asked import keeping, one_way
from geomech.output import plots
from geomech.study import cost, estimate, intrusion, motion, walking
from geomech.study.parts import Parts, asking
from rft import Backbone, DisturbedGround, Granular, Transient, backend, in_turn, time_steps
from rft import BodyInertia as Heavy
from rft.effects.base import Process
from rft.premise import Premise
from rft.time_stepping import _Steps

VISCOUS = scenes.load("three-link-viscous")
ASKED = {"geomech": "1", "solver": 1, "command": "test"}
EFFECTS = {
    "transient": [Transient(travel=0.03)],
    "heavy and disturbed": [Heavy(mass=0.4, frequency=0.7, length=0.3, drag=2.1), DisturbedGround(0.08, 0.6)],
}
BODY, LAW = Backbone(elements=5, length=1.4), Granular(C=1.6, gamma0=0.3)
T = 2 * np.pi * np.arange(8) / 8
ALPHA = np.cos(T[:, None] - 0.9 * np.arange(BODY.joints)) * np.array([0.5, -0.7])[:, None, None] + 0.05
ALPHADOT = -np.sin(T[:, None] - 0.9 * np.arange(BODY.joints)) * np.array([0.5, -0.7])[:, None, None]


@pytest.fixture(autouse=True)
def step_by_step(monkeypatch):
    """A piece for each step."""
    monkeypatch.setattr(in_turn, "LONG_ENOUGH", -1.0)


@contextlib.contextmanager
def counted(of, name, stop=None):
    """How often a method is called, in a list; stopped by a signal after so many."""
    calls, real = [], getattr(of, name)

    def counting(*args, **options):
        if len(calls) == stop:
            raise terminal.Stopped(signal.SIGTERM)
        calls.append(name)
        return real(*args, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(of, name, counting)
        yield calls


def asked(path, ask, what=(_Steps, "next")):
    """(what it gives, steps that are taken), with what is kept."""
    with counted(*what) as calls, Parts(path, ASKED) as some, workers.keeping(some):
        return ask(), len(calls)


def stopped(path, after, ask, what=(_Steps, "next")):
    with (
        pytest.raises(terminal.Stopped) as ended,
        counted(*what, after),
        Parts(path, ASKED) as some,
        workers.keeping(some),
    ):
        ask()
    return "".join(getattr(ended.value, "__notes__", ""))


def same(a, b):
    """To the last bit, whatever they are made of."""
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    return np.shape(a) == np.shape(b) and np.array(a).tobytes() == np.array(b).tobytes()


def march(effects, cycles=None, back_end="numpy"):
    more = {"cycles": cycles, "backend": back_end, "pieces": 5}
    return tuple(time_steps(LAW, BODY, ALPHA, ALPHADOT, effects=effects, with_work=True, with_path=True, **more))


@pytest.mark.parametrize("effects", EFFECTS)
def test_a_march_goes_on_where_it_was(effects, tmp_path, monkeypatch):
    """What the ground and the body remember, and the kicks towards the limit cycle, as if it had never been stopped."""
    cycles = None if effects == "transient" else 3
    ask = lambda: march(EFFECTS[effects], cycles)
    with counted(_Steps, "next") as calls, monkeypatch.context() as patch:
        patch.setattr(in_turn, "LONG_ENOUGH", 60.0)
        whole = ask()
    for k, after in enumerate((1, 20)):
        said = stopped(tmp_path / str(k), after, ask)
        again = "the same command goes on from there"
        assert said == f"{after} of {after + 1} parts so far are kept in {tmp_path / str(k)}: {again}"
        found, steps = asked(tmp_path / str(k), ask)
        assert steps == len(calls) - after and same(found, whole)


def test_heavy_bodies_are_kicked_as_before(tmp_path):
    ask = lambda: march(EFFECTS["heavy and disturbed"][:1])
    with counted(_Steps, "kick") as kicks, counted(_Steps, "next") as calls:
        whole = ask()
    assert len(kicks) > 1
    stopped(tmp_path / "p", len(calls) - 3, ask)
    found, steps = asked(tmp_path / "p", ask)
    assert steps == 3 and same(found, whole)


def test_long_pieces_end_with_their_cycle(monkeypatch):
    monkeypatch.setattr(in_turn, "LONG_ENOUGH", 60.0)
    pieces = []
    with in_turn.keeping(lambda what, compute, start: pieces.append(what) or compute()):
        few = march(EFFECTS["transient"], 2)
    assert pieces == ["steps", "steps"]
    monkeypatch.undo()
    assert same(march(EFFECTS["transient"], 2), few)


def test_what_may_come_out_otherwise_is_not_kept(tmp_path):
    """ "auto" may take another back end the next time; one that is named, or settled, does not."""
    ask = lambda: march(EFFECTS["transient"], back_end="auto")
    assert stopped(tmp_path / "p", 12, ask) == "" and list(tmp_path.iterdir()) == []
    with backend.settled("numpy"):
        assert stopped(tmp_path / "p", 12, ask).startswith("12 of ")
    assert stopped(tmp_path / "q", 12, lambda: march(EFFECTS["transient"])).startswith("12 of ")


class Named(NamedTuple):
    steps: int


@dataclasses.dataclass(frozen=True)
class Own(Process):
    """Remembers in a way of its own."""

    form: object = dict
    breaks = Premise.MEMORYLESS

    def begin(self, site):
        return self.form(steps=0)

    def at(self, state, site):
        return types.SimpleNamespace(apply=lambda model: model)

    def after(self, state, site, v):
        return self.form(steps=(state["steps"] if isinstance(state, dict) else state.steps) + 1)


@pytest.mark.parametrize("form", [dict, Named])
def test_what_others_remember_is_kept_if_it_is_numbers(form, tmp_path):
    """A tuple with names is not: it would come back without them."""
    ask = lambda: march([Own(form)], 2)
    assert stopped(tmp_path / "p", 12, ask) == ""
    found, steps = asked(tmp_path / "p", ask)
    assert steps == 16 and same(found, march([Own(form)], 2)) and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_a_walk_goes_on_where_it_was(engine, tmp_path):
    """With its limit cycle, and in three dimensions with all that bodies do."""
    scene = scenes.load("xplorer")
    few = dataclasses.replace(scene.numerics, steps=8, elements=4, duration=0.8)
    if engine == "mujoco":
        pytest.importorskip("mujoco", reason="needs the extra: pip install 'geomech[mujoco]'")
        from rft.walking.mujoco_walk import Course as of

        name, ask = "_stride", lambda: of(scene.walker, few).walk(3, 0.8)
    else:
        from rft.walking import planar_walk
        from rft.walking import stride as of

        name, ask = "march", lambda: planar_walk.walk([scene.walker], few)
    with counted(of, name) as calls:
        whole = ask()
    assert len(calls) > 2
    after = len(calls) - 1
    assert stopped(tmp_path / "p", after, ask, (of, name)).startswith(f"{after} of {after + 1} parts so far are kept")
    found, strides = asked(tmp_path / "p", ask, (of, name))
    assert strides == 1 and same(found, whole)


def test_gaits_are_kept_group_by_group(tmp_path, monkeypatch):
    scene, amplitudes = scenes.load("three-link-glass"), np.array([0.4, 0.9, 1.3])
    monkeypatch.setattr(type(scene.system), "at_once", lambda self, phases: 1)
    ask = lambda: estimate.direct(scene, scene.gait, amplitudes, 32)
    whole, what = ask(), (estimate, "_direct")
    assert stopped(tmp_path / "p", 2, ask, what) == ""
    with backend.settled("numpy"):
        stopped(tmp_path / "p", 2, ask, what)
        found, groups = asked(tmp_path / "p", ask, what)
    assert groups == 1 and same(found, whole)


def test_what_a_request_costs_is_no_part_of_it(tmp_path, monkeypatch):
    """How many pilots there are hangs on the clock."""
    monkeypatch.setattr(cost, "FREE", 0.0)
    scene = scenes.parse(scenes.load("sandfish-transient").text.replace("100", "5"))
    with Parts(tmp_path / "p", ASKED) as some, workers.keeping(some):
        with workers.one_way(workers.MANY):
            motion.cost(scene)
        assert some.calls == 0


SMALL = {
    "march.toml": scenes.load("sandfish-transient").text.replace("= 100", "= 5").replace("phases = 64", "phases = 16"),
    "walk.toml": scenes.load("xplorer").text + "\n[numerics]\nsteps = 8\nelements = 4\nduration = 1.0\n",
    "rod.toml": scenes.load("c-leg").text,
}
COMMANDS = {
    "displacement": ["march.toml", "--amplitudes", "0.2", "--tol", "0.1", "--json"],
    "trajectory": ["march.toml", "-o", "t.csv", "--cycles", "2"],
    "animate": ["march.toml", "-o", "f.png"],
    "walk": ["walk.toml", "-o", "w"],
    "accuracy": ["rod.toml", "-o", "a"],
}
COUNTED = {
    "walk": "rft.walking.stride.march",
    "accuracy": "geomech.study.intrusion._answer",
}


@pytest.fixture
def small(tmp_path, monkeypatch):
    """Small scenes that count as large ones."""
    monkeypatch.setattr(cost.Cost, "small", False)
    monkeypatch.setattr(cost, "FREE", 1e9)
    monkeypatch.setattr(walking, "PILOT", 0.0)
    monkeypatch.setattr(type(scenes.load("c-leg")), "ladder", (4, 8, 16, 32))
    for file, text in SMALL.items():
        (tmp_path / file).write_text(text)
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_go_on(command, small):
    """Each says what is kept, and where, and does it once."""
    of, _, name = COUNTED.get(command, "rft.time_stepping._Steps.next").rpartition(".")
    of = _Steps if of.endswith("_Steps") else importlib.import_module(of)
    args = [command, *COMMANDS[command]]
    args += ["--workers", "1"] if command in ("displacement", "accuracy") else []
    parts = []
    for after in (2, 1):
        with counted(of, name, after):
            code, out, err = geomech(*args, cwd=small)
        (partial,) = {p.name for p in small.iterdir()} - {*SMALL}
        assert (code, out) == (143, "") and f" parts so far are kept in {partial}: the same command goes on" in err
        parts.append(int(re.search(r"stopped by SIGTERM: (\d+) of ", err)[1]))
    assert parts[1] == parts[0] + 1


def test_a_command_that_goes_on_leaves_its_results_and_nothing_else(small):
    args = ["trajectory", "march.toml", "--cycles", "2", "-o"]
    with counted(_Steps, "next", 30):
        assert geomech(*args, "t.csv", cwd=small)[0] == 143
    with counted(_Steps, "next") as calls:
        assert geomech(*args, "t.csv", cwd=small)[0] == geomech(*args, "whole.csv", cwd=small)[0] == 0
    assert len(calls) % 32 == 2  # whole cycles twice, but for 30 steps
    assert (small / "t.csv").read_bytes() == (small / "whole.csv").read_bytes()
    assert {p.name for p in small.iterdir()} == {*SMALL, "t.csv", "whole.csv"}


def test_what_a_picture_is_of_is_kept_until_it_is_saved(small):
    args = ["displacement", "heavy.toml", "--amplitudes", "0.5", "--plot", "d.png"]
    heavy = VISCOUS.text + "[numerics]\nphases = 32\ncycles = 1\n[[effects]]\nkind = 'body-inertia'\n"
    (small / "heavy.toml").write_text(heavy + "mass = 0.1\nfrequency = 0.5\nlength = 0.3\ndrag = 2.1\n")
    with counted(plots, "save", 0):
        code, _, err = geomech(*args, cwd=small)
    assert code == 143 and " parts so far are kept in .d.png.partial: " in err
    with counted(_Steps, "next") as calls:
        assert geomech(*args, cwd=small)[0] == 0
    assert calls == [] and (small / "d.png").exists() and not (small / ".d.png.partial").exists()


def test_one_back_end_is_no_matter_of_the_clock():
    for seconds in (0.1, 100.0):
        takes = cost.Cost(99_999, seconds, 0.0)
        assert not one_way(VISCOUS, takes) and one_way(VISCOUS, takes._replace(balances=100_000))
        assert one_way(scenes.load("sandfish-heavy"), takes)


def test_what_is_too_small_to_be_kept_is_by_one_back_end_too(tmp_path, monkeypatch):
    """What is small hangs on the clock, digits do not."""
    monkeypatch.chdir(tmp_path)
    for large, output in ((False, None), (True, None), (False, tmp_path / "f.csv")):
        with keeping(VISCOUS, output, large, one_way=True, command="test"):
            assert workers.settled_on() == "numpy"
        assert list(tmp_path.iterdir()) == []


def test_an_accuracy_that_goes_on_is_that_of_one_go(small, tmp_path, monkeypatch):
    monkeypatch.setattr(walking, "KNOBS", {"steps": (8, 9)})
    monkeypatch.setattr(walking, "FINEST", {"steps": 10})
    monkeypatch.setattr(walking, "SETTLING", 1)
    for name, study in (("walk", walking), ("rod", intrusion)):
        scene, what = scenes.load(small / f"{name}.toml"), (study, "_answer")
        ask = lambda study=study, scene=scene: [line["error"] for line in study.study(scene)["lines"]]
        with counted(*what) as calls:
            whole = ask()
        stopped(tmp_path / name, 2, ask, what)
        found, answers = asked(tmp_path / name, ask, what)
        assert answers == len(calls) - 2 and found == whole


def test_a_question_of_any_scene_has_all_that_its_numbers_follow_from():
    for name in ("xplorer", "screws", "c-leg", "screw"):
        scene = scenes.load(name)
        mine = asking(scene, command="accuracy")
        assert json.loads(json.dumps(mine)) == mine
        assert asking(dataclasses.replace(scene, name="other"), command="accuracy") == mine
        some = [f.name for f in dataclasses.fields(scene) if f.name not in ("name", "text", "files")]
        assert {*some, "scene", "geomech", "solver", "command"} <= {*mine}
