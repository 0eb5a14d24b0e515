"""The laws behind effects, each against a closed form, its own equation or a far finer computation."""

import itertools

import numpy as np
import pytest
from registry import BODIES

from geomech import scenes
from geomech.gaits import Sine
from rft import (
    CATALOGUE,
    Backbone,
    Chain,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    SkinFriction,
    Viscous,
    body_velocity,
    march,
)
from rft.bodies.pieces import Pieces, cut
from rft.effects.base import Here
from rft.effects.disturbed import Ground
from rft.effects.sides import sides
from rft.effects.transient import _developed
from rft.loads import element_load

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")


def test_end_caps_are_the_written_formula():
    cap, psi, e = EndCaps(radius=0.08, head=4.0, tail=0.0), np.linspace(0.01, 3.1, 20), 4.0
    along, across = cap.traction(GLASS, np.cos(psi), np.sin(psi))
    unit = 2 * 0.08  # 2 r C_F L with C_F = L = 1
    axial = e * np.pi * 0.08**2 * GLASS.C * np.sin(np.arctan(np.cos(psi) / np.tan(GLASS.gamma0))) / unit
    np.testing.assert_allclose(along, axial, rtol=1e-12)
    np.testing.assert_allclose(across, e * np.pi * 0.08**2 * np.sin(psi) / unit, rtol=1e-12)


def test_skin_friction_scales_the_drag_along_by_the_way_it_slides():
    """Forward over reference where an element slides towards its head, backward towards its tail; the drag across stays."""
    a, m, w = np.random.default_rng(6).normal(size=(3, 3, 40))
    a += 0.01 * np.sign(a)
    eps, plain = np.full(40, 1e-3), element_load(GLASS)
    skin = SkinFriction(forward=0.12, backward=0.31, reference=0.25).load(plain, GLASS, Chain())
    found, without = skin(a, m, w, eps), plain(a, m, w, eps)
    np.testing.assert_allclose(found[0], without[0] * np.where(a > 0, 0.12, 0.31) / 0.25, rtol=1e-14)
    np.testing.assert_array_equal(found[1:], without[1:])


def test_squared_speed_is_integrated_exactly():
    from rft.effects.grain_inertia import squared_speed_load

    rng = np.random.default_rng(0)
    m, w = rng.normal(size=(2, 60))
    m[:10], w[10:20], w[20:30] = 0.0, 0.0, m[20:30] * rng.choice([-1.0, 1.0], 10)
    x, weight = np.polynomial.legendre.leggauss(3)
    pivot = np.clip(np.where(w == 0, -1.0, -m / np.where(w == 0, 1.0, w)), -1, 1)
    exact = np.zeros((2, 60))
    for low, high in ((-1.0, pivot), (pivot, 1.0)):  # a polynomial on either side, for which three nodes are exact
        s = (low + high) / 2 + (high - low) / 2 * x[:, None]
        u = m + w * s
        part = np.array([np.abs(u) * u, s * np.abs(u) * u])
        exact += (weight[:, None] * part).sum(1) * (high - low) / 4
    got = squared_speed_load(m, w)
    np.testing.assert_allclose(got[:, 0], exact, atol=1e-14)
    h = 1e-6
    np.testing.assert_allclose(
        got[:, 2], (squared_speed_load(m + h, w) - squared_speed_load(m - h, w))[:, 0] / (2 * h), atol=1e-5
    )
    np.testing.assert_allclose(
        got[:, 3], (squared_speed_load(m, w + h) - squared_speed_load(m, w - h))[:, 0] / (2 * h), atol=1e-5
    )


