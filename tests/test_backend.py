"""Compiled descents against NumPy's: the same answers for every medium, body and effect; and which of the two is taken."""

import dataclasses
import errno
import hashlib
import itertools
import json
import os
import resource
import subprocess
import sys
import types

import numpy as np
import pytest
from registry import BODIES, EFFECTS, MEDIA
from test_cli import geomech
from test_hard_cases import GLASS, STRANGE_BODIES, hard

from geomech import scene as scenes
from geomech.gaits import Ellipse
from geomech.output.explain import explain
from geomech.systems import solver
from rft import Chain, EndCaps, GrainInertia, SkinFriction, TowedSled, backend, body_velocity, compiled, time_steps
from rft.bodies.base import Kinematics
from rft.contact import Model
from rft.media.base import TermLaw
from rft.newton import WARM, Balance
from rft.samples import Jacobian
from rft.workers import one_thread

BODY = Chain((1, 1.4, 0.8), frame="link-1", length=0.3)
GAIT = Ellipse(semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2))
BOTH = ("numpy", "numba")
ILL_CONDITIONED = ("a millionth of a link", "twelve")


def apart(one, other, alphadot, body):
    """(...,): how far body velocities differ, over the joints' speed."""
    speed = np.linalg.norm(alphadot, axis=-1, keepdims=True) + 1e-300
    return (np.abs(one.xi - other.xi) / [body.length, body.length, 1.0] / speed).max(-1)


@pytest.mark.usefixtures("compiled_code")
@pytest.mark.parametrize("name", BODIES | STRANGE_BODIES)
def test_the_same_answers(name):
    """To 1e-10. A link of a millionth, or twelve that lie upon each other, make a balance so badly conditioned at the usual
    regularisation that its residual leaves the sixth digit open; there at a wider one."""
    body = (BODIES | STRANGE_BODIES)[name]
    some = slice(None, None, 1 if body.joints < 5 else 3)
    cases, alpha, alphadot = (x[some] for x in hard(body.joints))
    for medium in MEDIA.values():
        for regularisation in (1e-6, 1e-3)[: 1 + (name in ILL_CONDITIONED)]:
            given = {"regularisation": regularisation}
            plain, fast = (body_velocity(medium, body, alpha, alphadot, backend=b, **given) for b in BOTH)
            assert (plain.status == fast.status).all()
            assert fast.residual.max() < 1e-9
            same = np.mean(plain.iterations == fast.iterations)  # steps, but for rounding where that is amplified
            assert same > (0.98 if name in ILL_CONDITIONED else 0.999)
            bad = apart(plain, fast, alphadot, body) > 1e-10
            bad &= name not in ILL_CONDITIONED or regularisation > 1e-6
            assert not bad.any(), set(cases[bad])


@pytest.mark.usefixtures("compiled_code")
@pytest.mark.parametrize("name", EFFECTS)
def test_the_same_marches(name, monkeypatch):
    """In as many evaluations: a tangent that is wrong costs more of them, and no digits."""
    taken, solve = [], Balance.solve

    def counted(self, *args, **kwargs):
        solved = solve(self, *args, **kwargs)
        taken.append(solved.iterations)
        return solved

    monkeypatch.setattr(Balance, "solve", counted)
    alpha, alphadot = GAIT.cycle(12, np.array([0.4, 1.0]))
    effects = EFFECTS[name][0](0.2), EndCaps(radius=0.06, tail=1.0)
    effects = effects[:1] if name == "end-caps" else effects
    given = {"effects": effects, "cycles": 2, "with_work": True}
    plain, fast = (time_steps(GLASS, BODY, alpha, alphadot, backend=b, **given) for b in BOTH)
    np.testing.assert_allclose(plain.xi, fast.xi, rtol=0, atol=1e-10)
    np.testing.assert_allclose(plain.pose, fast.pose, rtol=0, atol=1e-10)
    np.testing.assert_array_equal(plain.status, fast.status)
    plain, fast = np.split(np.array(taken), 2)
    assert np.mean(plain != fast) < 0.05


@dataclasses.dataclass(frozen=True)
class Both(TermLaw):
    """Dry and viscous drag."""

    dry = ((1.0, 1.0, 1.0), (0.24, 0.0, 1.7))
    viscous = (0.3, 0.9)


