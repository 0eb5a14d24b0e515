"""Body velocities: closed form, an independent solver, symmetries, status."""

import numpy as np
import pytest
from registry import DRY, MEDIA

from geomech.mathematics import symbolic
from rft import Chain, EndCaps, Granular, Viscous, body_velocity
from rft.balance import backend, velocity
from rft.formulas.newton import plus, to_element, to_frame
from rft.laws.base import TermLaw

GLASS = MEDIA["glass-0.3mm-loose"]
THREE = Chain()
FASTEST = backend.fastest()


class Mud(TermLaw):
    """A yield stress and a viscosity: it knows speed."""

    dry = ((1.0, 1.0, 1.0), (0.3, 0.0, 1.2))
    viscous = (0.5, 1.0)


def samples(body, count, seed=0, spread=2.8):
    rng = np.random.default_rng(seed)
    return rng.uniform(-spread, spread, (count, body.joints)), rng.normal(
        size=(count, body.joints)
    )


def element_velocities(body, alpha, alphadot, xi):
    """v_t, v_n and v_w (n, B) of the elements of a body that moves with xi (B, 3)."""
    motion = body.motion(alpha.T, alphadot.T)
    own = motion.v_t, motion.v_n, motion.v_w
    return plus(own, to_element(motion, *xi.T))


@pytest.mark.parametrize(
    ("link", "ratio", "rtol"), [(1, 1.7, 1e-11), (2, 1.7, 1e-11), (3, 1e8, 1e-6)]
)
def test_viscous_chain_agrees_with_sympy(link, ratio, rtol):
    A, alpha = symbolic.viscous_chain((2, 3, 4), ratio=ratio, frame=f"link-{link}")
    shapes, rates = samples(THREE, 40)
    body = Chain((2, 3, 4), frame=f"link-{link}")
    got = body_velocity(Viscous(ratio), body, shapes, rates)
    exact = symbolic.velocity(A, alpha)(shapes, rates)
    np.testing.assert_allclose(got.xi, exact, rtol=rtol, atol=rtol / 100)
    assert (got.iterations == 1).all()


@pytest.mark.parametrize("medium", DRY)
@pytest.mark.parametrize("c", [1e-12, 1e12])
def test_dry_media_do_not_know_time(medium, c):
    alpha, alphadot = samples(THREE, 20)
    one, other = (
        body_velocity(DRY[medium], THREE, alpha, k * alphadot, backend=FASTEST).xi / k
        for k in (1, c)
    )
    off = np.linalg.norm(other - one, axis=1)
    assert (off < 1e-12 * np.linalg.norm(one, axis=1)).all()


@pytest.mark.parametrize("medium", MEDIA)
def test_mirror_and_reversal(medium):
    alpha, alphadot = samples(THREE, 50)

    def solve(alpha, alphadot):
        options = {"tolerance": 1e-12, "backend": FASTEST}
        return body_velocity(MEDIA[medium], THREE, alpha, alphadot, **options).xi

    xi = solve(alpha, alphadot)
    np.testing.assert_allclose(solve(alpha, -alphadot), -xi, atol=1e-9)
    np.testing.assert_allclose(solve(-alpha, -alphadot), xi * [1, -1, -1], atol=1e-9)
    turned = solve(-alpha[:, ::-1], -alphadot[:, ::-1])
    np.testing.assert_allclose(turned, xi * [-1, -1, 1], atol=1e-9)


def test_stuck_is_slower_than_ten_times_the_regularisation():
    """By the slowest element's faster end, from the velocities themselves; links
    between 5 and 20 times it are met."""
    rng = np.random.default_rng(5)
    alpha, alphadot = rng.uniform(-2.8, 2.8, (3000, 2)), rng.normal(size=(3000, 2))
    alphadot /= np.linalg.norm(alphadot, axis=1, keepdims=True)
    found = body_velocity(GLASS, THREE, alpha, alphadot, regularisation=1e-3)
    v_t, v_n, v_w = element_velocities(THREE, alpha, alphadot, found.xi)
    slowest = np.hypot(v_t, np.abs(v_n) + np.abs(v_w)).min(0)
    stuck = found.status == "stuck"
    for low, high, expected in ((5, 9.999, True), (10.001, 20, False)):
        between = (low * 1e-3 < slowest) & (slowest < high * 1e-3)
        assert between.sum() > 20
        assert (stuck[between] == expected).all()


