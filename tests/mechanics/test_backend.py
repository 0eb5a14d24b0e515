"""Compiled descents against NumPy's: the same marches under every effect (the same answers for every medium and body:
tests/mechanics/test_hard_cases.py); and which of the two is taken."""

import dataclasses
import errno
import hashlib
import itertools
import math
import os
import pathlib
import re
import resource
import runpy
import subprocess
import sys
import types
from unittest import mock

import numpy as np
import pytest
from commands import geomech
from registry import EFFECTS, MEDIA
from tabled import tabled_json
from test_hard_cases import GLASS, apart

from geomech import scenes
from geomech.mathematics.gaits import Ellipse
from geomech.mathematics.systems import solver
from geomech.shell.describe.scene import description
from geomech.shell.describe.system import system_lines
from rft import (
    Backbone,
    Chain,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    SkinFriction,
    TowedSled,
    body_velocity,
    time_steps,
)
from rft.balance import backend
from rft.balance import solver as balance
from rft.balance.backend import Note
from rft.bodies import Elements
from rft.core.premise import Premise
from rft.core.refusal import Refusal
from rft.effects import Effect
from rft.effects.contact import assemble
from rft.formulas.newton import Limits
from rft.formulas.vectors import formula, sqrt
from rft.laws.base import TermLaw
from rft.laws.records import record

ROOT = pathlib.Path(__file__).parents[2]
BODY = Chain((1, 1.4, 0.8), frame="link-1", length=0.3)


def sized(effects, body=BODY):
    """Effects with their lengths in metres, as a body with a length takes them."""
    return tuple(effect.in_metres(body.length) for effect in effects)


GAIT = Ellipse(semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2))
BOTH = ("numpy", "numba")


@pytest.mark.usefixtures("compiled_code")
@pytest.mark.parametrize("name", EFFECTS)
def test_the_same_marches(name, monkeypatch):
    """In as many evaluations: a tangent that is wrong costs more of them, and no digits."""
    taken, solve = [], balance.solve

    def counted(*args, **kwargs):
        solved = solve(*args, **kwargs)
        taken.append(solved.iterations)
        return solved

    monkeypatch.setattr("rft.motion.stepping.solve", counted)
    alpha, alphadot = GAIT.cycle(8, np.array([0.4, 1.0]))
    effects = EFFECTS[name][0](0.2), EndCaps(radius=0.06, tail=1.0)
    effects = sized(effects[:1] if name == "end-caps" else effects)
    given = {
        "effects": effects,
        "cycles": 1 + (Premise.MEMORYLESS in effects[0].breaks),
        "with_work": True,
    }
    plain, fast = (
        time_steps(GLASS, BODY, alpha, alphadot, backend=b, **given) for b in BOTH
    )
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
    """From the answer, from one nearby, from none, from nonsense and from rest: the same answers and statuses, and few
    steps from a good one. Asymmetric body, length not 1, rates from slow to fast, a viscous part in which speed
    counts."""
    rng = np.random.default_rng(11)
    alpha, alphadot = (
        rng.uniform(-2.6, 2.6, (90, 2)),
        rng.normal(size=(90, 2)) * 10.0 ** rng.uniform(-3, 3, (90, 1)),
    )
    alpha[:6], alphadot[:6], alphadot[6] = (
        1.5,
        0.3,
        0.0,
    )  # links stick; a sample at rest
    for medium in (GLASS, Both()):
        given = {"backend": how, "tolerance": 1e-13}
        solve = lambda a, start=None: body_velocity(
            medium, BODY, a, alphadot, start=start, **given
        )
        cold, near = solve(alpha), solve(alpha + 1e-3).xi
        starts = {
            "near": near,
            "itself": cold.xi,
            "at rest": np.zeros(3),
            "absurd": 100.0 * near[::-1],
        }
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
@pytest.mark.parametrize("rate", [1e-90, 1.0, 1e90])
def test_starts_whose_squares_overflow(rate, solved_by):
    """So that drag reads as none: the answer is that of no start. In a dry medium, and in one in which speed counts."""
    rng = np.random.default_rng(12)
    alpha, alphadot = rng.uniform(-2, 2, (20, 2)), rng.normal(size=(20, 2)) * rate
    sizes = [1e12, 1e31, 1e154, 1e155, 1e200, 1e300]
    for medium, size in itertools.product((GLASS, MEDIA["viscous-2"]), sizes):
        start = (
            size * np.eye(4)[np.arange(20) % 4, :3]
        )  # along, across, turning, at rest
        cold, found = (
            body_velocity(medium, BODY, alpha, alphadot, start=s, backend=solved_by)
            for s in (None, start)
        )
        assert (found.status == cold.status).all()
        assert apart(found, cold, alphadot, BODY).max() < 1e-10