@pytest.mark.parametrize("how", BOTH)
def test_starts(how, compiled_code):
    """From the answer, from one nearby, from none, from nonsense and from rest: the same answers and statuses, and few steps
    from a good one. Asymmetric body, length not 1, rates from slow to fast, a viscous part in which speed counts."""
    rng = np.random.default_rng(11)
    alpha, alphadot = rng.uniform(-2.6, 2.6, (90, 2)), rng.normal(size=(90, 2)) * 10.0 ** rng.uniform(-3, 3, (90, 1))
    alpha[:6], alphadot[:6], alphadot[6] = 1.5, 0.3, 0.0  # links stick; a sample at rest
    for medium in (GLASS, Both()):
        given = {"backend": how, "tolerance": 1e-13}
        solve = lambda a, start=None: body_velocity(medium, BODY, a, alphadot, start=start, **given)
        cold, near = solve(alpha), solve(alpha + 1e-3).xi
        starts = {"near": near, "itself": cold.xi, "at rest": np.zeros(3), "absurd": 100.0 * near[::-1]}
        starts["of some"] = np.where(np.arange(90)[:, None] % 2, near, np.nan)
        found = {name: solve(alpha, start) for name, start in starts.items()}
        for name, one in found.items():
            assert (one.status == cold.status).all(), name
            assert apart(one, cold, alphadot, BODY).max() < 1e-10, name
        steps = {name: one.iterations[7:] for name, one in found.items()}
        cold_steps = cold.iterations[7:]
        assert (steps["itself"] <= 2).all()  # rounding may take one more
        assert steps["near"].mean() < 0.7 * cold_steps.mean()
        np.testing.assert_array_equal(steps["of some"][0::2], steps["near"][0::2])
        np.testing.assert_array_equal(steps["of some"][1::2], cold_steps[1::2])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e12, 1e31, 1e154, 1e155, 1e200, 1e300])
@pytest.mark.parametrize("rate", [1e-90, 1.0, 1e90])
def test_starts_whose_squares_overflow(size, rate, solved_by):
    """So that drag reads as none: the answer is that of no start. In a dry medium, and in one in which speed counts."""
    rng = np.random.default_rng(12)
    alpha, alphadot = rng.uniform(-2, 2, (20, 2)), rng.normal(size=(20, 2)) * rate
    start = size * np.eye(4)[np.arange(20) % 4, :3]  # along, across, turning, at rest
    for medium in (GLASS, MEDIA["viscous-2"]):
        cold, found = (body_velocity(medium, BODY, alpha, alphadot, start=s, backend=solved_by) for s in (None, start))
        assert (found.status == cold.status).all()
        assert apart(found, cold, alphadot, BODY).max() < 1e-10


@pytest.mark.parametrize("size", [1e40, 1e155, 1e300, np.nan])
def test_no_overflow_is_a_solution(size, solved_by):
    """Whatever brought a descent there: a residual that is 0 because squares overflow, or nan, is none."""
    alpha, alphadot = GAIT.cycle(8)
    problem = Balance.of(Model.of(GLASS), BODY, 1e-6, 1e-10)
    problem.backend = solved_by
    motion = BODY.motion(alpha.T, alphadot.T)
    solved = problem.solve(lambda index: motion.take(index), np.ones(8))
    assert (solved.residual < 1e-10).all()
    with np.errstate(all="ignore"):
        problem._descend(np.arange(8), WARM, np.full((3, 8), size), solved, 1)
    assert (solved.residual == np.inf).all()


@pytest.mark.usefixtures("compiled_code")
def test_a_moment_that_is_no_number_is_no_balance(monkeypatch):
    """Where the force is 0, as that of overflowing speeds is."""
    alpha, alphadot = GAIT.cycle(8)
    problem = Balance.of(Model.of(GLASS), BODY, 1e-6, 1e-10)
    problem.backend, motion = "numba", BODY.motion(alpha.T, alphadot.T)
    solved = problem.solve(lambda index: motion, np.ones(8))
    monkeypatch.setattr("rft.newton.FASTEST", np.inf)
    problem._descend(np.arange(8), WARM, np.full((3, 8), 1e155), solved, 1)
    assert (solved.residual > 1.0).all()


@pytest.mark.parametrize("wrong", [np.zeros(2), np.zeros((4, 3)), [0.0, np.inf, 0.0], "here", np.zeros((2, 3, 3))])
def test_starts_that_are_none(wrong):
    with pytest.raises(ValueError, match="start must be"):
        body_velocity(GLASS, BODY, np.zeros((3, 2)), np.ones((3, 2)), start=wrong)


