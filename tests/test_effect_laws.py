"""The laws behind effects, each against a closed form, its own equation or a far finer computation."""

import dataclasses
import itertools

import numpy as np
import pytest
from registry import BODIES

from geomech import scene as scenes
from geomech.gaits import Circle, Sine
from rft import (
    CATALOGUE,
    Backbone,
    BodyInertia,
    Chain,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    SkinFriction,
    TowedSled,
    Transient,
    Viscous,
    body_velocity,
    time_steps,
    work_done,
)
from rft.bodies.pieces import Pieces, subdivide
from rft.contact import Averages, Contact, Model
from rft.effects.base import Site, folded
from rft.effects.disturbed import Ground
from rft.effects.transient import _developed
from rft.loads import element_load
from rft.sides import parts, sided

GLASS = CATALOGUE["glass-0.3mm-loose"].medium


@dataclasses.dataclass(frozen=True)
class Power:
    """Drag that grows with a power of the speed, three times as much across."""

    power: float

    def traction(self, v_t, v_n, eps=0.0):
        drag = (np.sqrt(v_t**2 + v_n**2 + eps**2) + 1e-300) ** (self.power - 1)
        return drag * v_t, 3.0 * drag * v_n


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
    skin = SkinFriction(forward=0.12, backward=0.31, reference=0.25).apply(Model.of(GLASS)).contacts["side"]
    found, without = skin.load(a, m, w, eps), plain(a, m, w, eps)
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

    def side(share):
        one = lambda m, w: (np.stack([share + 0 * m, 1 - share + 0 * m]), None, None)
        return lambda *v: sided(load, (one,), *v)

    left, right = (side(share)(a, m, w, eps) for share in (1.0, 0.0))
    np.testing.assert_allclose((left + right)[1:], load(a, m, w, eps)[1:], atol=1e-12)
    s = (np.arange(20000) + 0.5) / 10000 - 1
    u = m + w * s[:, None, None]
    f_t, f_n = GLASS.traction(a, u, 1e-3)
    for part, where in ((left, u > 0), (right, u < 0)):
        np.testing.assert_allclose(part[0, 0], f_t.mean(0), atol=3e-4)  # along the body nothing is taken away
        for row, f in ((1, f_n), (2, s[:, None, None] * f_n)):
            np.testing.assert_allclose(part[row, 0], (f * where).mean(0), atol=3e-4)
    h, inner = 1e-6, np.abs(np.abs(m) - np.abs(w)) > 1e-3
    for column, step in ((2, (0, h, 0)), (3, (0, 0, h))):
        up, down = (side(1.0)(a + k * step[0], m + k * step[1], w + k * step[2], eps) for k in (1, -1))
        slope = (up - down)[1:, 0] / (2 * h)
        np.testing.assert_allclose(left[1:, column][:, inner], slope[:, inner], rtol=1e-3, atol=1e-3)


def test_elements_are_split_once_however_many_effects_tell_their_sides_apart():
    """Two shares of a half and a third are one of a sixth; the law is asked once, for no more than two parts an element."""
    rng, asked = np.random.default_rng(7), []
    v, eps, law = rng.normal(size=(3, 4, 50)), np.full(50, 1e-3), element_load(GLASS)
    share = lambda part: lambda v_n, spin: (np.full((2, *v_n.shape), part), None, None)
    counted = lambda v_t, *rest: asked.append(len(v_t)) or law(v_t, *rest)
    both = sided(counted, (share(1 / 2), share(1 / 3)), *v, eps)
    np.testing.assert_allclose(both, sided(law, (share(1 / 6),), *v, eps), rtol=1e-12)
    np.testing.assert_allclose(both[1:], law(*v, eps)[1:] / 6, atol=1e-12)
    assert asked == [8]


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

    def after(h, before, now, dt):
        v = [{"side": np.array([0.0, u, 0.0])[:, None, None]} for u in (before, now)]
        return Transient(travel=travel).after(h, Site(dt, np.zeros((3, 1)), {}, v[0]), v[1])

    def marched(steps):
        h, t = np.zeros((2, 1, 1)), np.linspace(0, t_end, steps + 1)
        for before, now in itertools.pairwise(t):
            h = after(h, way(before), way(now), now - before)
        return h[:, 0, 0]

    truth, counts = exact(), np.array([50, 100, 200, 400])
    errors = [np.abs(marched(n) - truth).max() for n in counts]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(2, abs=0.3)
    left, right = after(np.array([[[0.0]], [[1.0]]]), 1.0, 1.0, travel)
    assert left == pytest.approx(1 - np.exp(-3))
    assert right == pytest.approx(np.exp(-3))