@pytest.mark.parametrize("size", [1e40, 1e155, 1e300, np.nan])
def test_no_overflow_is_a_solution(size, solved_by, monkeypatch):
    """Whatever brought a descent there: a residual that is 0 because squares overflow, or nan, is none."""
    alpha, alphadot = (x.T for x in GAIT.cycle(8))
    assembly = assemble(GLASS, BODY)
    problem = assembly.problem(alpha, alphadot, np.ones(8))
    given = np.ones(8), balance.Accuracy(1e-6, 1e-10), assembly, solved_by, 1
    assert (balance.solve(problem.take, *given).residual < 1e-10).all()
    for name in ("WALKS", "SLOW"):
        monkeypatch.setattr(balance, name, ())
    monkeypatch.setattr(balance, "QUICK", balance.WARM)
    monkeypatch.setattr(
        balance, "is_possible", lambda *xi: np.ones(8, bool)
    )  # of the guess
    with np.errstate(all="ignore"):
        solved = balance.solve(problem.take, *given, np.full((3, 8), size))
    assert not (solved.residual < 1e-10).any()


@pytest.mark.parametrize(
    "wrong",
    [np.zeros(2), np.zeros((4, 3)), [0.0, np.inf, 0.0], "here", np.zeros((2, 3, 3))],
)
def test_starts_that_are_none(wrong):
    with pytest.raises(ValueError, match="start must be"):
        body_velocity(GLASS, BODY, np.zeros((3, 2)), np.ones((3, 2)), start=wrong)


@pytest.mark.usefixtures("compiled_code")
def test_parameters_of_each_sample_and_threads(monkeypatch):
    """Effects with a parameter for each sample, in a batch that is cut between threads."""
    monkeypatch.setattr("rft.balance.solver.COMPILED_WORTH", 64)
    rng = np.random.default_rng(5)
    alpha, alphadot = rng.uniform(-2, 2, (300, 2)), rng.normal(size=(300, 2))
    some = rng.uniform(0.05, 1.0, (3, 300))
    effects = (
        SkinFriction().with_parameters(forward=some[0], backward=some[1]),
        TowedSled(1.0, 0.3).with_parameters(pull=some[2]),
        GrainInertia(
            frequency=1.2, length=0.4, depth=0.07, strength=1.0
        ).with_parameters(strength=some[0]),
    )
    effects = sized(effects)
    plain, fast = (
        body_velocity(
            GLASS, BODY, alpha, alphadot, effects=effects, backend=b, threads=3
        )
        for b in BOTH
    )
    assert apart(plain, fast, alphadot, BODY).max() < 1e-10
    np.testing.assert_array_equal(plain.status, fast.status)
    monkeypatch.setattr("rft.balance.solver.COMPILED_WORTH", 10_000)
    whole = body_velocity(
        GLASS, BODY, alpha, alphadot, effects=effects, backend="numba"
    )
    np.testing.assert_array_equal(
        whole.xi, fast.xi
    )  # to the last digit, whatever shares a lane or a thread
    alone = body_velocity(
        GLASS,
        BODY,
        alpha[7],
        alphadot[7],
        effects=[e.take(slice(7, 8)) for e in effects],
        backend="numba",
    )
    np.testing.assert_allclose(alone.xi, fast.xi[7], rtol=0, atol=1e-15)


