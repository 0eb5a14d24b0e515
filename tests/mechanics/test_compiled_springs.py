"""Joints that give way, by compiled code against NumPy: the same steps, one after the
other or resumed, also where compiled code leaves one unsolved."""

import math

import numpy as np
import pytest

from rft import Backbone, Chain, Granular, Viscous, time_steps
from rft.bodies import ConstantCurvature, Serpenoid
from rft.effects import Springs
from rft.motion import compiled_steps
from rft.motion.cycles import take_steps

SAND = Granular(1.8, 0.24)
FLUID = Viscous()
RIGID = math.inf
compiled = pytest.mark.usefixtures("compiled_code")


def wave(joints, size=1.0, lag=0.9, phases=32):
    """Return a wave of joint angles, and its rates, (phases, joints) each."""
    t = 2 * np.pi * np.arange(phases)[:, None] / phases - lag * np.arange(joints)
    return size * np.cos(t), -size * np.sin(t)


def batch(*sizes):
    """Return waves of two joints with several amplitudes."""
    alpha, alphadot = wave(2)
    size = np.array(sizes)[:, None, None]
    return size * alpha, size * alphadot


CIRCLE = np.pi / 2
CASES = {
    "passive tail": (
        SAND,
        Chain(),
        wave(2),
        Springs(stiffness=(RIGID, 0.1), passive=2),
    ),
    "fluid": (
        FLUID,
        Chain((1, 2, 1), frame="link-2"),
        wave(2),
        Springs(stiffness=(0.05, 0.1), frequency=0.5),
    ),
    "free joint": (SAND, Chain(), wave(2), Springs(stiffness=(RIGID, 0.0))),
    "twelve links": (SAND, Chain((1,) * 12), wave(11, 0.5), Springs(stiffness=0.3)),
    "modes": (
        SAND,
        Chain((1,) * 6, modes="serpenoid"),
        wave(2, 0.8, CIRCLE),
        Springs(stiffness=0.1),
    ),
    "serpenoid": (
        FLUID,
        Serpenoid(elements=24, waves=1.5),
        wave(2, 5.0, CIRCLE),
        Springs(bending=0.01, frequency=0.3),
    ),
    "backbone": (SAND, Backbone(elements=9), wave(8, 0.5), Springs(bending=0.02)),
    "arcs": (
        SAND,
        ConstantCurvature(elements=12, sections=3, frame="link-4"),
        wave(3, 0.6),
        Springs(bending=0.03),
    ),
    "dead bands": (
        SAND,
        Chain(),
        wave(2),
        Springs(
            stiffness=(RIGID, 0.4), passive=2, dead_band=((-0.2, 0.2), (0.0, RIGID))
        ),
    ),
    "damping and rest": (
        FLUID,
        Chain((1, 2, 1, 1)),
        wave(3),
        Springs(stiffness=(0.2, 0.1, RIGID), damping=0.05, rest=0.2, frequency=1.0),
    ),
    "amplitudes": (SAND, Chain(), batch(0.3, 0.8, 1.2), Springs(stiffness=0.15)),
    "one stiffness a sample": (
        SAND,
        Chain(),
        batch(0.8, 0.8),
        Springs(stiffness=0.1).with_parameters(stiffness=np.array([0.1, 0.4])),
    ),
}


def steps_of(name, backend, **options):
    medium, body, gait, springs = CASES[name]
    options = {"cycles": 2, "with_path": True} | options
    return time_steps(
        medium, body, *gait, effects=[springs], backend=backend, **options
    )


def assert_same(a, b):
    assert a.status.tolist() == b.status.tolist()
    assert a.residual.max() <= 1e-9
    assert b.residual.max() <= 1e-9
    for x, y in [(a.xi, b.xi), (a.path, b.path), *zip(a.springs, b.springs)]:
        np.testing.assert_allclose(x, y, rtol=0, atol=1e-9)
    np.testing.assert_allclose(a.drift, b.drift, rtol=0, atol=1e-9)