def test_slopes_of_shares_are_derivatives():
    rng = np.random.default_rng(3)
    memory, before, now, h = rng.uniform(size=(2, 5, 40)), *rng.normal(size=(2, 2, 5, 40)), 1e-6
    now = 0.01 + np.abs(now)
    values, slopes = _developed(memory, before, now, 0.3, 2.0)
    difference = _developed(memory, before, now + h, 0.3, 2.0)[0] - _developed(memory, before, now - h, 0.3, 2.0)[0]
    np.testing.assert_allclose(slopes, difference / (2 * h), atol=1e-7)
    assert (values >= 0).all()
    assert (values <= 1).all()
    assert (slopes >= 0).all()  # the faster to a side, the more of the drag to that side
    paused = _developed(memory, np.abs(before), 0 * now, 0.3, 2.0)[0]  # it went on for a while before it stopped
    np.testing.assert_allclose(paused, 1 - (1 - memory) * np.exp(-2.0 * 0.15 * np.abs(before)), rtol=1e-12)
    still = _developed(memory, before, now, 0.3, np.inf)
    assert (still[0] == 1).all()
    assert (still[1] == 0).all()


def test_parts_of_elements_are_means_of_their_velocities():
    rng = np.random.default_rng(6)
    m, w = rng.normal(size=(2, 60))
    m[0], w[1], w[2] = 0.0, 0.0, -m[2]
    velocity, left, inside = parts(m, w)
    u = m + w * ((np.arange(200_000)[:, None] + 0.5) / 100_000 - 1)
    np.testing.assert_allclose(left, (u > 0).mean(0), atol=1e-5)
    for side, share, found in ((u > 0, left, velocity[0]), (u < 0, 1 - left, velocity[1])):
        np.testing.assert_allclose(share * found, (u * side).mean(0), atol=1e-5)
    assert (inside == (np.abs(w) > np.abs(m))).all()


def test_a_piece_that_turns_remembers_both_of_its_sides():
    """About its middle for a long way: each half has built up its own side, so that the piece has half of either."""
    effect, chain = Transient(travel=0.01), Chain((1, 1))
    motion = chain.motion(np.zeros((1, 1)), np.ones((1, 1)))
    site = Site(1.0, np.zeros((3, 1)), {"side": motion}, {"side": np.zeros((3, 2, 1))})
    v = np.array(
        [[[0.0], [0.0]], [[0.0], [0.5]], [[1.0], [1.0]]]
    )  # the second has its pivot at a quarter of its length
    memory = effect.after(np.ones((2, 2, 1)), site, {"side": v})[..., 0]
    np.testing.assert_allclose(memory, [[0.5, 0.75], [0.5, 0.25]], atol=1e-12)


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
    body = subdivide(Chain((1, 1, 1)), 40)
    motion = body.motion(np.zeros((2, 1)), np.ones((2, 1)))
    site = Site(0.1, np.zeros((3, 1)), {"side": motion}, {})
    untouched = effect.after(effect.begin(site), site._replace(dt=0.0), {"side": motion.v})
    aside = site._replace(pose=np.array([[0.0], [0.06], [0.0]]))
    assert (effect.at(untouched, aside).left == 1.0).all()  # at the first step there is no track
    ground = effect.after(untouched, site, {"side": motion.v})
    np.testing.assert_allclose(effect.at(ground, site).left, 1.0, atol=1e-12)
    left, right = effect.at(ground, aside).left
    assert right.max() < 0.1  # the track it left
    assert left.min() == 1.0