@pytest.mark.usefixtures("compiled_code")
@pytest.mark.parametrize(
    "effects",
    [(), (EndCaps(radius=0.06, tail=1.0), SkinFriction(), TowedSled(1.0, 0.3))],
    ids=len,
)
@pytest.mark.parametrize("body", [BODY, Backbone(19)], ids=["chain", "backbone"])
def test_a_sample_alone_has_the_digits_that_it_has_among_others(body, effects):
    """Alone its elements share vectors, among others each has one for itself."""
    from rft.balance.compiled import solve

    rng = np.random.default_rng(8)
    alpha, alphadot = (
        rng.uniform(-0.4, 0.4, (body.joints, 40)),
        rng.normal(size=(body.joints, 40)),
    )
    problem = assemble(GLASS, body, sized(effects, body)).problem(alpha, alphadot)
    common = balance.QUICK, Limits(1e-6, 1e-10), None
    alone = [solve(problem.take(np.array([i])), *common) for i in range(40)]
    np.testing.assert_array_equal(np.concatenate(alone, 1), solve(problem, *common))


@pytest.mark.usefixtures("compiled_code")
@pytest.mark.parametrize(
    "effects", [(), (EndCaps(radius=0.06, tail=1.0), TowedSled(1.0, 0.3))], ids=len
)
def test_forces_at_given_velocities_are_those_by_numpy(effects):
    """And their slopes, of elements and of points, in more samples than share a vector."""
    from rft.balance import arrays, compiled

    rng = np.random.default_rng(9)
    problem = assemble(GLASS, BODY, sized(effects)).problem(
        *rng.uniform(-1, 1, (2, 2, 21))
    )
    count = len(problem.sides.station) + len(problem.points.station)
    v, xi, rounding = (
        rng.normal(size=(3, count, 21)),
        rng.normal(size=(3, 21)),
        np.full(21, 1e-3),
    )
    wanted, found = (
        np.reshape(by.nets(problem, v, rounding, xi), (5, 3, -1))
        for by in (arrays, compiled)
    )
    np.testing.assert_allclose(
        found, wanted, rtol=1e-11, atol=1e-12 * np.abs(wanted).max()
    )


@pytest.mark.usefixtures("compiled_code")
def test_compiled_once_for_each_form_of_law():
    """One signature: whatever the effects, no call waits for another compilation."""
    from rft.balance.compiled import kernel

    alpha, alphadot = GAIT.cycle(8)
    every = [make(0.1) for name, (make, _) in EFFECTS.items() if "," not in name]
    every = sized(every)
    for medium, effects in (
        (GLASS, ()),
        (GLASS, every),
        *((GLASS, [e]) for e in every),
        (MEDIA["viscous-2"], every[-1:]),
    ):
        time_steps(
            medium, BODY, alpha, alphadot, effects=effects, cycles=1, backend="numba"
        )
    body_velocity(
        GLASS, BODY, np.asfortranarray(alpha), alphadot[:, ::-1], backend="numba"
    )
    assert len(kernel(type(record(GLASS))).signatures) == 1


class Sheared:
    """A law of one's own, without closed form, whose traction is no formula."""

    def traction(self, v_t, v_n, rounding=0.0):
        R = np.sqrt(v_t**2 + v_n**2 + rounding**2)
        return v_t / R, 2 * v_n / R


def test_what_stays_with_numpy_and_why():
    scene = scenes.load("three-link-glass")
    swimmer = scene.system
    line = lambda s: next(
        x for x in system_lines(s) if x.startswith("back end: ")
    ).removeprefix("back end: ")
    assert line(swimmer).startswith("compiled code")
    assert line(swimmer).endswith(
        "commands take NumPy where there is little to compute"
    )
    assert line(swimmer) in description(scene)
    assert line(scene.with_numerics(backend="numba").system).startswith("compiled code")
    assert line(scene.with_numerics(backend="numpy").system) == "NumPy, as asked for"
    assert line(scene.with_numerics(loads="midpoint:20").system).startswith(
        "compiled code"
    )
    by_numpy = line(dataclasses.replace(swimmer, medium=Sheared()))
    assert (
        by_numpy
        == "NumPy: compiled code does not know the law Sheared, whose traction is no formula"
    )
    assert not backend.compiles("numba", record(Sheared()))
    for make, _ in EFFECTS.values():
        assert line(dataclasses.replace(swimmer, effects=(make(0.1),))).startswith(
            "compiled code"
        )


