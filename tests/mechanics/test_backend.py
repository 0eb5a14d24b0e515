"""Compiled descents against NumPy's: the same marches under every effect (the same
answers for every medium and body: tests/mechanics/test_hard_cases.py); and which of the
two is taken."""

import dataclasses
import errno
import hashlib
import math
import os
import pathlib
import re
import resource
import runpy
import shlex
import subprocess
import sys
import types
from unittest import mock

import numpy as np
import pytest
from registry import EFFECTS, MEDIA
from tabled import tabled_json
from test_hard_cases import GLASS, apart

from geomech import scenes
from geomech.mathematics.gaits import Ellipse
from rft import (
    Backbone,
    BodyVelocity,
    Chain,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    SkinFriction,
    TowedSled,
    body_velocity,
    time_steps,
)
from rft.balance import ahead, backend, path
from rft.balance import solver as balance
from rft.bodies import Elements
from rft.core.notes import Note
from rft.core.premise import Premise
from rft.core.refusal import Refusal
from rft.effects import Effect
from rft.effects.contact import assemble
from rft.formulas.momentum import MomentumRate
from rft.formulas.newton import Limits
from rft.formulas.vectors import formula, sqrt
from rft.laws.base import TermLaw
from rft.laws.records import Terms, record

ROOT = pathlib.Path(__file__).parents[2]
BODY = Chain((1, 1.4, 0.8), frame="link-1", length=0.3)
GAIT = Ellipse(semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2))
BOTH = ("numpy", "numba")
compiled = pytest.mark.usefixtures("compiled_code")


def sized(effects, body=BODY):
    """Effects with their lengths in metres, as a body with a length takes them."""
    return tuple(effect.in_metres(body.length) for effect in effects)


@compiled
@pytest.mark.parametrize("name", EFFECTS)
def test_the_same_marches(name):
    effects = EFFECTS[name][0](0.2), EndCaps(radius=0.06, tail=1.0)
    effects = sized(effects[:1] if name == "end-caps" else effects)
    cycles = 1 + (Premise.MEMORYLESS in effects[0].breaks)
    shapes = GAIT.cycle(8, np.array([0.4, 1.0]))
    plain, fast = (
        time_steps(GLASS, BODY, *shapes, effects=effects, cycles=cycles, backend=b)
        for b in BOTH
    )
    np.testing.assert_allclose(plain.pose, fast.pose, rtol=0, atol=1e-10)
    np.testing.assert_array_equal(plain.status, fast.status)


class Both(TermLaw):
    """Dry and viscous drag."""

    dry = ((1.0, 1.0, 1.0), (0.24, 0.0, 1.7))
    viscous = (0.3, 0.9)


@pytest.mark.parametrize("medium", [GLASS, Both()], ids=["dry", "both"])
def test_starts(solved_by, medium):
    """From rest, from nonsense, for some samples only and from nearby: the same answers
    and statuses, and fewer steps from a good one."""
    rng = np.random.default_rng(11)
    alpha = rng.uniform(-2.6, 2.6, (90, 2))
    alphadot = rng.normal(size=(90, 2)) * 10.0 ** rng.uniform(-3, 3, (90, 1))
    alpha[:6], alphadot[:6] = 1.5, 0.3  # links stick
    alphadot[6] = 0.0

    def solve(alpha, start=None):
        options = {"tolerance": 1e-13, "start": start, "backend": solved_by}
        return body_velocity(medium, BODY, alpha, alphadot, **options)

    cold = solve(alpha)
    near = solve(alpha + 1e-3).xi
    some = np.where(np.arange(90)[:, None] % 2, near, np.nan)
    for start in (np.zeros(3), 100.0 * near[::-1], some, near):
        found = solve(alpha, start)
        assert (found.status == cold.status).all()
        assert apart(found, cold, alphadot, BODY).max() < 1e-10
    assert found.iterations.mean() < 0.7 * cold.iterations.mean()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rate", [1e-90, 1e90])