@pytest.mark.usefixtures("compiled_code")
def test_parameters_of_each_sample_and_threads(monkeypatch):
    """Effects with a parameter for each sample, in a batch that is cut between threads."""
    monkeypatch.setattr("rft.newton.COMPILED_WORTH", 64)
    rng = np.random.default_rng(5)
    alpha, alphadot = rng.uniform(-2, 2, (300, 2)), rng.normal(size=(300, 2))
    some = rng.uniform(0.05, 1.0, (3, 300))
    effects = (
        SkinFriction().having(forward=some[0], backward=some[1]),
        TowedSled(1.0, 0.3).having(pull=some[2]),
        GrainInertia(frequency=1.2, length=0.4, depth=0.07, strength=1.0).having(strength=some[0]),
    )
    plain, fast = (body_velocity(GLASS, BODY, alpha, alphadot, effects=effects, backend=b, threads=3) for b in BOTH)
    assert apart(plain, fast, alphadot, BODY).max() < 1e-10
    np.testing.assert_array_equal(plain.status, fast.status)
    monkeypatch.setattr("rft.newton.COMPILED_WORTH", 10_000)
    whole = body_velocity(GLASS, BODY, alpha, alphadot, effects=effects, backend="numba")
    np.testing.assert_array_equal(whole.xi, fast.xi)  # to the last digit, whatever shares a lane or a thread
    alone = body_velocity(
        GLASS, BODY, alpha[7], alphadot[7], effects=[e.take(slice(7, 8)) for e in effects], backend="numba"
    )
    np.testing.assert_allclose(alone.xi, fast.xi[7], rtol=0, atol=1e-15)


@pytest.mark.usefixtures("compiled_code")
def test_compiled_once_for_all():
    """One signature: whatever the model, no call waits for another compilation."""
    from rft.lanes import attempt

    alpha, alphadot = GAIT.cycle(8)
    every = [make(0.1) for name, (make, _) in EFFECTS.items() if "," not in name]
    for medium, effects in (
        (GLASS, ()),
        (GLASS, every),
        *((GLASS, [e]) for e in every),
        (MEDIA["viscous-2"], every[-1:]),
    ):
        time_steps(medium, BODY, alpha, alphadot, effects=effects, cycles=1, backend="numba")
    body_velocity(GLASS, BODY, np.asfortranarray(alpha), alphadot[:, ::-1], backend="numba")
    assert len(attempt.signatures) == 1


class Sheared:
    """A law of one's own, without closed form."""

    def traction(self, v_t, v_n, eps=0.0):
        R = np.sqrt(v_t**2 + v_n**2 + eps**2)
        return v_t / R, 2 * v_n / R


def test_what_stays_with_numpy_and_why():
    scene = scenes.load("three-link-glass")
    swimmer = scene.system
    line = lambda s: next(x for x in s.told() if x.startswith("back end: ")).removeprefix("back end: ")
    assert line(swimmer).startswith("compiled code after 0.5 s of NumPy")
    assert line(swimmer) in explain(scene)
    assert line(scene.with_numerics(backend="numba").system).startswith("compiled code;")
    assert line(scene.with_numerics(backend="numpy").system) == "NumPy, as asked for"
    by_rule = line(scene.with_numerics(loads="midpoint:20").system)
    assert by_rule == "NumPy: compiled code does not know the law granular by quadrature"
    assert "law Sheared by quadrature" in line(dataclasses.replace(swimmer, medium=Sheared()))
    for make, _ in EFFECTS.values():  # all that ship are numbers
        assert line(dataclasses.replace(swimmer, effects=(make(0.1),))).startswith("compiled code")
    slower = dataclasses.replace(swimmer, effects=(Slower(),))
    assert line(slower) == "NumPy: compiled code does not know Slower"
    assert not backend.takes("numba", slower.effects[0].apply(Model.of(GLASS)))


@dataclasses.dataclass(frozen=True)
class Slower(SkinFriction):
    """An effect of one's own, of which compiled code has no numbers."""

    kind = "slower"
    numbers = None

    def __call__(self, v_t, v_n, spin):
        return 0.5 + 0.0 * v_t, None


