"""Body velocities: closed form, an independent solver, symmetries, status, bad input."""

import dataclasses

import numpy as np
import pytest
from commands import geomech
from registry import BODIES, CLOSED, DRY, MEDIA

from geomech.mathematics import symbolic
from rft import (
    Chain,
    Coulomb,
    EndCaps,
    GrainInertia,
    Granular,
    TowedSled,
    Viscous,
    body_velocity,
)
from rft.balance import backend
from rft.balance.arrays import nets, solve
from rft.balance.path import _to_elements, _with_slope
from rft.balance.solver import QUICK, SLOW
from rft.effects.contact import assemble, mapped
from rft.formulas.newton import Descent, Limits, plus, to_element, to_frame
from rft.laws.base import TermLaw

GLASS = MEDIA["glass-0.3mm-loose"]
THREE = Chain()


class Mud(TermLaw):
    """A yield stress and a viscosity: it knows speed."""

    dry = ((1.0, 1.0, 1.0), (0.3, 0.0, 1.2))
    viscous = (0.5, 1.0)


def samples(body, count, seed=0, spread=2.8):
    rng = np.random.default_rng(seed)
    return rng.uniform(-spread, spread, (count, body.joints)), rng.normal(
        size=(count, body.joints)
    )


def test_viscous_swimmer_in_its_middle_link_frame():
    """A(0, 0) of Purcell's swimmer at 2 : 1, exactly."""
    xi = body_velocity(Viscous(2.0), Chain(frame="link-2"), [0.0, 0.0], np.eye(2)).xi
    np.testing.assert_allclose(
        xi.T, [[0, 0], [-1 / 18, -1 / 18], [7 / 27, -7 / 27]], atol=1e-15
    )


@pytest.mark.parametrize("link", [1, 2, 3])
def test_viscous_chain_agrees_with_sympy(link):
    A, alpha = symbolic.viscous_chain((2, 3, 4), ratio=1.7, frame=f"link-{link}")
    shapes, rates = samples(THREE, 40)
    got = body_velocity(
        Viscous(1.7), Chain((2, 3, 4), frame=f"link-{link}"), shapes, rates
    )
    np.testing.assert_allclose(
        got.xi, symbolic.velocity(A, alpha)(shapes, rates), rtol=1e-11, atol=1e-13
    )
    assert (got.iterations == 1).all()


def plain_force(medium, lengths, alpha, alphadot, xi, eps, nodes=4000):
    """Net force and moment in the middle link's frame of a three-link body, written out anew: midpoint segments."""
    force = np.zeros(3)
    half = np.array(lengths) / sum(lengths) / 2
    s = (np.arange(nodes) + 0.5) / nodes * 2 - 1
    for heading, turn, joint, sign, h in (
        (-alpha[0], -alphadot[0], -half[1], -1, half[0]),
        (0.0, 0.0, 0.0, 0, half[1]),
        (alpha[1], alphadot[1], half[1], 1, half[2]),
    ):
        along, normal = np.array(
            [[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]]
        )
        arm = (s + sign)[:, None] * h * along  # from the joint
        place = np.array([joint, 0.0]) + arm
        velocity = (
            xi[:2] + xi[2] * place @ [[0, 1], [-1, 0]] + turn * arm @ [[0, 1], [-1, 0]]
        )
        f_t, f_n = medium.traction(velocity @ along, velocity @ normal, eps)
        f = 2 * h / nodes * (f_t[:, None] * along + f_n[:, None] * normal)
        force += [*f.sum(0), (place[:, 0] * f[:, 1] - place[:, 1] * f[:, 0]).sum()]
    return force


@pytest.mark.parametrize("medium", ["glass-0.3mm-loose", "coulomb", "viscous-2"])
def test_forces_vanish_by_an_independent_sum(medium):
    body = Chain((1, 2, 1.5), frame="link-2")
    alpha, alphadot = samples(body, 12, seed=3)
    alphadot /= np.linalg.norm(alphadot, axis=1, keepdims=True)
    eps = 1e-3
    xi = body_velocity(MEDIA[medium], body, alpha, alphadot, regularisation=eps).xi
    for a, d, x in zip(alpha, alphadot, xi):
        residual = plain_force(MEDIA[medium], body.lengths, a, d, x, eps)
        assert np.abs(residual).max() < 1e-5  # of the order 2 midpoint rule
        moved = plain_force(MEDIA[medium], body.lengths, a, d, x + [0.01, 0, 0], eps)
        assert np.abs(moved).max() > 1e-4  # the test can tell