def test_sides_are_parts_of_the_whole():
    """Left and right add up to the element's load; each is that of the positive and of the negative velocities across."""
    rng = np.random.default_rng(2)
    a, m, w = rng.normal(size=(3, 4, 50))
    m[0], w[1] = 0.0, 0.0
    eps, load = np.full(50, 1e-3), element_load(GLASS)
    left, right = sides(load, a, m, w, eps)
    np.testing.assert_allclose(left + right, load(a, m, w, eps), atol=1e-12)
    s = (np.arange(20000) + 0.5) / 10000 - 1
    u = m + w * s[:, None, None]
    f_t, f_n = GLASS.traction(a, u, 1e-3)
    for part, where in ((left, u > 0), (right, u < 0)):
        for row, f in enumerate((f_t, f_n, s[:, None, None] * f_n)):
            np.testing.assert_allclose(part[row, 0], (f * where).mean(0), atol=3e-4)
    h, inner = 1e-6, np.abs(np.abs(m) - np.abs(w)) > 1e-3
    for column, step in ((2, (0, h, 0)), (3, (0, 0, h))):
        up, down = (sides(load, a + k * step[0], m + k * step[1], w + k * step[2], eps)[0] for k in (1, -1))
        slope = (up - down)[1:, 0] / (2 * h)
        np.testing.assert_allclose(left[1:, column][:, inner], slope[:, inner], rtol=1e-3, atol=1e-3)


def test_transients_follow_their_equation():
    """An oscillating rod: shares against dh/dx = 3 (1 - h) / travel one way and -3 h / travel the other, of order 2 in the
    step; 95 % is there after the travel."""
    travel, t_end = 0.2, 7.0
    way = lambda t: np.sin(1.3 * t) + 0.3 * np.cos(2.1 * t)

    def exact():
        h, dt = np.zeros(2), 1e-4
        for t in np.arange(0, t_end, dt):
            u = way(t + dt / 2)
            goal = np.array([u > 0, u < 0], float)
            h = goal + (h - goal) * np.exp(-3 / travel * abs(u) * dt)
        return h

    def marched(steps):
        h, t = np.zeros((2, 1, 1)), np.linspace(0, t_end, steps + 1)
        for before, now in itertools.pairwise(t):
            h, _ = _developed(h, np.full((1, 1), way(before)), np.full((1, 1), way(now)), now - before, 3 / travel)
        return h[:, 0, 0]

    truth, counts = exact(), np.array([50, 100, 200, 400])
    errors = [np.abs(marched(n) - truth).max() for n in counts]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(2, abs=0.3)
    one = np.ones((1, 1))
    (left, right), _ = _developed(np.array([[[0.0]], [[1.0]]]), one, one, travel, 3 / travel)
    assert left == pytest.approx(1 - np.exp(-3))
    assert right == pytest.approx(np.exp(-3))


def test_slopes_of_shares_are_derivatives():
    rng = np.random.default_rng(3)
    memory, before, now, h = rng.uniform(size=(2, 5, 40)), *rng.normal(size=(2, 5, 40)), 1e-6
    values, slopes = _developed(memory, before, now, 0.3, 2.0)
    difference = _developed(memory, before, now + h, 0.3, 2.0)[0] - _developed(memory, before, now - h, 0.3, 2.0)[0]
    np.testing.assert_allclose(slopes, difference / (2 * h), atol=1e-7)
    assert (values >= 0).all()
    assert (values <= 1).all()
    assert (slopes[0] >= 0).all()  # the faster to the left, the more of the drag to the left
    assert (slopes[1] <= 0).all()
    still = _developed(memory, before, now, 0.3, np.inf)
    assert (still[0] == 1).all()
    assert (still[1] == 0).all()


def test_ground_remembers_where_the_body_was():
    ground = Ground(0.025, 2)
    ground.mark(np.array([[0.3 + 0.2j, 0.0]]), 0.05)
    # A whole disturbance on the axis, nothing far off, and nothing in the other sample's ground.
    assert ground.at(np.array([0.3 + 0.2j, 0.3 + 0.2j])) == pytest.approx([1, 0], abs=0.05)
    assert ground.at(np.array([0.3 + 0.32j, 5.0])) == pytest.approx([0, 0], abs=1e-12)
    assert ground.at(np.array([0.3 + 0.25j, 0.05])) == pytest.approx([0.5, 0.5], abs=0.1)
    # A patch that wraps round onto the same cells is untouched ground, and taking it over forgets the old.
    assert ground.at(np.array([0.3 + 0.2j + 4, 0.0])) == pytest.approx([0, 1], abs=0.05)
    ground.mark(np.array([[4.3 + 0.2j, 0.0]]), 0.05)
    assert ground.at(np.array([0.3 + 0.2j, 0.0])) == pytest.approx([0, 1], abs=0.05)