def test_the_side_where_most_was_disturbed_does_not_weaken_the_whole():
    """A track beside one half of an element takes half of that side's drag: the mean along it, not the most."""
    effect, body = DisturbedGround(radius=0.03, weakening=1.0), Chain((1, 1))
    motion = body.motion(np.zeros((1, 1)), np.ones((1, 1)))
    site = Site(0.1, np.zeros((3, 1)), {"side": motion}, {})
    ground = effect.begin(site)
    track = np.linspace(-0.5, -0.25, 40)[:, None, None] + 0.06j  # along the tail half of the tail's link, to its left
    ground.mark(track, 0.03)
    left, right = effect.at(ground, site).left[..., 0]
    assert left[0] == pytest.approx(0.5, abs=0.08)
    assert [left[1], *right] == [1, 1, 1]


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
        time_steps(GLASS, heads[0], sign * heads[1], sign * heads[2], effects=(DepthProfile(slope=0.5, towards=way),))
        for sign, way in ((1, 0.8), (-1, -0.8))
    )
    np.testing.assert_allclose(up.pose, down.pose * [1, -1, -1], atol=1e-7)


def test_a_slope_rises_where_it_says():
    """Towards pi / 2 it is deeper where y > 0, so what lies there weighs more; every buried contact at its own place."""
    body, effects = Chain((1, 1)), (EndCaps(radius=0.05), DepthProfile(slope=0.5, towards=np.pi / 2))
    model = folded(effects, GLASS, body).touching("sledge", Contact(Averages(GLASS), buried=False))
    motions = model.motions(body.motion(np.zeros((1, 1)), np.ones((1, 1))))

    def depths(effect, pose):
        deep = effect.at(None, Site(0.1, np.array(pose)[:, None], motions, {})).apply(model)
        assert deep.contacts["sledge"].factors == ()
        return [deep.contacts[name].factors[0](None, None, None)[0][:, 0] for name in ("side", "ends")]

    side, ends = depths(effects[1], (0.4, 0.1, np.pi / 2))  # standing along y, its middle at 0.1
    np.testing.assert_allclose(side, 1 + 0.5 * np.array([-0.15, 0.35]), atol=1e-15)
    np.testing.assert_allclose(ends, 1 + 0.5 * np.array([-0.4, 0.6]), atol=1e-15)
    side, _ = depths(DepthProfile(along=(1.0, 3.0), slope=0.5, towards=np.pi / 6), (1.0, 0.0, 0.0))
    np.testing.assert_allclose(side, [1.5 + 0.375 * np.cos(np.pi / 6), 2.5 + 0.625 * np.cos(np.pi / 6)], atol=1e-15)


def test_places_run_from_the_tail_to_the_head():
    body = Chain((1, 3))
    caps = EndCaps(radius=0.05, tail=4.0, head=0.0)
    model = folded((caps,), GLASS, body)
    motions = model.motions(body.motion(np.zeros((1, 1)), np.zeros((1, 1))))
    places = {name: model.contacts[name].places(motions[name]) for name in motions}
    np.testing.assert_allclose(places["side"], [1 / 8, 5 / 8], atol=1e-15)
    np.testing.assert_allclose(places["ends"], [0, 1], atol=1e-15)
    np.testing.assert_allclose(motions["ends"].place[:, 0], [-0.5, 0.5], atol=1e-15)  # on which places they are
    tail, head = motions["ends"].weight[:, 0]
    assert tail > head == 0


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
    counts = np.array([12, 24, 48, 96])
    xi = [body_velocity(Viscous(2.0), body, [0.0, 0.0], [1.0, 0.0], effects=(effect,), pieces=n).xi for n in counts]
    errors = np.abs(np.array(xi) - [0, *wanted]).max(1)  # pieces count as their centres
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(2, abs=0.05)
    assert errors[-1] < 2e-5


def test_the_first_step_of_a_march_knows_no_inertia():
    """Before it nothing is known to have moved: its moments are those that hold against the medium alone."""
    body, gait = Chain((1, 1.4, 0.8)), Circle(amplitude=0.8, centre=(0.2, -0.1))
    alpha, alphadot = gait.cycle(16)
    found = time_steps(
        GLASS, body, alpha, alphadot, effects=(BodyInertia(2.0, 0.5, 1.0, 1.0),), cycles=1, with_work=True
    )
    alone = work_done(GLASS, body, alpha, alphadot, found.xi)
    np.testing.assert_allclose(found.work.bending_moment[0], alone.bending_moment[0], atol=1e-7)
    assert np.abs(found.work.bending_moment[1:] - alone.bending_moment[1:]).max() > 0.1