@pytest.mark.parametrize("rule", ["midpoint", "gauss"])
def test_quadrature_loads_approach_the_exact_ones(rule):
    alpha, alphadot = samples(THREE, 60, seed=4)
    exact = body_velocity(GLASS, THREE, alpha, alphadot, regularisation=1e-3).xi
    errors = []
    for nodes in (10, 40, 160):
        other = body_velocity(
            GLASS, THREE, alpha, alphadot, regularisation=1e-3, loads=f"{rule}:{nodes}"
        ).checked()
        errors.append(np.sqrt(np.mean((other.xi - exact) ** 2)))
    assert errors[2] < 1e-3
    assert errors[1] < errors[0] / 2
    assert errors[2] < errors[1] / 2


@pytest.mark.parametrize("medium", DRY)
def test_dry_media_do_not_know_time(medium):
    alpha, alphadot = samples(THREE, 20)
    solve = lambda d: (
        body_velocity(DRY[medium], THREE, alpha, d, backend=backend.fastest()).xi
    )
    one = solve(alphadot)
    for c in (1e-12, 1e12):
        off = solve(c * alphadot) / c - one
        assert (np.linalg.norm(off, axis=1) < 1e-12 * np.linalg.norm(one, axis=1)).all()


@pytest.mark.parametrize("medium", MEDIA)
def test_mirror_and_reversal(medium):
    alpha, alphadot = samples(THREE, 50)
    fastest = backend.fastest()
    solve = lambda a, d: (
        body_velocity(MEDIA[medium], THREE, a, d, tolerance=1e-12, backend=fastest).xi
    )
    xi = solve(alpha, alphadot)
    np.testing.assert_allclose(solve(alpha, -alphadot), -xi, atol=1e-9)
    np.testing.assert_allclose(solve(-alpha, -alphadot), xi * [1, -1, -1], atol=1e-9)
    np.testing.assert_allclose(
        solve(-alpha[:, ::-1], -alphadot[:, ::-1]), xi * [-1, -1, 1], atol=1e-9
    )


def test_the_body_that_stays_put():
    """alpha = (1.5, 1.5), both joints driven alike: the middle link does not move, the others only turn."""
    solution = body_velocity(GLASS, Chain(frame="link-2"), [1.5, 1.5], [1.0, 1.0])
    assert solution.status == "stuck"
    assert np.abs(solution.xi).max() < 3e-6


def test_four_percent_of_random_samples_stick():
    solution = body_velocity(GLASS, THREE, *samples(THREE, 4000))
    assert np.mean(solution.status == "stuck") == pytest.approx(0.04, abs=0.01)


def test_stuck_is_slower_than_ten_times_the_regularisation():
    """By the slowest element's faster end, from the velocities themselves; links between 5 and 40 times it are met."""
    rng = np.random.default_rng(5)
    alpha, alphadot = rng.uniform(-2.8, 2.8, (3000, 2)), rng.normal(size=(3000, 2))
    alphadot /= np.linalg.norm(alphadot, axis=1, keepdims=True)
    eps = 1e-3
    found = body_velocity(GLASS, THREE, alpha, alphadot, regularisation=eps)
    motion = THREE.motion(alpha.T, alphadot.T)
    a, m, w = plus(
        (motion.v_t, motion.v_n, motion.v_w), to_element(motion, *found.xi.T)
    )
    slowest = np.hypot(a, np.maximum(np.abs(m - w), np.abs(m + w))).min(0)
    stuck = found.status == "stuck"
    for low, high, wanted in ((5, 9.999, True), (10.001, 20, False), (20, 40, False)):
        between = (low * eps < slowest) & (slowest < high * eps)
        assert between.sum() > 20
        assert (stuck[between] == wanted).all()