@compiled
@pytest.mark.parametrize("name", CASES)
def test_both_take_the_same_steps(name):
    assert_same(steps_of(name, "numpy"), steps_of(name, "numba"))


@compiled
def test_laws_by_a_rule():
    rule = {"loads": "midpoint:6"}
    found = steps_of("modes", "numba", **rule)
    assert_same(steps_of("modes", "numpy", **rule), found)


@compiled
def test_the_limit_cycle_and_work_are_the_same():
    options = {"cycles": None, "with_work": True}
    a = steps_of("passive tail", "numpy", **options)
    b = steps_of("passive tail", "numba", **options)
    assert a.cycles == b.cycles
    assert_same(a, b)
    for x, y in zip(a.work, b.work):
        np.testing.assert_allclose(x, y, rtol=0, atol=1e-8)


@compiled
def test_a_sample_alone_takes_the_steps_that_it_takes_among_others():
    together = steps_of("amplitudes", "numba")
    medium, body, (alpha, alphadot), springs = CASES["amplitudes"]
    for k in range(len(alpha)):
        gait = alpha[k], alphadot[k]
        alone = time_steps(
            medium, body, *gait, effects=[springs], backend="numba", cycles=2
        )
        np.testing.assert_array_equal(alone.xi, together.xi[k])


@compiled
def test_steps_are_resumed_from_any_state():
    def in_pieces(stepping, state, count, with_work):
        copies = []
        rows = []
        for k in range(count):
            if k % 5 == 0:  # as if the state had been stored and read
                state = state._replace(xi=state.xi.copy())
            state, row = stepping.step(state, with_work)
            copies.append(state)
            rows.append(row)
        return copies[-1], rows

    whole = steps_of("dead bands", "numba", advance=take_steps)
    pieces = steps_of("dead bands", "numba", advance=in_pieces)
    np.testing.assert_array_equal(whole.path, pieces.path)
    np.testing.assert_array_equal(whole.springs.alpha, pieces.springs.alpha)


@compiled
def test_numpy_takes_the_steps_that_compiled_code_leaves_unsolved(monkeypatch):
    kernel_of = compiled_steps.joint_kernel
    calls = []

    def failing(law):
        kernel = kernel_of(law)

        def at_most_three(*arguments):
            calls.append(arguments)
            return min(3, kernel(*arguments))

        return at_most_three

    monkeypatch.setattr(compiled_steps, "joint_kernel", failing)
    found = steps_of("amplitudes", "numba")
    assert len(calls) > 2 * 32 / 5
    assert_same(steps_of("amplitudes", "numpy"), found)


@compiled
def test_other_bodies_and_effects_are_left_to_numpy(monkeypatch):
    from rft import EndCaps

    def none(law):
        raise AssertionError("compiled code is asked for")

    monkeypatch.setattr(compiled_steps, "joint_kernel", none)
    effects = [Springs(stiffness=0.2), EndCaps(0.02)]
    alpha, alphadot = wave(2, phases=8)
    found = time_steps(
        SAND, Chain(), alpha, alphadot, effects=effects, backend="numba", cycles=1
    )
    assert found.residual <= 1e-9


def test_linear_equations_are_solved_and_have_no_solution_where_singular():
    """The determinant has its sign; without a solution the numbers are 0."""
    joints = pytest.importorskip("rft.balance.joints")
    rng = np.random.default_rng(1)
    for size in (1, 3, 6):
        matrix, right = rng.normal(size=(size, size)), rng.normal(size=size)
        x = right.copy()
        sign = joints.solve_linear(matrix.copy(), x)
        np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-9)
        assert sign == np.sign(np.linalg.det(matrix))
        for wrong in (0.0, np.nan):
            without = matrix.copy()
            without[0] = wrong
            x = right.copy()
            assert joints.solve_linear(without, x) == 0.0
            np.testing.assert_array_equal(x, np.zeros(size))