def test_no_numba(monkeypatch):
    for module in (backend, solver):
        monkeypatch.setattr(module, "installed", lambda: False)
    with backend.preferring(""):
        assert not backend.compiles("auto", record(GLASS))
        assert backend.fastest() == "numpy"
    assert "numba is not installed (pip install 'geomech[fast]')" in description(
        scenes.load("three-link-glass")
    )
    with pytest.raises(ValueError, match=r"pip install 'geomech\[fast\]'"):
        body_velocity(GLASS, BODY, (0.1, 0.2), (1.0, 0.0), backend="numba")
    with pytest.raises(ValueError, match=r"pip install 'geomech\[fast\]'"):
        scenes.load("three-link-glass").with_numerics(backend="numba")


@pytest.mark.usefixtures("compiled_code")
def test_auto_is_compiled_code_unless_something_else_is_preferred():
    law = record(GLASS)
    with backend.preferring("numba"):
        assert backend.compiles("auto", law)
        assert not backend.compiles("numpy", law)
        with backend.preferring("numpy"):
            assert not backend.compiles("auto", law)
            assert backend.compiles("numba", law)
            with backend.preferring(""):
                assert backend.preferred() == "numpy"
    assert backend.fastest() == "numba"


def test_backends_that_are_none(tmp_path):
    for wrong in ("cuda", 3, None):
        with pytest.raises(
            ValueError, match="backend must be one of auto, numpy, numba, got"
        ):
            body_velocity(GLASS, BODY, (0.1, 0.2), (1.0, 0.0), backend=wrong)
    (tmp_path / "s.toml").write_text(
        scenes.load("three-link-glass").text + '[numerics]\nbackend = "Numba"\n'
    )
    code, out, err = geomech("explain", tmp_path / "s.toml")
    assert (code, out) == (2, "")
    assert "backend must be one of auto, numpy, numba, got 'Numba'" in err
    assert err.count("\n") == 1


@dataclasses.dataclass(frozen=True)
class Quartic:
    """f_t = v_t / |v|, f_n = v_n / |v| (1 + extra (v_n / |v|)^4): a law of one's own."""

    extra: float = 3.0
    mirror = True

    @formula
    def traction(self, v_t, v_n, rounding=0.0):
        speed = sqrt(v_t * v_t + v_n * v_n + rounding * rounding)
        s2 = v_n / speed * (v_n / speed)
        return v_t / speed, v_n / speed * (1.0 + self.extra * s2 * s2)


@dataclasses.dataclass(frozen=True)
class Softening(Effect):
    """Grains that an element slides through lose drag, to half after a travel in body lengths: an effect of one's own
    with a past."""

    travel: float

    kind = "softening"
    breaks = DisturbedGround.breaks

    def begin(self, problem, site):
        return np.zeros_like(problem.sides.elements.c)

    def apply(self, problem, site, past):
        share = self.travel / (self.travel + past)
        return problem._replace(sides=problem.sides.with_factors(share, share, share))

    def after(self, problem, site, past, v):
        return 0.5 * past + site.dt * np.hypot(v[0], v[1])


class Turtle:
    """A body of one's own: a trunk of 0.6 with two flippers of 0.2 at its head, whose angles to the trunk are the
    joints."""

    joints, length = 2, 1.0

    def motion(self, alpha, alphadot):
        along = np.exp(1j * np.stack([0 * alpha[0], 1.2 + alpha[0], -1.2 - alpha[1]]))
        turn = np.stack([0 * alphadot[0], alphadot[0], -alphadot[1]])
        half, shoulder = (
            np.array([[0.3], [0.1], [0.1]]),
            np.array([[0.0], [0.3], [0.3]]),
        )
        arm = half * along * (shoulder > 0)
        return Elements.from_complex(along, shoulder + arm, 1j * turn * arm, turn, half)