def test_no_motion_without_joint_motion():
    solution = body_velocity(
        GLASS, THREE, [[0.3, 1.0], [0.3, 1.0]], [[0.0, 0.0], [1.0, 0.0]]
    )
    assert np.array_equal(solution.xi[0], np.zeros(3))
    assert solution.status.tolist() == ["stuck", "sliding"]


def test_batches_broadcast_and_keep_their_shape():
    alpha, alphadot = np.zeros((4, 1, 2)) + 0.3, np.eye(2)
    solution = body_velocity(GLASS, THREE, alpha, alphadot)
    assert solution.xi.shape == (4, 2, 3)
    assert (
        solution.residual.shape
        == solution.status.shape
        == solution.iterations.shape
        == (4, 2)
    )
    single = body_velocity(GLASS, THREE, alpha[0, 0], alphadot[1])
    np.testing.assert_allclose(single.xi, solution.xi[0, 1], atol=1e-9)
    assert body_velocity(GLASS, THREE, np.zeros((0, 2)), np.zeros((0, 2))).xi.shape == (
        0,
        3,
    )


def test_length_scales_translation_only():
    alpha, alphadot = samples(THREE, 10)
    one, tiny = (
        body_velocity(GLASS, dataclasses.replace(THREE, length=x), alpha, alphadot).xi
        for x in (1.0, 1e-6)
    )
    np.testing.assert_allclose(tiny, one * [1e-6, 1e-6, 1.0], rtol=1e-13)


@pytest.mark.parametrize("medium", [m for m in DRY if m in CLOSED])
@pytest.mark.parametrize("body", ["three-middle", "uneven", "arcs"])
def test_curves_lead_to_what_the_descent_finds(medium, body, monkeypatch):
    problem = samples(BODIES[body], 40)
    solve = lambda: body_velocity(
        DRY[medium], BODIES[body], *problem, backend=backend.fastest()
    ).checked()
    wanted = solve()
    monkeypatch.setattr("rft.balance.solver.QUICK", QUICK._replace(budget=1.0))
    found = solve()
    np.testing.assert_allclose(found.xi, wanted.xi, atol=1e-7)
    assert (found.status == wanted.status).all()
    assert found.iterations.max() <= 120  # of the first walk alone
    assert found.iterations.mean() < 30


@pytest.mark.parametrize(("medium", "cost"), [(GLASS, 1), (Mud(), 2)])
def test_the_slope_in_the_rounding(medium, cost):
    """d(net)/d(log eps), exactly or by a difference, against a wider one."""
    alpha, alphadot = (x.T for x in samples(THREE, 20))
    assembly = assemble(medium, THREE)
    some = assembly.problem(alpha, alphadot, np.full(20, 0.7))
    xi, eps = np.full((3, 20), 0.1), np.full(20, 0.05)
    v = some.sides.elements.v / 0.7 + _to_elements(some, xi)
    slope, evaluations = _with_slope(nets, some, xi, v, eps)[1:]
    up, down = (
        _with_slope(nets, some, xi, v, eps * np.exp(h))[0][:, 0] for h in (1e-4, -1e-4)
    )
    np.testing.assert_allclose(slope, (up - down) / 2e-4, rtol=1e-4, atol=1e-6)
    assert np.abs(slope).max() > 0.01
    assert evaluations == cost


@pytest.mark.parametrize("speed", [1e-6, 0.3, 1e3])
@pytest.mark.parametrize("loads", ["exact", "gauss:12"])
def test_curves_of_laws_that_know_speed(speed, loads, monkeypatch):
    """There the derivative with respect to the rounding is a difference."""
    alpha, alphadot = samples(THREE, 40)
    effects = (GrainInertia(frequency=1.0, length=0.1, depth=0.1),)
    solve = lambda: body_velocity(
        Mud(), THREE, alpha, speed * alphadot, loads=loads, effects=effects
    )
    wanted = solve()
    monkeypatch.setattr("rft.balance.solver.QUICK", QUICK._replace(budget=1.0))
    found = solve().checked()
    np.testing.assert_allclose(found.xi / speed, wanted.xi / speed, atol=1e-6)