@pytest.mark.parametrize("size", [1e31, 1e154, 1e155, 1e300])
@pytest.mark.parametrize("medium", ["glass-0.3mm-loose", "viscous-2"])
def test_starts_whose_squares_overflow(rate, size, medium, solved_by):
    """So that drag reads as none: the answer is that of no start."""
    rng = np.random.default_rng(12)
    problem = MEDIA[medium], BODY, rng.uniform(-2, 2, (20, 2))
    alphadot = rng.normal(size=(20, 2)) * rate
    start = size * np.eye(4)[np.arange(20) % 4, :3]  # along, across, turning, at rest
    cold, found = (
        body_velocity(*problem, alphadot, start=s, backend=solved_by)
        for s in (None, start)
    )
    assert (found.status == cold.status).all()
    assert apart(found, cold, alphadot, BODY).max() < 1e-10


@compiled
def test_each_sample_has_its_own_parameters_whatever_shares_its_thread():
    rng = np.random.default_rng(5)
    count = 3 * balance.COMPILED_WORTH
    alpha, alphadot = rng.uniform(-2, 2, (count, 2)), rng.normal(size=(count, 2))
    some = rng.uniform(0.05, 1.0, (3, count))
    inertia = GrainInertia(frequency=1.2, length=0.4, depth=0.07, strength=1.0)
    effects = sized(
        [
            SkinFriction().with_parameters(forward=some[0], backward=some[1]),
            TowedSled(1.0, 0.3).with_parameters(pull=some[2]),
            inertia.with_parameters(strength=some[0]),
        ]
    )
    problem = GLASS, BODY, alpha, alphadot
    one, three = (
        body_velocity(*problem, effects=effects, backend="numba", threads=n).xi
        for n in (1, 3)
    )
    np.testing.assert_array_equal(three, one)
    few = slice(0, None, 40)
    problem = GLASS, BODY, alpha[few], alphadot[few]
    own = [effect.take(few) for effect in effects]
    plain = body_velocity(*problem, effects=own, backend="numpy").xi
    np.testing.assert_allclose(one[few], plain, rtol=0, atol=1e-9)


@compiled
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
    alpha = rng.uniform(-0.4, 0.4, (body.joints, 40))
    assembly = assemble(GLASS, body, sized(effects, body))
    problem = assembly.problem(alpha, rng.normal(size=alpha.shape))
    common = balance.QUICK, Limits(1e-6, 1e-10), None
    alone = [solve(problem.take(np.array([i])), *common) for i in range(40)]
    np.testing.assert_array_equal(np.concatenate(alone, 1), solve(problem, *common))


@compiled
@pytest.mark.parametrize("medium", [GLASS, Both()], ids=["dry", "both"])
def test_one_prepared_chain_has_the_digits_of_body_velocity(medium):
    """And those that it has among others, at rest and on both sides of a block."""
    body = Chain((0.8, 1.3, 1.0, 0.7), 0.3, modes=((1.4, 0.3, -0.5), (-0.2, 0.9, 2.1)))
    velocity = BodyVelocity(medium, body, backend="numba")
    rng = np.random.default_rng(12)
    alpha, alphadot = rng.uniform(-1, 1, (2, 1100, 2))
    alphadot[3] = 0.0
    among = velocity(alpha, alphadot)
    asked = medium, body, alpha, alphadot
    for a, b in zip(among, body_velocity(*asked, backend="numba")):
        np.testing.assert_array_equal(a, b)
    for i in (0, 3, 1023, 1024, 1099):
        alone = velocity(alpha[i], alphadot[i])
        for a, b in zip(alone, among):
            np.testing.assert_array_equal(a, b[i])
    plain = body_velocity(*asked, backend="numpy")
    assert (plain.code == among.code).all()
    assert apart(among, plain, np.maximum(abs(alphadot), 0.01), body).max() < 1e-11


@compiled
@pytest.mark.parametrize("mass", [0.0, 0.3])
@pytest.mark.parametrize(
    ("medium", "effects"),
    [
        (GLASS, ()),
        (Both(), (SkinFriction(),)),
        (GLASS, (EndCaps(radius=0.06, tail=1.0), TowedSled(1.0, 0.3))),
    ],
    ids=["dry", "both", "points"],
)
def test_both_walk_along_the_same_curves(medium, effects, mass):
    from rft.balance import compiled as fast

    assembly = assemble(medium, BODY, sized(effects))
    alpha, alphadot = np.random.default_rng(9).uniform(-2.5, 2.5, (2, 2, 20))
    problem = assembly.problem(alpha, alphadot)
    if mass:
        past = np.full((3, 20), 0.01)
        rate = MomentumRate(np.ones((1, 1)), past, past, past, np.full((1, 1), mass))
        problem = problem._replace(momentum_rate=rate)
    asked = problem, Limits(1e-6, 1e-10), 0.2, 400
    wanted = np.empty((6, 20))
    for i, rows in path.follow(*asked):
        wanted[:, i] = rows
    ((i, found),) = fast.follow(*asked)
    assert np.isfinite(wanted[3]).all() and np.isfinite(found[3]).all()
    np.testing.assert_allclose(found[:3, i], wanted[:3], rtol=0, atol=1e-9)
    assert np.mean(found[4] == wanted[4]) > 0.9