@pytest.mark.usefixtures("compiled_code")
@pytest.mark.parametrize(
    "effects",
    [(), (Softening(0.1),), (Softening(0.1), DisturbedGround(0.05, 0.5))],
    ids=len,
)
def test_what_somebody_else_writes_runs_by_both(effects):
    """A law, an effect with a past and a body: balance, stepping, displacement and work, the same digits."""
    alpha, alphadot = GAIT.cycle(16, np.array([0.4, 0.9]))
    found = [
        time_steps(
            Quartic(),
            Turtle(),
            alpha,
            alphadot,
            effects=sized(effects, Turtle()),
            cycles=2,
            with_work=True,
            backend=b,
        )
        for b in BOTH
    ]
    for name in ("xi", "pose", "displacement", "residual"):
        np.testing.assert_allclose(
            *(getattr(x, name) for x in found), rtol=0, atol=1e-10, err_msg=name
        )
    np.testing.assert_allclose(*(x.work.power for x in found), rtol=1e-10)
    assert found[0].residual.max() < 1e-9
    if not effects:
        balanced = [
            body_velocity(Quartic(), Turtle(), alpha, alphadot, backend=b).checked()
            for b in BOTH
        ]
        np.testing.assert_allclose(*(x.xi for x in balanced), rtol=0, atol=1e-11)
        np.testing.assert_allclose(balanced[0].xi, found[0].xi, rtol=0, atol=1e-6)


def test_an_effect_of_ones_own_vanishes_at_its_limit():
    alpha, alphadot = GAIT.cycle(16)
    plain, soft = (
        time_steps(GLASS, Turtle(), alpha, alphadot, effects=e, cycles=1).xi
        for e in ((), (Softening(1e9),))
    )
    np.testing.assert_allclose(soft, plain, rtol=0, atol=1e-7)


@pytest.mark.usefixtures("compiled_code")
def test_parameters_of_a_law_are_no_part_of_its_code():
    alpha, alphadot = (0.4, -0.7), (1.0, 0.3)
    for extra in (0.0, 1.0, 7.5):
        one, other = (
            body_velocity(Quartic(extra), BODY, alpha, alphadot, backend=b).xi
            for b in BOTH
        )
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)
    isotropic = body_velocity(
        Quartic(0.0), BODY, alpha, alphadot, backend="numba", loads="gauss:24"
    ).xi
    np.testing.assert_allclose(
        isotropic,
        body_velocity(MEDIA["coulomb"], BODY, alpha, alphadot, loads="gauss:24").xi,
        atol=1e-10,
    )


LAW = """
from dataclasses import dataclass
from rft.formulas.vectors import formula, sqrt

FACTOR = {factor}

@formula
def factor(x):
    return FACTOR * x

@dataclass(frozen=True)
class Own:
    @formula
    def traction(self, v_t, v_n, rounding=0.0):
        R = sqrt(v_t * v_t + v_n * v_n + rounding * rounding)
        return v_t / R, factor(v_n / R)
"""


@pytest.mark.usefixtures("compiled_code")
def test_code_on_disk_is_that_of_the_formulas():
    """A changed constant, in a function that the law calls, is another file; going back finds the old one."""
    from rft.balance.compiled import kernel, net_kernel

    def paths(factor):
        own = types.ModuleType("own")
        with mock.patch.dict(sys.modules, own=own):
            exec(LAW.format(factor=factor), vars(own))
        return [
            make(type(record(own.Own())))._cache.path for make in (kernel, net_kernel)
        ]

    two, three = paths(2.0), paths(3.0)
    assert len({*two, *three}) == 4
    assert paths(2.0) == two


@pytest.mark.timeout(900)  # the oldest numba compiles for minutes
@pytest.mark.usefixtures("compiled_code")
def test_made_beforehand(capsys):
    """As the whole suite begins (conftest.py)."""
    from rft.balance.compiled import kernel

    runpy.run_module("rft", run_name="__main__")
    assert capsys.readouterr().out.startswith("compiled code is kept in ")
    kernel.cache_clear()
    body_velocity(GLASS, BODY, (0.4, -0.7), (1.0, 0.3), backend="numba")
    stats = kernel(type(record(GLASS))).stats
    assert (sum(stats.cache_hits.values()), sum(stats.cache_misses.values())) == (1, 0)


def test_importing_loads_no_compiler():
    code = "import rft, geomech, sys; print([m for m in ('numba', 'llvmlite') if m in sys.modules])"
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True
        ).stdout.strip()
        == "[]"
    )


def doubled(x):
    return 2.0 * x


@pytest.fixture
def small(tmp_path, monkeypatch):
    """(a function that compiles `doubled`, or loads it, and tells whether it was loaded, where it is kept)."""
    numba = pytest.importorskip("numba")
    from rft.balance.cache import Cache

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    def loaded():
        function = numba.njit(doubled)
        function._cache = Cache(doubled)
        assert function(3.5) == 7.0
        return bool(function.stats.cache_hits)

    return loaded, Cache(doubled)