@pytest.mark.parametrize(
    ("medium", "effects", "loads"),
    [
        (GLASS, (), "exact"),
        (Coulomb(), (), "exact"),
        (Viscous(2.0), (), "exact"),
        (Mud(), (), "exact"),
        (GLASS, (), "gauss:5"),
        (GLASS, (EndCaps(0.1, tail=3.0),), "exact"),
        (GLASS, (TowedSled(0.2, 0.3),), "exact"),
    ],
)
def test_the_first_step_is_that_of_kinks_rounded_off_without_end(
    medium, effects, loads
):
    """Of a wide rounding the first step from rest is the whole way: the balance is linear."""
    body = Chain((2, 1, 3), frame="link-1")
    problem = assemble(medium, body, effects, loads).problem(
        *(x.T.copy() for x in samples(body, 30))
    )
    wide = 1e6
    *xi, residual, evaluations, _ = solve(
        problem, Descent(wide, 0.5, 0.0, np.inf, 3.0), Limits(wide, 1e-11), None
    )
    assert (evaluations <= 2).all()
    assert residual.max() < 1e-11
    assert np.abs(xi).max() > 0.1


def test_descents_are_ever_slower_and_more_patient():
    firsts, ratios, residuals, free, budgets = np.array([QUICK, *SLOW]).T
    assert ((firsts > 0) & (ratios > 0) & (ratios < 1) & (free > 1)).all()
    assert (
        (np.diff(firsts) > 0).all()
        and (np.diff(residuals) < 0).all()
        and (np.diff(budgets) > 0).all()
    )


def test_a_starved_solver_says_so(monkeypatch):
    monkeypatch.setattr("rft.balance.solver.QUICK", QUICK._replace(budget=2.0))
    monkeypatch.setattr("rft.balance.solver.WALKS", ((0.2, 4),))
    monkeypatch.setattr("rft.balance.solver.SLOW", ())
    solution = body_velocity(GLASS, THREE, *samples(THREE, 20))
    assert (solution.status == "unconverged").all()
    assert (solution.residual > 1e-10).all()
    assert (solution.iterations == 6).all()
    with pytest.raises(RuntimeError, match="20 of 20 force balances did not converge"):
        solution.checked()
    monkeypatch.setattr("rft.balance.solver.WALKS", ())
    easy = body_velocity(
        GLASS, THREE, *samples(THREE, 20), tolerance=1e3
    )  # near enough, but of kinks rounded off widely
    assert np.count_nonzero(easy.status == "unconverged") > 10


@pytest.mark.parametrize("as_json", [[], ["--json"]])
def test_the_command_fails_with_the_balance(as_json, monkeypatch):
    """Exit code 2, one line, nothing that looks like a result."""
    monkeypatch.setattr("rft.balance.solver.QUICK", QUICK._replace(budget=2.0))
    monkeypatch.setattr("rft.balance.solver.WALKS", ())
    monkeypatch.setattr("rft.balance.solver.SLOW", ())
    code, out, err = geomech(
        "velocity",
        "three-link-glass",
        "--alpha",
        "0.5,0.3",
        "--alphadot",
        "1,0",
        *as_json,
    )
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "three-link-glass: the force balance did not converge" in err


@pytest.mark.parametrize(
    ("alpha", "alphadot", "kwargs", "said"),
    [
        (
            [0.0],
            [1.0],
            {},
            r"alpha must have shape \(\.\.\., 2\) for this body, got \(1,\)",
        ),
        ([0.0, np.nan], [1.0, 0.0], {}, "alpha must be finite, got nan"),
        ([0.0, 0.0], [1.0, np.inf], {}, "alphadot must be finite, got inf"),
        (np.zeros((3, 2)), np.zeros((4, 2)), {}, "do not broadcast"),
        (
            [0.0, 0.0],
            [1.0, 0.0],
            {"regularisation": 0.0},
            "regularisation must be a number from 1e-15 to 1000, got 0.0",
        ),
        ([0.0, 0.0], [1.0, 0.0], {"loads": "best"}, "loads must be"),
        ([0.0, 0.0], [0.0, 0.0], {"loads": "best"}, "loads must be"),
        (
            [0.0, 1e20],
            [1.0, 0.0],
            {},
            "alpha must be 0 or of a size that leaves digits",
        ),
        (
            [0.0, 0.0],
            [1e155, 0.0],
            {},
            "alphadot must be 0 or of a size that leaves digits",
        ),
        (
            [0.0, 0.0],
            [1e-170, 0.0],
            {},
            "alphadot must be 0 or of a size that leaves digits",
        ),
        ([0.0, 1j], [1.0, 0.0], {}, "alpha must be real numbers"),
        ([0.0, "a"], [1.0, 0.0], {}, "alpha must be real numbers"),
    ],
)
def test_bad_input_is_refused(alpha, alphadot, kwargs, said):
    with pytest.raises(ValueError, match=said):
        body_velocity(GLASS, THREE, alpha, alphadot, **kwargs)