def test_a_body_that_finds_fresh_ground_is_not_weakened():
    """The first steps of a straight-ahead chain: its own track lies behind and under it, not at its sides."""
    effect = DisturbedGround(radius=0.03, weakening=1.0)
    body = cut(Chain((1, 1, 1)))
    motion = body.motion(np.zeros((2, 1)), np.ones((2, 1)))
    here = Here(0.1, motion.place, motion.c + 1j * motion.s, motion, motion.v, np.ones(1))
    memory = effect.start(len(motion.half), 1)
    memory = effect.after(memory, here, motion.v)
    now = effect.at(memory, here)
    np.testing.assert_allclose([now.left, now.right], 1.0, atol=1e-12)
    aside = here._replace(place=motion.place + 0.06j)
    assert effect.at(memory, aside).right.max() < 0.1  # the track it left
    assert effect.at(memory, aside).left.min() == 1.0


@pytest.mark.parametrize("name", BODIES)
def test_pieces_move_as_the_body(name):
    """Cutting elements changes no force and no moment."""
    body, rng = BODIES[name], np.random.default_rng(4)
    alpha, alphadot = rng.uniform(-1, 1, (20, body.joints)), rng.normal(size=(20, body.joints))
    whole = body_velocity(GLASS, body, alpha, alphadot, tolerance=1e-12)
    pieces = body_velocity(GLASS, Pieces(body, 0.03), alpha, alphadot, tolerance=1e-12)
    np.testing.assert_allclose(pieces.xi, whole.xi, atol=1e-7)


def test_depth_along_the_body():
    """Uniform depth changes nothing, whatever it is. A rising ground to the left mirrors one to the right."""
    body, rng = Chain((1, 1, 1)), np.random.default_rng(5)
    alpha, alphadot = rng.uniform(-1, 1, (20, 2)), rng.normal(size=(20, 2))
    plain = body_velocity(GLASS, body, alpha, alphadot).xi
    for depths in ((3.0, 3.0), (0.5, 0.5, 0.5)):
        level = body_velocity(GLASS, body, alpha, alphadot, effects=(DepthProfile(along=depths),)).xi
        np.testing.assert_allclose(level, plain, atol=1e-8)
    heads = Backbone(20), *Sine(elements=20).cycle(32)
    up, down = (
        march(GLASS, heads[0], sign * heads[1], sign * heads[2], effects=(DepthProfile(slope=0.5, towards=way),))
        for sign, way in ((1, 0.8), (-1, -0.8))
    )
    np.testing.assert_allclose(up.pose, down.pose * [1, -1, -1], atol=1e-7)


def test_depth_along_a_straight_chain_in_closed_form():
    """In a viscous medium, straight, the tail's link turning: two linear equations for drift and turn."""
    depth = lambda x: 1.5 + x
    nodes, weights = np.polynomial.legendre.leggauss(40)
    own, drift = 0.0, np.zeros((2, 2))
    for low, high, rate in ((-1 / 2, -1 / 6, -1.0), (-1 / 6, 1 / 2, 0.0)):
        x = (low + high) / 2 + (high - low) / 2 * nodes
        f = weights * (high - low) / 2 * depth(x)
        own = own + np.array([np.sum(f * rate * (x + 1 / 6)), np.sum(f * x * rate * (x + 1 / 6))])
        drift += [[np.sum(f), np.sum(f * x)], [np.sum(f * x), np.sum(f * x * x)]]
    wanted = np.linalg.solve(drift, -own)
    effect, body = DepthProfile(along=(1.0, 2.0)), Chain((1, 1, 1), frame="link-2")
    xi = body_velocity(Viscous(2.0), body, [0.0, 0.0], [1.0, 0.0], effects=(effect,)).xi
    np.testing.assert_allclose(xi, [0, *wanted], atol=2e-4)  # pieces count as their centres