def test_compiled_code_is_kept_in_one_file(small):
    loaded, file = small
    assert file.read() is None
    assert [loaded() for _ in range(3)] == [False, True, True]
    assert [p.name for p in file.path.parent.iterdir()] == [file.path.name]


@pytest.mark.usefixtures("compiled_code")
@pytest.mark.parametrize("reached", ["half", "formulas.half"])
def test_code_has_another_key_once_a_function_that_it_names_changes(reached):
    """By its own name, and as that of a module; what the module has besides does not count."""
    from rft.balance.cache import digest

    def key(share, unused=1.0):
        module = types.ModuleType("formulas")
        exec(
            f"def half(x):\n    return {share} * x\ndef other(x):\n    return {unused} * x",
            vars(module),
        )
        own = {"formulas": module} if "." in reached else {"half": module.half}
        exec(f"def law(x):\n    return {reached}(x) + 1", own)
        return digest(own["law"])

    assert key(0.5) == key(0.5, unused=2.0) != key(0.6)


def flipped(at):
    return lambda raw: (
        raw[: int(at * len(raw))]
        + bytes([raw[int(at * len(raw))] ^ 8])
        + raw[int(at * len(raw)) + 1 :]
    )


def unloadable(raw):
    """Whole, and no pickle."""
    body = b"nothing that can be loaded"
    return hashlib.sha256(body).digest() + body


DAMAGES = {
    "empty": lambda raw: b"",
    "in its checksum": lambda raw: raw[:30],
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
    with pytest.warns(Note) as notes:
        assert not loaded()
    (note,) = (str(x.message) for x in notes)
    why = (
        "it cannot be loaded (UnpicklingError)"
        if damage == "unloadable"
        else "it is damaged"
    )
    assert note.startswith(
        f"the compiled code in {file.path} is not taken, {why}: renamed "
    )
    assert "python -m rft" in note and "\n" not in note
    assert file.path.with_name(file.path.name + ".damaged").read_bytes() == bad
    assert loaded()


def test_nothing_of_damaged_code_reaches_numba(small, monkeypatch):
    """Which believes it: any flipped bit might run."""
    loaded, file = small
    loaded()
    raw, good = file.path.read_bytes(), file.read()
    monkeypatch.setattr(file, "rename", lambda why: None)
    rng = np.random.default_rng(3)
    for at in [*range(82), *rng.integers(82, len(raw), 100)]:
        file.path.write_bytes(
            raw[:at] + bytes([raw[at] ^ 1 << rng.integers(8)]) + raw[at + 1 :]
        )
        assert file.read() is None
    file.path.write_bytes(raw)
    assert file.read() == good
    file.flush()
    assert not file.path.exists()


def test_code_of_another_signature_is_not_taken(small):
    """Nor is it damaged."""
    loaded, file = small
    loaded()
    raw = file.path.read_bytes()
    assert (
        file.load_overload(
            "another signature", types.SimpleNamespace(refresh=lambda: None)
        )
        is None
    )
    assert file.path.read_bytes() == raw
    assert loaded()


def test_code_that_cannot_be_kept_is_used_all_the_same(small, monkeypatch):
    loaded, file = small

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr("rft.balance.cache.os.replace", full)
        with pytest.warns(
            Note, match="not kept in .*: No space left on device; make room"
        ):
            assert not loaded()
        assert list(file.path.parent.iterdir()) == []
        file.path.write_bytes(b"")  # nor can it be renamed
        with pytest.warns(Note) as notes:
            assert not loaded()
    assert (
        sum(
            "cannot be renamed (No space left on device): remove it" in str(x.message)
            for x in notes
        )
        == 1
    )


def test_a_folder_that_cannot_be_made_costs_only_time(small, tmp_path, monkeypatch):
    loaded, _ = small
    (tmp_path / "file").write_text("")
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path / "file"))
    with pytest.warns(Note, match="not kept in .*file"):
        assert [loaded() for _ in range(2)] == [False, False]