def test_batches_broadcast_and_keep_their_shape():
    alpha, alphadot = np.zeros((4, 1, 2)) + 0.3, np.eye(2)
    batch = body_velocity(GLASS, THREE, alpha, alphadot)
    assert batch.xi.shape == (4, 2, 3)
    single = body_velocity(GLASS, THREE, alpha[0, 0], alphadot[1])
    np.testing.assert_allclose(single.xi, batch.xi[0, 1], atol=1e-9)


class Steps:
    """A law without rounding: its balance has no solution between its steps."""

    def traction(self, v_t, v_n, rounding=0.0):
        return np.sign(v_t), 3 * np.sign(v_n)


def test_a_balance_that_is_not_solved_says_so():
    found = body_velocity(Steps(), THREE, *samples(THREE, 1))
    assert (found.status == "unconverged").all()
    assert (found.residual > 1e-10).all()
    with pytest.raises(RuntimeError, match="1 of 1 force balances did not converge"):
        found.checked()


@pytest.mark.parametrize("speed", [1e-6, 0.3, 5.0, 1e9])
@pytest.mark.parametrize(("loads", "rtol"), [("exact", 1e-4), ("gauss:40", 5e-3)])
def test_yield_stress_and_viscosity_together(speed, loads, rtol):
    """At the true velocities, by far more nodes on each link; kinks in links cost Gauss
    digits. Slowly one is a yield stress, fast a viscous medium."""
    alpha, alphadot = np.array([[0.5, -0.9]]), np.array([[1.0, 0.4]])
    found = body_velocity(Mud(), THREE, alpha, speed * alphadot, loads=loads).checked()
    v_t, v_n, v_w = element_velocities(THREE, alpha, speed * alphadot, found.xi)
    s, weights = np.polynomial.legendre.leggauss(400)
    f_t, f_n = Mud().traction(v_t + 0 * s, v_n + v_w * s)
    mean_t, mean_n, turning = (f @ weights / 2 for f in (f_t, f_n, s * f_n))
    motion = THREE.motion(alpha.T, alphadot.T)
    loads = (mean_t[:, None], mean_n[:, None], turning[:, None])
    net = [np.sum(motion.weight * f) for f in to_frame(motion, *loads)]
    assert np.abs(net).max() < rtol * (1 + speed)


def test_large_batches_are_solved_in_parts(monkeypatch):
    """With a radius of its own and a start for each sample."""
    rng = np.random.default_rng(7)
    alpha = rng.uniform(-1.5, 1.5, (2, 30, 2))
    caps = EndCaps(radius=0.05).with_parameters(radius=rng.uniform(0.01, 0.1, 60))
    motion = GLASS, Chain(), alpha, rng.normal(size=(2, 30, 2))
    whole = body_velocity(*motion, effects=(caps,))
    monkeypatch.setattr(velocity, "SAMPLES_TOGETHER", 13)
    start = np.where(rng.random((2, 30, 1)) < 0.5, whole.xi, np.nan)
    for more in ({}, {"start": start}):
        parts = body_velocity(*motion, effects=(caps,), **more)
        np.testing.assert_allclose(parts.xi, whole.xi, rtol=0, atol=1e-9)
        assert (parts.status == whole.status).all()


@pytest.mark.usefixtures("compiled_code")
def test_folds_that_compiled_code_leaves_are_solved_in_parts(monkeypatch):
    """One descent does not reach the solutions of this law near this shape."""
    rng = np.random.default_rng(8)
    law = Granular(8.0, np.radians(35.0))
    alpha = (-1.47053323, -1.9356507) + 1e-3 * rng.normal(size=(40, 2))
    motion = law, Chain(), alpha, (-0.99735926, -0.07262584)
    whole = body_velocity(*motion, backend="numba").checked()
    monkeypatch.setattr(velocity, "SAMPLES_TOGETHER", 1)
    parts = body_velocity(*motion, backend="numba").checked()
    np.testing.assert_allclose(parts.xi, whole.xi, rtol=0, atol=1e-12)