class Sheared:
    """A law of one's own, without closed form, whose traction is no formula."""

    def traction(self, v_t, v_n, rounding=0.0):
        R = np.sqrt(v_t**2 + v_n**2 + rounding**2)
        return v_t / R, 2 * v_n / R


def test_without_numba_numpy_computes_and_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(backend, "installed", lambda: False)
    monkeypatch.setattr(ahead, "library", lambda: None)
    with backend.preferring(""):
        assert backend.fastest() == "numpy"
        body_velocity(GLASS, BODY, (0.1, 0.2), (1.0, 0.0))
    with pytest.raises(ValueError, match=r"pip install 'geomech\[fast\]'"):
        body_velocity(GLASS, BODY, (0.1, 0.2), (1.0, 0.0), backend="numba")


@compiled
@pytest.mark.parametrize(
    ("preferred", "asked", "compiles"),
    [
        ("numba", "auto", True),
        ("numba", "numpy", False),
        ("numpy", "auto", False),
        ("numpy", "numba", True),
    ],
)
def test_auto_is_compiled_code_unless_something_else_is_preferred(
    preferred, asked, compiles
):
    with backend.preferring(preferred):
        assert backend.compiles(asked, record(GLASS)) == compiles
        assert not backend.compiles("numba", record(Sheared()))


@dataclasses.dataclass(frozen=True)
class Quartic:
    """f_t = v_t / |v|, f_n = v_n / |v| (1 + extra (v_n / |v|)^4): a custom law."""

    extra: float = 3.0
    mirror = True

    @formula
    def traction(self, v_t, v_n, rounding=0.0):
        speed = sqrt(v_t * v_t + v_n * v_n + rounding * rounding)
        s2 = v_n / speed * (v_n / speed)
        return v_t / speed, v_n / speed * (1.0 + self.extra * s2 * s2)


@dataclasses.dataclass(frozen=True)
class Softening(Effect):
    """Grains that an element slides through lose drag, to half after a travel in body
    lengths: an effect of one's own with a past."""

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


@formula
def softened(past, dt, v_t, v_n, v_w):
    """`Softening.after`, of one element."""
    return (0.5 * past + dt * sqrt(v_t * v_t + v_n * v_n),)


class ByElement(Softening):
    """`Softening` with its `after` as a formula of one element."""

    kind = "softening by element"
    element_update = staticmethod(softened)

    def begin(self, problem, site):
        return super().begin(problem, site)[None]

    def apply(self, problem, site, past):
        return super().apply(problem, site, past[0])

    def element_arguments(self, problem, site, past):
        return past[0], np.full((1, 1), site.dt)

    after = Effect.after


class ByHand(ByElement):
    """An `after` of its own, which goes before the formula that it has from another."""

    def after(self, problem, site, past, v):
        return Softening.after(self, problem, site, past, 2.0 * np.array(v))


def states(effects, how):
    """Numbers of the states after each of the first steps, one after the other."""
    found = []

    def numbers(x):
        if isinstance(x, np.ndarray):
            return x.ravel()
        return np.concatenate([np.zeros(0), *map(numbers, x)])

    def advance(stepping, state, count, with_work):
        rows = []
        for _ in range(count):
            state, row = stepping.step(state, with_work)
            rows.append(row)
            found.append(numbers([*state.v, *state.effect_states]))
        return state, rows

    cycle = GAIT.cycle(8, np.array([0.4, 1.0]))
    options = {"effects": sized(effects), "cycles": 1, "backend": how}
    time_steps(GLASS, BODY, *cycle, advance=advance, **options)
    return np.stack(found)


OWN = {"by element": ByElement(0.1), "by hand": ByHand(0.1)}