@pytest.mark.soak
@pytest.mark.parametrize(
    "damage", ["empty", "cut short", "a bit at 0.6", "unloadable", "full disk"]
)
def test_a_command_outlives_the_cache(damage, tmp_path, compiled_code):
    """Of the true code, in a process of its own; 20 s each. compiled_code: numba is there."""
    (tmp_path / "s.toml").write_text(
        scenes.load("three-link-glass").text + '[numerics]\nbackend = "numba"\n'
    )
    env = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONWARNINGS": "error",
    }
    args = [
        "-m",
        "geomech",
        "displacement",
        "s.toml",
        "--amplitudes",
        "1",
        "--tiers",
        "direct",
        "--json",
    ]

    def run(limit=resource.RLIM_INFINITY):
        small_files = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        done = subprocess.run(
            [sys.executable, *args],
            capture_output=True,
            text=True,
            env=env,
            cwd=tmp_path,
            preexec_fn=small_files,
        )
        assert done.returncode == 0, done.stderr
        return tabled_json(done.stdout)["direct"], [
            x
            for x in done.stderr.splitlines()
            if " under way for " not in x and "compiling" not in x
        ]

    full = damage == "full disk"
    first, notes = run(*[50_000] * full)
    assert len(notes) == full and all("is not kept in " in x for x in notes)
    if damage in DAMAGES:
        (file,) = (tmp_path / "cache").rglob("*.code")
        file.write_bytes(DAMAGES[damage](file.read_bytes()))
        again, (note,) = run()
        assert again == first and "is not taken" in note
    assert run() == (first, [])


@formula
def square(x):
    return x * x


def test_what_the_page_says_that_formulas_take_is_what_compiles():
    """Every expression of the page's table, on eight elements at once and by NumPy."""
    numba = pytest.importorskip("numba")
    from rft.formulas import simd, vectors

    page = (ROOT / ".docs/how-it-works/balance.md").read_text()
    rows = [x.split("|", 2)[2] for x in page.splitlines() if x.startswith("| ")]
    taken = [re.findall(r"`([^`]+)`", row.replace("\\|", "|")) for row in rows]
    names = {"math", *(f.__name__ for f in vectors.FUNCTIONS)}
    texts = [t for row in taken for t in row if re.search(r"\bx\b", t)]
    assert names <= {*re.findall(r"\w+", " ".join(texts))} and len(texts) > 25
    table = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    scope = vars(vectors) | {"math": math, "square": square, "table": table}
    scope |= {"load": simd.load, "store": simd.store}
    texts = [t + "[1]" * t.startswith("combinations") for t in texts]  # of several
    lines = [f"    store(out, {k}, {text})" for k, text in enumerate(texts)]
    head = ["def run(rows, a, out):", "    x, y = load(rows, 0), load(rows, 1)"]
    exec("\n".join([*head, *lines]), scope)
    simd.register_formulas()
    rows, out = np.linspace(0.1, 1.7, 16).reshape(2, 8), np.zeros((len(texts), 8))
    rows[0, 3] = rows[1, 3]
    numba.njit(error_model="numpy")(scope["run"])(rows, 0.5, out)
    scope |= {"x": rows[0], "y": rows[1], "a": 0.5}
    expected = [np.broadcast_to(eval(text, scope), 8) for text in texts]
    np.testing.assert_allclose(out, expected, rtol=1e-14)


@dataclasses.dataclass(frozen=True)
class Slip:
    """A law whose formula has a power, which does not compile."""

    @formula
    def traction(self, v_t, v_n, rounding=0.0):
        speed = sqrt(v_t * v_t + v_n * v_n + rounding * rounding)
        return v_t / speed, (v_n / speed) ** 3


def test_a_slip_in_a_formula_is_told_by_function_and_line():
    numba = pytest.importorskip("numba")
    from rft.balance.cache import cached
    from rft.formulas import simd

    traction, load, store = Slip.traction, simd.load, simd.store

    def run(rows):
        _, across = traction(None, load(rows, 0), load(rows, 1))
        store(rows, 0, across)

    simd.register_formulas()
    kernel = cached(numba.njit(run), "a test")
    line = traction.__code__.co_firstlineno + 3
    with pytest.raises(Refusal, match=rf"Slip.traction \(.*, line {line}\)") as caught:
        kernel(np.ones((2, 8)))
    assert "\n" not in str(caught.value) and "** 3" in str(caught.value)