def test_drift_counts_all_of_a_cycle():
    """What two cycles differ by, and as much again that is to come as long as no ratio is known."""
    body, gait = Chain((1, 1.4, 0.8)), Circle(amplitude=0.8, centre=(0.2, -0.1))
    one, two = (time_steps(GLASS, body, *gait.cycle(16), effects=(Transient(travel=0.3),), cycles=n) for n in (1, 2))
    changed = np.abs(two.displacement - one.displacement).max()
    assert changed > 1e-4
    assert two.drift == pytest.approx(2 * changed, rel=1e-6)


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-3"])
def test_a_towed_sled_by_an_independent_sum_of_forces(frame):
    """Every force on the ground, from headings and places by hand and velocities by differences, and the sled's against the
    way it goes: they and their moments add up to nothing, and the joints put in what friction takes."""
    lengths, sled = (1.0, 1.4, 0.8), TowedSled(pull=0.7, distance=0.3)
    body = Chain(lengths, length=0.4, frame=frame)
    alpha, alphadot, h = np.array([0.9, -0.4]), np.array([0.8, 0.5]), 1e-6
    xi = body_velocity(GLASS, body, alpha, alphadot, effects=(sled,)).checked().xi
    plain = body_velocity(GLASS, body, alpha, alphadot).xi
    assert np.abs(xi - plain).max() > 0.02
    share = np.array(lengths) / sum(lengths)

    def places(t):
        """The sled, then many points of every link, body lengths, and headings, with the frame moving along xi."""
        moved = alpha + t * alphadot
        heading = np.concatenate([[0], np.cumsum(moved)])
        joints = np.concatenate([[0], np.cumsum(share * np.exp(1j * heading))])
        s = (np.arange(4000) + 0.5) / 4000
        links = joints[:-1, None] + s * share[:, None] * np.exp(1j * heading)[:, None]
        counts = share if frame == "mean" else np.arange(1, 4) == int(frame[-1])
        origin, turn = (counts * (joints[1:] + joints[:-1]) / 2).sum(), (counts * heading).sum()
        onto = np.exp(1j * (t * xi[2] - turn))
        at = lambda z: (z - origin) * onto + t * (xi[0] + 1j * xi[1]) / body.length
        return at(np.array(-sled.distance)), at(links), np.exp(1j * heading) * onto

    (ahead, links_ahead, _), (before, links_before, _), (place, links, along) = places(h), places(-h), places(0.0)
    v, u = (ahead - before) / (2 * h), (links_ahead - links_before) / (2 * h) / along[:, None]
    f_t, f_n = GLASS.traction(u.real, u.imag)
    force = (f_t + 1j * f_n) * along[:, None] * share[:, None] / 4000
    pull = sled.pull * v / abs(v)
    assert abs(force.sum() + pull) < 2e-4
    assert abs((links.conj() * force).imag.sum() + (place.conj() * pull).imag) < 2e-4
    done = work_done(GLASS, body, alpha, alphadot, xi, effects=(sled,))
    assert done.bending_moment @ alphadot * body.length == pytest.approx(done.power, rel=1e-6)
    assert done.power / body.length == pytest.approx(
        (force.conj() * (u * along[:, None])).real.sum() + sled.pull * abs(v), rel=1e-4
    )


def test_a_sled_far_heavier_than_the_drag_stays_where_it_is():
    sled, rng = TowedSled(pull=1000.0), np.random.default_rng(8)
    body = Chain((1, 1.4, 0.8), frame="link-1")
    alpha, alphadot = rng.uniform(-1, 1, (10, 2)), rng.normal(size=(10, 2))
    x, y, turn = body_velocity(GLASS, body, alpha, alphadot, effects=(sled,)).checked().xi.T
    tail = -0.5 / 3.2
    assert np.abs([x, y + tail * turn]).max() < 1e-5
    assert np.abs(turn).min() > 0.01


def test_a_sled_takes_no_viscous_medium():
    with pytest.raises(
        ValueError, match="a towed sled takes a medium without viscous drag, dry as itself, got Viscous"
    ):
        body_velocity(Viscous(2.0), Chain(), [0.1, 0.2], [1.0, 0.0], effects=(TowedSled(pull=0.1),))
    for power in (0.4, 1.0):  # of a law without closed form
        with pytest.raises(
            ValueError, match="a towed sled takes a medium without viscous drag, dry as itself, got Power"
        ):
            folded([TowedSled(pull=0.1)], Power(power), Chain())
    assert "sled" in folded([TowedSled(pull=0.1)], Power(0.0), Chain()).contacts