@compiled
@pytest.mark.parametrize("name", [*EFFECTS, *OWN])
def test_the_same_states(name):
    """Velocities of elements and states of effects at every step, whether an effect's
    update is compiled or not."""
    effect = OWN[name] if name in OWN else EFFECTS[name][0](0.2)
    plain, fast = (states([effect], how) for how in BOTH)
    np.testing.assert_allclose(fast, plain, rtol=1e-11, atol=1e-11)
    if name == "by element":
        np.testing.assert_allclose(plain, states([Softening(0.1)], "numpy"))
    if name == "by hand":
        assert np.abs(fast - states([ByElement(0.1)], "numba")).max() > 1e-3


@compiled
@pytest.mark.parametrize("spoilt", [None, 0.0, np.nan])
def test_both_solve_four_equations_and_nothing_where_one_tells_nothing(spoilt):
    from rft.balance import walks

    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(4, 4, 8))
    matrix[0, :2, :4] = 0.0
    right = rng.normal(size=(4, 8))
    expected = np.linalg.solve(matrix.transpose(2, 0, 1), right.T[..., None])[..., 0].T
    if spoilt is not None:
        matrix[rng.integers(4, size=8), :, np.arange(8)] = spoilt
        expected[:] = np.nan
    found = np.ones((4, 8))
    for k in range(8):
        walks.solve4(matrix[..., k], right[:, k], np.empty((4, 5)), found[:, k])
    np.testing.assert_allclose(found, expected, rtol=1e-11)
    with np.errstate(all="ignore"):  # as in a descent
        by_numpy = path.solve4(matrix, right[:, None])[:, 0]
    np.testing.assert_allclose(by_numpy, expected, rtol=1e-11)


@compiled
def test_eight_exponential_functions():
    from numba import njit

    from rft.formulas import simd, vectors

    load, store, exp = simd.load, simd.store, vectors.exp

    @njit
    def compute(x, out):
        for k in range(len(x)):
            store(out, k, exp(load(x, k)))

    rng = np.random.default_rng(5)
    x = np.concatenate([
        [0.0, -1e-300, -707.9, 708.9, -np.inf, np.inf, np.nan, -1e4],
        -(10.0 ** rng.uniform(-20, 2.8, 800)),
        rng.uniform(-700, 700, 800),
    ]).reshape(-1, 8)  # fmt: skip
    found = np.empty_like(x)
    compute(x, found)
    np.testing.assert_allclose(found, np.exp(x), rtol=3e-16, atol=0)


class Turtle:
    """A body of one's own: a trunk of 0.6 with two flippers of 0.2 at its head, whose
    angles to the trunk are the joints."""

    joints, length = 2, 1.0

    def motion(self, alpha, alphadot):
        along = np.exp(1j * np.stack([0 * alpha[0], 1.2 + alpha[0], -1.2 - alpha[1]]))
        turn = np.stack([0 * alphadot[0], alphadot[0], -alphadot[1]])
        half = np.array([[0.3], [0.1], [0.1]])
        shoulder = np.array([[0.0], [0.3], [0.3]])
        arm = half * along * (shoulder > 0)
        return Elements.from_complex(along, shoulder + arm, 1j * turn * arm, turn, half)


@compiled
@pytest.mark.parametrize(
    "effects",
    [(), (Softening(0.1),), (Softening(0.1), DisturbedGround(0.05, 0.5))],
    ids=len,
)
def test_what_somebody_else_writes_runs_by_both(effects):
    problem = Quartic(), Turtle(), *GAIT.cycle(16, np.array([0.4, 0.9]))
    options = {"effects": sized(effects, Turtle()), "cycles": 2, "with_work": True}
    plain, fast = (time_steps(*problem, **options, backend=b) for b in BOTH)
    np.testing.assert_allclose(fast.xi, plain.xi, rtol=0, atol=1e-10)
    np.testing.assert_allclose(fast.work.power, plain.work.power, rtol=1e-10)
    assert plain.residual.max() < 1e-9


@compiled
@pytest.mark.parametrize("extra", [0.0, 1.0, 7.5])
def test_parameters_of_a_law_are_no_part_of_its_code(extra):
    problem = Quartic(extra), BODY, (0.4, -0.7), (1.0, 0.3)
    plain, fast = (body_velocity(*problem, backend=b).xi for b in BOTH)
    np.testing.assert_allclose(plain, fast, rtol=0, atol=1e-12)


def doubled(x):
    return 2.0 * x