def test_no_numba(monkeypatch):
    for module in (backend, solver):
        monkeypatch.setattr(module, "installed", lambda: False)
    monkeypatch.setattr(backend.AUTO, "is_ready", True)
    assert not backend.takes("auto", Model.of(GLASS))
    assert "numba is not installed (pip install 'geomech[fast]')" in explain(scenes.load("three-link-glass"))
    with pytest.raises(ValueError, match=r"pip install 'geomech\[fast\]'"):
        body_velocity(GLASS, BODY, (0.1, 0.2), (1.0, 0.0), backend="numba")
    with pytest.raises(ValueError, match=r"pip install 'geomech\[fast\]'"):
        scenes.load("three-link-glass").with_numerics(backend="numba")


def test_backends_that_are_none(tmp_path):
    for wrong in ("cuda", 3, None):
        with pytest.raises(ValueError, match="backend must be one of auto, numpy, numba, got"):
            body_velocity(GLASS, BODY, (0.1, 0.2), (1.0, 0.0), backend=wrong)
    (tmp_path / "s.toml").write_text(scenes.load("three-link-glass").text + '[numerics]\nbackend = "Numba"\n')
    code, out, err = geomech("explain", tmp_path / "s.toml")
    assert (code, out) == (2, "")
    assert "backend must be one of auto, numpy, numba, got 'Numba'" in err
    assert err.count("\n") == 1


@pytest.fixture
def auto(monkeypatch):
    """What "auto" knows at the start of a process, and what it does: made, started."""
    fresh, seen = backend.Auto(), types.SimpleNamespace(made=False, started=0, going=True)
    clock = types.SimpleNamespace(process_time=(k * 1e-3 for k in itertools.count()).__next__)
    monkeypatch.setattr(backend, "time", clock)  # the machine's stands still for some ms under a limit of CPU time
    maker = types.SimpleNamespace(poll=lambda: None if seen.going else 0)

    def started():
        seen.started += 1
        return maker

    monkeypatch.setattr(backend, "AUTO", fresh)
    monkeypatch.setattr(backend, "installed", lambda: True)
    monkeypatch.setattr(backend, "_started", started)
    monkeypatch.setattr(compiled, "made", lambda: seen.made)
    return fresh, seen


def test_auto_begins_with_numpy_and_loads_when_that_pays(auto):
    fresh, seen = auto
    seen.made, model = True, Model.of(GLASS)
    assert not backend.takes("auto", model)
    with backend.counted("auto"):
        pass
    assert 0 < fresh.worked < backend.TO_LOAD
    fresh.worked = backend.TO_LOAD
    assert backend.takes("auto", model)
    assert not backend.takes("numpy", model)
    assert seen.started == 0