def test_threads_give_the_same_answer():
    alpha, alphadot = samples(THREE, 10_000)
    one, two = (
        body_velocity(Coulomb(), THREE, alpha, alphadot, threads=n).xi for n in (1, 2)
    )
    np.testing.assert_allclose(two, one, atol=1e-9)


def test_granular_with_no_extra_force_is_coulomb():
    alpha, alphadot = samples(THREE, 50)
    a, b = (
        body_velocity(m, THREE, alpha, alphadot).xi
        for m in (Granular(0.0, 0.3), Coulomb())
    )
    np.testing.assert_allclose(a, b, atol=1e-9)


@pytest.mark.parametrize("speed", [1e-6, 0.3, 5.0, 1e9])
@pytest.mark.parametrize("loads", ["exact", "gauss:40"])
def test_yield_stress_and_viscosity_together(speed, loads):
    """At the true velocities, by far more nodes on each link."""
    alpha, alphadot = np.array([0.5, -0.9]), speed * np.array([1.0, 0.4])
    solution = body_velocity(Mud(), Chain(), alpha, alphadot, loads=loads).checked()
    motion = Chain().motion(alpha[:, None], alphadot[:, None])
    a, m, w = np.stack(
        plus(
            (motion.v_t, motion.v_n, motion.v_w),
            to_element(motion, *solution.xi[:, None]),
        )
    )[..., 0]
    net = np.zeros(3)
    for k in range(3):
        at = lambda s: np.array(Mud().traction(a[k], m[k] + w[k] * s))
        x, weights = np.polynomial.legendre.leggauss(400)
        f = np.array([at(s) for s in x]).T * weights / 2
        e = mapped(
            lambda rows, k=k: rows[k, 0] if rows.shape[-1] == 1 else rows[k], motion
        )
        net += e.weight * np.array(
            to_frame(e, f[0].sum(), f[1].sum(), (x * f[1]).sum())
        )
    assert np.abs(net).max() < (1e-4 if loads == "exact" else 5e-3) * (
        1 + speed
    )  # kinks in links cost Gauss digits
    slow = body_velocity(Mud(), Chain(), alpha, alphadot / speed * 1e-9).xi * 1e9
    fast = body_velocity(Mud(), Chain(), alpha, alphadot / speed * 1e9).xi / 1e9
    assert (
        np.abs(slow - fast).max() > 1e-3
    )  # one is a yield stress, the other a viscous medium
    viscous = body_velocity(Viscous(2.0), Chain(), alpha, alphadot / speed).xi
    np.testing.assert_allclose(fast, viscous, atol=1e-7)


class Hidden:
    """The same law as mud's, without its terms."""

    dry = viscous = None
    mirror = True

    def traction(self, v_t, v_n, eps=0.0):
        return Mud().traction(v_t, v_n, eps)


@pytest.mark.parametrize("speed", [1e-6, 0.3, 1e3])
def test_laws_of_unknown_form_are_taken_at_true_velocities(speed):
    alpha, alphadot = samples(THREE, 40)
    found, wanted = (
        body_velocity(law(), THREE, alpha, speed * alphadot, loads="gauss:12").checked()
        for law in (Hidden, Mud)
    )
    np.testing.assert_allclose(found.xi / speed, wanted.xi / speed, atol=1e-6)