@pytest.fixture
def small(tmp_path, monkeypatch):
    """(a function that compiles `doubled`, or loads it, and tells whether it was
    loaded, where it is kept)."""
    numba = pytest.importorskip("numba")
    from rft.balance.cache import Cache

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    def loaded():
        function = numba.njit(doubled)
        function._cache = Cache(doubled)
        assert function(3.5) == 7.0
        return bool(function.stats.cache_hits)

    return loaded, Cache(doubled)


@compiled
@pytest.mark.parametrize("reached", ["half", "formulas.half"])
def test_code_has_another_key_once_a_function_that_it_names_changes(reached):
    from rft.balance.cache import digest

    def key(share, unused=1.0):
        module = types.ModuleType("formulas")
        text = f"def half(x):\n    return {share} * x\ndef other(x):\n    return {unused} * x"
        exec(text, vars(module))
        own = {"formulas": module, "half": module.half}
        exec(f"def law(x):\n    return {reached}(x) + 1", own)
        return digest(own["law"])

    assert key(0.5) == key(0.5, unused=2.0) != key(0.6)


def flipped(raw, k, bit=3):
    return raw[:k] + bytes([raw[k] ^ 1 << bit]) + raw[k + 1 :]


DAMAGES = {
    "empty": lambda raw: b"",
    "in its checksum": lambda raw: raw[:30],
    "cut short": lambda raw: raw[: len(raw) // 2],
    "longer": lambda raw: raw + b"\0",
    "another file": lambda raw: b"#!/bin/sh\n" * 30,
    "zeros": lambda raw: bytes(len(raw)),
    "a bit at 0.01": lambda raw: flipped(raw, len(raw) // 100),
    "a bit at 0.3": lambda raw: flipped(raw, int(0.3 * len(raw))),
    "a bit at 0.6": lambda raw: flipped(raw, int(0.6 * len(raw))),
    "a bit at 0.999": lambda raw: flipped(raw, int(0.999 * len(raw))),
    "unloadable": lambda raw: hashlib.sha256(b"no pickle").digest() + b"no pickle",
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_code_is_set_aside_and_made_anew(damage, small):
    loaded, file = small
    loaded()
    bad = DAMAGES[damage](file.path.read_bytes())
    file.path.write_bytes(bad)
    with pytest.warns(Note, match="is not used because it .*: renamed to .*-m rft"):
        assert not loaded()
    assert loaded()


def test_code_that_cannot_be_kept_is_used_all_the_same(small):
    loaded, file = small
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with mock.patch("rft.balance.cache.os.replace", side_effect=full):
        with pytest.warns(
            Note, match="not stored in .*: No space left on device; free"
        ):
            assert not loaded()
        assert list(file.path.parent.iterdir()) == []


LINE = "displacement s.toml --amplitudes 1 --tiers direct --json"


@pytest.mark.soak
@compiled
@pytest.mark.parametrize(
    "damage", ["empty", "cut short", "a bit at 0.6", "unloadable", "full disk"]
)
def test_a_command_outlives_the_cache(damage, tmp_path):
    """Of the true code, in a process of its own; 20 s each."""
    scene = scenes.load("three-link-glass").text + '[numerics]\nbackend = "numba"\n'
    (tmp_path / "s.toml").write_text(scene)
    cache = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONWARNINGS": "error"}

    def run(limit=resource.RLIM_INFINITY):
        done = subprocess.run(
            [sys.executable, "-m", "geomech", *shlex.split(LINE)],
            capture_output=True,
            text=True,
            env=os.environ | cache,
            cwd=tmp_path,
            preexec_fn=lambda: resource.setrlimit(
                resource.RLIMIT_FSIZE, (limit, limit)
            ),
        )
        assert done.returncode == 0, done.stderr
        return tabled_json(done.stdout)["direct"], done.stderr

    if damage == "full disk":
        first, notes = run(50_000)
        assert " is not stored in " in notes
    else:
        first, _ = run()
        (file,) = (tmp_path / "cache").rglob("*.code")
        file.write_bytes(DAMAGES[damage](file.read_bytes()))
        again, notes = run()
        assert again == first
        assert "is not taken" in notes
    last, notes = run()
    assert last == first
    assert " is not " not in notes


@formula
def square(x):
    return x * x


def test_what_the_page_says_that_formulas_take_is_what_compiles():
    """Every expression of the page's table, on eight elements at once and by NumPy."""
    numba = pytest.importorskip("numba")
    from rft.formulas import simd, vectors

    page = (ROOT / ".docs/how-it-works/balance.md").read_text()
    cells = [x.split("|", 2)[2] for x in page.splitlines() if x.startswith("| ")]
    texts = re.findall(r"`([^`]+)`", " ".join(cells).replace("\\|", "|"))
    names = {"math", *(f.__name__ for f in vectors.FUNCTIONS)}
    assert names <= {*re.findall(r"\w+", " ".join(texts))}
    texts = [t for t in texts if re.search(r"\bx\b", t)]
    texts = [t + "[1]" * t.startswith("combinations") for t in texts]  # of several
    assert len(texts) > 25
    table = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    scope = vars(vectors) | {"math": math, "square": square, "table": table}
    scope |= {"load": simd.load, "store": simd.store}
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


@compiled
def test_kernels_built_ahead_serve_closed_laws_without_numba(monkeypatch):
    """Other laws are left to NumPy; kernels of numba stand for those of a wheel."""
    from rft.balance.compiled import Kernels, kernels_of

    exact = record(GLASS)
    built = Kernels(*kernels_of(type(exact)))
    monkeypatch.setattr(backend, "installed", lambda: False)
    monkeypatch.setattr(ahead, "library", lambda: built)
    kernels_of.cache_clear()
    assert backend.fastest() == backend.at_once() == "built"
    with backend.preferring("built"):
        assert backend.solves_compiled("auto", exact)
        assert not backend.solves_compiled("auto", record(GLASS, "gauss:8"))
        assert not backend.compiles("auto", exact)
        found = body_velocity(GLASS, BODY, (0.4, -0.7), (1.0, 0.3))
        assert kernels_of(type(exact)).solve is built.solve
    kernels_of.cache_clear()
    plain = body_velocity(GLASS, BODY, (0.4, -0.7), (1.0, 0.3), backend="numpy")
    np.testing.assert_allclose(found.xi, plain.xi, rtol=0, atol=1e-9)


def test_kernels_that_do_not_load_are_noted_and_not_used(monkeypatch, tmp_path):
    (tmp_path / "_kernels.py").write_text("raise ImportError('no version for libc')\n")
    monkeypatch.setattr("rft.balance.__path__", [str(tmp_path)])
    monkeypatch.setattr(ahead, "_can_run", lambda: True)
    ahead.library.cache_clear()
    with pytest.warns(Note, match="no version for libc"):
        assert ahead.library() is None
    assert not ahead.has(Terms)
    ahead.library.cache_clear()


@pytest.mark.timeout(900)  # the oldest numba compiles for minutes
@compiled
def test_code_is_compiled_beforehand(capsys):
    from rft.balance.compiled import kernels_of
    from rft.balance.kernels import chain_kernel, kernel

    runpy.run_module("rft", run_name="__main__")
    assert capsys.readouterr().out.startswith("compiled code is stored in ")
    for function in (kernel, chain_kernel, kernels_of):
        function.cache_clear()
    body_velocity(GLASS, BODY, (0.4, -0.7), (1.0, 0.3), backend="numba")
    asked = {"start": np.zeros(3), "backend": "numba"}
    body_velocity(GLASS, BODY, (0.4, -0.7), (1.0, 0.3), **asked)
    for function in (kernel, chain_kernel):
        assert sum(function(type(record(GLASS))).stats.cache_misses.values()) == 0


@dataclasses.dataclass(frozen=True)
class Slip:
    """A law whose formula has a power, which does not compile."""

    @formula
    def traction(self, v_t, v_n, rounding=0.0):
        speed = sqrt(v_t * v_t + v_n * v_n + rounding * rounding)
        return v_t / speed, (v_n / speed) ** 3


@compiled
def test_a_slip_in_a_formula_is_told_by_function_and_line():
    import numba

    from rft.balance.cache import cached
    from rft.formulas import simd

    traction, load, store = Slip.traction, simd.load, simd.store

    def run(rows):
        store(rows, 0, traction(None, load(rows, 0), load(rows, 1))[1])

    simd.register_formulas()
    line = traction.__code__.co_firstlineno + 3
    said = rf"Slip.traction \(.*, line {line}\).*\*\* 3"
    with pytest.raises(Refusal, match=said):
        cached(numba.njit(run), "a test")(np.ones((2, 8)))