def test_auto_loads_at_once_for_a_batch_that_takes_long(auto, monkeypatch):
    """Half a second of NumPy: by samples times elements, as the solver counts them."""
    _, seen = auto
    model, many = Model.of(GLASS), round(1.01 * backend.TO_LOAD / backend.AHEAD)
    assert not backend.takes("auto", model, many)
    seen.made = True
    assert not backend.takes("auto", model, many // 2)
    assert backend.takes("auto", model, many)
    asked = []
    monkeypatch.setattr(backend, "takes", lambda how, model, count: asked.append(count) or False)
    body_velocity(GLASS, BODY, np.zeros((7, 2)), np.ones((7, 2)), loads="gauss:5")
    body_velocity(GLASS, BODY, np.zeros((7, 2)), np.ones((7, 2)))
    assert asked == [7 * 3 * 5, 7 * 3]


def test_auto_waits_for_no_compilation(auto):
    """Another process makes the code; until it has, NumPy goes on."""
    fresh, seen = auto
    model, fresh.worked = Model.of(GLASS), 1.0
    assert not backend.takes("auto", model)
    assert seen.started == 0  # not worth it yet
    fresh.worked = 10.0
    assert [backend.takes("auto", model) for _ in range(3)] == [False] * 3
    assert seen.started == 1
    seen.made, seen.going = True, False
    assert backend.takes("auto", model)


def test_what_is_settled_on_numpy_has_compiled_code_made_for_the_next_time(auto, monkeypatch):
    """Once, if it takes long, and by the command itself: its workers are many."""
    fresh, seen = auto
    monkeypatch.setattr(backend, "LONG", -1.0)
    with backend.settled("numba"), backend.counted("auto"):
        pass
    with backend.settled("numpy"), one_thread(), backend.counted("auto"):
        pass
    assert seen.started == 0
    monkeypatch.setattr(backend, "LONG", 0.0)
    with backend.settled("numpy"):
        for _ in range(2):
            with backend.counted("auto"):
                sum(range(10_000))
    assert seen.started == 1 and fresh.worked == 0.0


def test_a_maker_that_fails_is_not_started_again(auto):
    fresh, seen = auto
    fresh.worked, seen.going = 10.0, False
    assert [backend.takes("auto", Model.of(GLASS)) for _ in range(3)] == [False] * 3
    assert seen.started == 1


def test_the_maker_ends_with_the_command(monkeypatch):
    """By its own id; nothing is left running."""
    left = []
    monkeypatch.setattr(backend.atexit, "register", lambda f, *args: left.append((f, args)))
    maker = backend._started()
    ((end, args),) = left
    assert maker.poll() is None
    end(*args)
    assert maker.poll() is not None


def test_a_folder_that_cannot_be_written(monkeypatch):
    monkeypatch.setattr(compiled, "_file", lambda: None)
    monkeypatch.setattr("rft.body_velocity", lambda *args, **kwargs: None)
    assert not compiled.made()
    assert not compiled.make()
    assert compiled.folder() is None


@pytest.mark.usefixtures("compiled_code")
def test_made_beforehand():
    done = subprocess.run([sys.executable, "-m", "rft"], capture_output=True, text=True, env=os.environ)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("compiled code is kept in ")


def doubled(x):
    return 2.0 * x


@pytest.fixture
def small(tmp_path, monkeypatch):
    """(a function that compiles `doubled`, or loads it, and tells whether it was loaded, where it is kept)."""
    numba = pytest.importorskip("numba")
    from rft.lane_cache import kept

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    def loaded():
        function = kept(numba.njit(doubled), "doubled")
        assert function(3.5) == 7.0
        return bool(function.stats.cache_hits)

    return loaded, kept(numba.njit(doubled), "doubled")._cache.file


def test_compiled_code_is_kept_in_one_file(small):
    loaded, file = small
    assert file.read() is None
    assert [loaded() for _ in range(3)] == [False, True, True]
    assert [p.name for p in file.path.parent.iterdir()] == [file.path.name]
    assert all(x in file.path.name for x in ("doubled.", sys.implementation.cache_tag, "numba0."))


def flipped(at):
    return lambda raw: raw[: int(at * len(raw))] + bytes([raw[int(at * len(raw))] ^ 8]) + raw[int(at * len(raw)) + 1 :]


def unloadable(raw):
    """Whole, and no pickle."""
    body = b"nothing that can be loaded"
    return raw[:17] + hashlib.sha256(body).hexdigest().encode() + b"\n" + body


DAMAGES = {
    "empty": lambda raw: b"",
    "in its first line": lambda raw: raw[:30],
    "cut short": lambda raw: raw[: len(raw) // 2],
    "longer": lambda raw: raw + b"\0",
    "another file": lambda raw: b"#!/bin/sh\n" * 30,
    "zeros": lambda raw: bytes(len(raw)),
    **{f"a bit at {at:g}": flipped(at) for at in (0.01, 0.3, 0.6, 0.999)},
    "unloadable": unloadable,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_code_is_set_aside_and_made_anew(damage, small):
    loaded, file = small
    assert not loaded()
    bad = DAMAGES[damage](file.path.read_bytes())
    file.path.write_bytes(bad)
    with pytest.warns(compiled.Note) as notes:
        assert not loaded()
    (note,) = (str(x.message) for x in notes)
    why = "it cannot be loaded (UnpicklingError)" if damage == "unloadable" else "it is damaged"
    assert note.startswith(f"the compiled code in {file.path} is not taken, {why}: set aside as ")
    assert "python -m rft" in note and "\n" not in note
    assert file.path.with_name(file.path.name + ".damaged").read_bytes() == bad
    assert loaded()


def test_nothing_of_damaged_code_reaches_numba(small, monkeypatch):
    """Which believes it: any flipped bit might run."""
    loaded, file = small
    loaded()
    raw, good = file.path.read_bytes(), file.read()
    monkeypatch.setattr(file, "set_aside", lambda why: None)
    rng = np.random.default_rng(3)
    for at in [*range(82), *rng.integers(82, len(raw), 100)]:
        file.path.write_bytes(raw[:at] + bytes([raw[at] ^ 1 << rng.integers(8)]) + raw[at + 1 :])
        assert file.read() is None
    file.path.write_bytes(raw)
    assert file.read() == good


def test_code_of_another_source_or_signature_is_not_taken(small, monkeypatch):
    """Nor is it damaged."""
    loaded, file = small
    loaded()
    raw = file.path.read_bytes()
    assert raw.startswith(compiled.STAMP.encode())
    assert file.load("another signature") is None
    file.path.write_bytes(b"0" * 16 + raw[16:])
    assert file.read() is None
    assert [loaded(), loaded()] == [False, True]
    assert file.path.read_bytes().startswith(compiled.STAMP.encode())


def test_code_that_cannot_be_kept_is_used_all_the_same(small, monkeypatch):
    loaded, file = small

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr("rft.lane_cache.os.replace", full)
        with pytest.warns(compiled.Note, match="not kept in .*: No space left on device; make room"):
            assert not loaded()
        assert list(file.path.parent.iterdir()) == []
        file.path.write_bytes(b"")  # nor can it be set aside
        with pytest.warns(compiled.Note) as notes:
            assert not loaded()
    assert sum("cannot be set aside (No space left on device): remove it" in str(x.message) for x in notes) == 1


def test_a_command_notes_damaged_code_and_goes_on(small, monkeypatch, tmp_path, geomech):
    """By NumPy, in one line, where "auto" would have loaded it."""
    _, file = small
    file.path.write_bytes(b"")
    auto = backend.Auto()
    auto.worked = backend.TO_LOAD
    monkeypatch.setattr(backend, "AUTO", auto)
    monkeypatch.setattr(compiled, "_file", lambda: file)
    code, out, err = geomech("velocity", "three-link-glass", "--alpha", "0.5,0.3", "--alphadot", "1,0")
    assert code == 0 and out.startswith("xi = (")
    assert err.startswith(f"note: the compiled code in {file.path} is not taken, it is damaged: ")
    assert err.count("\n") == 1


@pytest.mark.soak
@pytest.mark.parametrize("damage", ["empty", "cut short", "a bit at 0.6", "unloadable", "full disk"])
def test_a_command_outlives_the_cache(damage, tmp_path, compiled_code):
    """Of the true code, in a process of its own; 20 s each. compiled_code: numba is there."""
    (tmp_path / "s.toml").write_text(scenes.load("three-link-glass").text + '[numerics]\nbackend = "numba"\n')
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONWARNINGS": "error"}
    args = ["-m", "geomech", "displacement", "s.toml", "--amplitudes", "1", "--methods", "direct", "--json"]

    def run(limit=resource.RLIM_INFINITY):
        small_files = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        done = subprocess.run(
            [sys.executable, *args], capture_output=True, text=True, env=env, cwd=tmp_path, preexec_fn=small_files
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)["direct"], [x for x in done.stderr.splitlines() if " under way for " not in x]

    full = damage == "full disk"
    first, notes = run(*[50_000] * full)
    assert len(notes) == full and all("is not kept in " in x for x in notes)
    if damage in DAMAGES:
        (file,) = (tmp_path / "cache").rglob("*.code")
        file.write_bytes(DAMAGES[damage](file.read_bytes()))
        again, (note,) = run()
        assert again == first and "is not taken" in note
    assert run() == (first, [])


def test_one_matrix_does_what_a_motion_does():
    """Carrying, the wrench and its tangent, of a body whose elements have points besides, and of some of its samples."""
    rng = np.random.default_rng(4)
    body = Chain((0.7, 1.4, 0.9), frame="link-1")
    links = body.motion(rng.normal(size=(2, 6)), rng.normal(size=(2, 6)))
    motion = Kinematics.stacked([links, links.points([0, 2], np.array([[-0.2], [0.3]]), np.full((2, 1), 0.4))])
    xi, load = rng.normal(size=(3, 6)), rng.normal(size=(3, 4, 5, 6))
    some = Jacobian.join([Jacobian.of(motion.take(np.arange(2))), Jacobian.of(motion).take(np.arange(2, 6))])
    np.testing.assert_allclose(some.carried(xi), motion.carried(xi), rtol=0, atol=1e-14)
    np.testing.assert_allclose(some.wrench(load[:, 2]), motion.wrench(load[:, 2]), rtol=0, atol=1e-13)
    v = rng.normal(size=(3, 5, 6))
    net, slope = some.assembled(load, v)
    np.testing.assert_allclose(net, motion.assembled(load), rtol=0, atol=1e-13)
    np.testing.assert_allclose(slope, motion.wrench(np.einsum("ijnb,jnb->inb", load[:, 1:], v)), rtol=0, atol=1e-13)
    np.testing.assert_array_equal(some.assembled(load)[0], net)
    np.testing.assert_array_equal(some.v, motion.v)
