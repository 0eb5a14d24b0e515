"""The laws behind effects, each against a closed form, its own equation or a far finer
computation."""

import dataclasses

import numpy as np
import pytest
from by_hand import drag, middles, points
from loads import as_array, element_load
from registry import BODIES
from scipy import integrate, optimize

from geomech.mathematics.gaits import Circle, Sine
from rft import (
    CATALOGUE,
    Backbone,
    Chain,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    SkinFriction,
    Slope,
    TowedSled,
    Transient,
    Viscous,
    body_velocity,
    time_steps,
    work_done,
)
from rft.bodies.pieces import Pieces, subdivide
from rft.effects.base import Site
from rft.effects.contact import NO_MEMORY, assemble
from rft.formulas.link import Factor, quadratic_load, scaled_load, two_sided_load
from rft.grains.reversal import mean_direction
from rft.laws.records import record

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
UNEVEN = Chain((1, 1.4, 0.8))


def straight(effects, body=None):
    """The balance of a straight body."""
    body = body or Chain((1, 1))
    assembly = assemble(GLASS, body, effects, pieces=40)
    return assembly.problem(np.zeros((body.joints, 1)), np.ones((body.joints, 1)))


def site_at(x, y, theta):
    return Site(1, 0.1, np.array([[x], [y], [theta]]), ())


def test_end_caps_are_the_written_formula():
    radius, e = 0.08, 4.0
    psi = np.linspace(0.01, 3.1, 20)
    v = np.cos(psi), np.sin(psi)
    area = e * np.pi * radius**2 / (2 * radius)  # over 2 r C_F L with C_F = L = 1
    along, across = EndCaps(radius=radius, head=e, tail=0.0).traction(GLASS, *v)
    sine = np.sin(np.arctan(np.cos(psi) / np.tan(GLASS.gamma0)))
    np.testing.assert_allclose(along, area * GLASS.C * sine, rtol=1e-12)
    np.testing.assert_allclose(across, area * np.sin(psi), rtol=1e-12)
    flat = EndCaps(radius=radius, head=e, tail=0.0, across=1.0)
    expected = along[0] / v[0][0] * np.cos(psi)
    np.testing.assert_allclose(flat.traction(GLASS, *v)[0], expected, rtol=2e-3)


def test_skin_friction_scales_the_drag_along_by_the_way_it_slides():
    """Forward over reference where an element slides towards its head, backward towards
    its tail; the drag across stays."""
    a, m, w = np.random.default_rng(6).normal(size=(3, 3, 40))
    skin = SkinFriction(forward=0.12, backward=0.31, reference=0.25)
    factor = Factor(*(np.ravel(x) for x in straight((skin,)).sides.factor))
    plain = record(GLASS).average(a, m, w, 1e-3)
    found, without = as_array(scaled_load(plain, a, factor), a), as_array(plain, a)
    along = without[0] * np.where(a > 0, 0.12, 0.31) / 0.25
    np.testing.assert_allclose(found[0], along, rtol=1e-14)
    np.testing.assert_array_equal(found[1:], without[1:])


def test_squared_speed_is_integrated_exactly():
    """A polynomial on either side of the pivot, for which three nodes are exact."""
    rng = np.random.default_rng(0)
    m, w = rng.normal(size=(2, 60))
    m[:10], w[10:20], w[20:30] = 0.0, 0.0, -m[20:30]
    pivot = np.clip(-m / np.where(w == 0, 1e-9, w), -1, 1)
    x, weight = np.polynomial.legendre.leggauss(3)
    exact = np.zeros((2, 60))
    for low, high in ((-1.0, pivot), (pivot, 1.0)):
        s = (low + high) / 2 + (high - low) / 2 * x[:, None]
        f = np.abs(m + w * s) * (m + w * s) * weight[:, None] * (high - low) / 4
        exact += np.array([f.sum(0), (s * f).sum(0)])
    load = quadratic_load(m, w, 1.0)
    np.testing.assert_allclose([load.n, load.w], exact, atol=1e-14)


def with_shares(left, right):
    """Load of elements on ground that leaves these shares of the drag across to either
    side."""
    memory = NO_MEMORY._replace(intact_left=left, intact_right=right)

    def load(a, m, w, eps):
        return as_array(two_sided_load(record(GLASS), a, m, w, eps, memory), a)

    return load


def test_sides_are_parts_of_the_whole():
    """Left and right are the drag across of positive and of negative velocities; along
    the body nothing is taken away."""
    rng = np.random.default_rng(2)
    v = rng.normal(size=(3, 4, 50))
    v[1, 0], v[2, 1] = 0.0, 0.0
    eps = np.full(50, 1e-3)
    left, right = with_shares(1, 0)(*v, eps), with_shares(0, 1)(*v, eps)
    whole = element_load(GLASS)(*v, eps)
    np.testing.assert_allclose((left + right)[1:], whole[1:], atol=1e-12)
    s = 2 * middles(8000)[:, None, None] - 1
    u = v[1] + v[2] * s
    f_t, f_n = GLASS.traction(v[0], u, 1e-3)
    for part, side in ((left, u > 0), (right, u < 0)):
        expected = [x.mean(0) for x in (f_t, f_n * side, s * f_n * side)]
        np.testing.assert_allclose(part[:, 0], expected, atol=3e-4)
    third = with_shares(1 / 3, 1 / 3)(*v, eps)
    np.testing.assert_allclose(third[1:], whole[1:] / 3, atol=1e-11)


def after_steps(effect, before, now, dt):
    """Mean directions along and across of one element (steps + 1, 2), its past at rest,
    from its velocities (steps, 2) at the beginning and end of each step."""
    states = [np.zeros((2, 1, 1))]
    for steps in zip(before, now):
        v, after = (np.reshape([*x, 0.0], (3, 1, 1)) for x in steps)
        site = Site(1, dt, np.zeros((3, 1)), v)
        states.append(effect.after(None, site, states[-1], after))
    return np.array(states)[..., 0, 0]


def test_transients_follow_their_equation():
    """dm/dt = 3 |u| (sign(u) - m) / travel along and across by solve_ivp at 1e-10, of
    order 2 in the step."""
    effect, t_end = Transient(travel=0.4, ratio=0.6), 7.0

    def v(t):
        return np.array(
            [np.cos(1.7 * t) - 0.2, np.sin(1.3 * t) + 0.3 * np.cos(2.1 * t)]
        )

    def rates(t, m):
        return 3 * np.abs(v(t)) * (np.sign(v(t)) - m) / [0.24, 0.4]

    options = {"rtol": 1e-10, "atol": 1e-10, "max_step": 0.01}
    truth = integrate.solve_ivp(rates, (0, t_end), [0.0, 0.0], **options).y[:, -1]
    counts = np.array([50, 100, 200, 400])
    errors = []
    for n in counts:
        velocities = v(np.linspace(0, t_end, n + 1)).T
        directions = after_steps(effect, velocities[:-1], velocities[1:], t_end / n)
        errors.append(np.abs(directions[-1] - truth))
    assert errors[-1].max() < 1e-3
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order == pytest.approx([2, 2], abs=0.4)


@pytest.mark.parametrize(
    ("row", "travel", "at_once"),
    [(1, 0.3, 0.1), (0, 0.12, 0.6)],
    ids=["across", "along"],
)
def test_a_rod_to_and_fro_bears_the_drag_of_the_closed_form(row, travel, at_once):
    """Shares after two reversals as `rft.grains.reversal` fits them to grains; little
    is lost after a short way back."""
    effect = Transient(travel=0.3, at_once=0.1, ratio=0.4, at_once_along=0.6)
    a, dx = 0.2, 0.01
    way = np.arange(1, 81) * dx
    u = np.where((way + a - dx / 2) % (4 * a) < 2 * a, 1.0, -1.0)
    v = np.eye(2)[row] * u[:, None]
    directions = after_steps(effect, v, v, dx)
    expected = mean_direction(way - 1e-13, a, travel, 0.0)
    np.testing.assert_allclose(directions[1:, row] * u, expected, atol=1e-11)
    for back, dt in ((1.0, 1e-12), (-1.0, 1e-12), (1.0, 0.05), (-1.0, 0.05)):
        v = np.zeros((3, 1, 1))
        v[row] = back * u[-1]
        site = Site(1, dt, np.zeros((3, 1)), v)
        state = directions[-1][:, None, None]
        memory = effect.apply(straight(()), site, state).memory
        load, steady = (
            as_array(two_sided_load(record(GLASS), *v, 1e-9, m), v[0])[row, 0]
            for m in (memory, NO_MEMORY)
        )
        # A load has the direction after the step.
        m = (u[-1] * effect.after(None, site, state, v)[row]).item()
        share = at_once + (1 - at_once) * (1 + back * m) / 2
        assert (load / steady).item() == pytest.approx(share)


def test_ground_remembers_where_the_body_was():
    effect = DisturbedGround(radius=0.05, weakening=1.0)
    fresh = effect.begin(None, Site(0, 0.0, np.zeros((3, 2)), ()))
    ground = effect.with_track(fresh, np.array([[0.3 + 0.2j, 0.0]]))
    later = effect.with_track(ground, np.array([[4.3 + 0.2j, 0.0]]))
    # On the axis, and not in the other sample's ground; far off; half a radius aside;
    # on
    # the same cells a whole map further; a patch that another one has taken over.
    for state, places, disturbed in (
        (ground, (0.3 + 0.2j, 0.3 + 0.2j), [1, 0]),
        (ground, (0.3 + 0.32j, 5.0), [0, 0]),
        (ground, (0.3 + 0.25j, 0.05), [0.5, 0.5]),
        (ground, (0.3 + 0.2j + 4, 0.0), [0, 1]),
        (later, (0.3 + 0.2j, 0.0), [0, 1]),
    ):
        found = effect.disturbance(state, np.array(places))
        assert found == pytest.approx(disturbed, abs=0.1), places
    assert all((x == 0).all() for x in fresh.value)


def shares(effect, problem, site, ground):
    """What an effect leaves of the drag across, to the left and to the right, (2, n,
    B)."""
    memory = effect.apply(problem, site, ground).memory
    return np.stack([memory.intact_left, memory.intact_right])


def test_a_body_that_finds_fresh_ground_is_not_weakened():
    """The first steps of a straight-ahead chain: its own track lies behind and under
    it, not at its sides."""
    effect = DisturbedGround(radius=0.03, weakening=1.0)
    problem = straight((), subdivide(Chain((1, 1, 1)), 40))
    at_place, aside = site_at(0.0, 0.0, 0.0), site_at(0.0, 0.06, 0.0)
    start = effect.begin(problem, at_place)
    untouched = effect.after(problem, at_place._replace(count=0), start, ())
    assert (shares(effect, problem, aside, untouched) == 1.0).all()
    ground = effect.after(problem, at_place, untouched, ())
    own = shares(effect, problem, at_place, ground)
    np.testing.assert_allclose(own, 1.0, atol=1e-12)
    left, right = shares(effect, problem, aside, ground)
    assert right.max() < 0.1  # the track it left
    assert left.min() == 1.0


def test_a_track_beside_half_an_element_takes_half_of_that_sides_drag():
    """The mean along it, not the most."""
    effect, problem = DisturbedGround(radius=0.03, weakening=1.0), straight(())
    site = site_at(0.0, 0.0, 0.0)
    track = np.linspace(-0.5, -0.25, 40)[:, None, None] + 0.06j
    ground = effect.with_track(effect.begin(problem, site), track)
    left, right = shares(effect, problem, site, ground)[..., 0]
    assert [*left, *right] == pytest.approx([0.5, 1, 1, 1], abs=0.08)


@pytest.mark.parametrize("name", BODIES)
def test_cutting_elements_changes_no_force_and_no_moment(name):
    body, rng = BODIES[name], np.random.default_rng(4)
    alpha = rng.uniform(-1, 1, (20, body.joints))
    alphadot = rng.normal(size=(20, body.joints))
    whole, pieces = (
        body_velocity(GLASS, x, alpha, alphadot, tolerance=1e-12).xi
        for x in (body, Pieces(body, 0.03))
    )
    np.testing.assert_allclose(pieces, whole, atol=1e-7)


def test_ground_that_rises_to_the_left_mirrors_one_to_the_right():
    alpha, alphadot = Sine(elements=20).cycle(32)
    left, right = (
        time_steps(
            GLASS,
            Backbone(20),
            sign * alpha,
            sign * alphadot,
            effects=(DepthProfile(slope=0.5, towards=0.8 * sign),),
        )
        for sign in (1, -1)
    )
    np.testing.assert_allclose(left.pose, right.pose * [1, -1, -1], atol=1e-7)


C30 = np.cos(np.pi / 6)


@pytest.mark.parametrize(
    ("effect", "pose", "side", "ends"),
    [
        (
            DepthProfile(slope=0.5, towards=np.pi / 2),
            (0.4, 0.1, np.pi / 2),  # standing along y, its middle at 0.1
            (1 + 0.5 * -0.15, 1 + 0.5 * 0.35),
            (1 + 0.5 * -0.4, 1 + 0.5 * 0.6),
        ),
        (
            DepthProfile(along=(1.0, 3.0), slope=0.5, towards=np.pi / 6),
            (1.0, 0.0, 0.0),
            (1.5 + 0.375 * C30, 2.5 + 0.625 * C30),
            (1.0 + 0.25 * C30, 3.0 + 0.75 * C30),
        ),
    ],
)
def test_a_slope_of_depth_rises_where_it_says(effect, pose, side, ends):
    """Every buried contact at its own place; a sled lies on the surface."""
    problem = straight((EndCaps(radius=0.05), TowedSled(pull=2.0)))
    deep = effect.apply(problem, site_at(*pose), None)
    np.testing.assert_allclose(deep.sides.factor.across[:, 0], side, atol=1e-15)
    np.testing.assert_allclose(
        deep.points.factor.across[:, 0], [*ends, 2.0], atol=1e-15
    )


def test_a_body_on_a_slope_against_an_integral_over_points():
    """Every point of the body by its own velocity, by SciPy; pieces count as their
    centres."""
    effect = Slope(0.35, towards=2.0, repose=0.6, weight=0.3)
    shapes, down = (np.array([0.6, -0.4]), np.array([0.8, 1.1])), -np.exp(2.0j)

    def net(xi):
        place, velocity, along = points(UNEVEN, *shapes, xi, middles(8000))
        downhill = np.maximum((velocity / down).real, 0.0) / np.abs(velocity)
        share = np.cos(0.35) - downhill * np.sin(0.35) / np.tan(0.6)
        force = share * drag(GLASS, velocity, along) - 0.3 * np.sin(0.35) * down
        force = force * UNEVEN.fractions[:, None] / 8000
        moment = (place.conj() * force).imag.sum()
        return [force.real.sum(), force.imag.sum(), moment]

    exact = optimize.root(net, np.zeros(3), method="hybr", tol=1e-10).x
    problem = GLASS, UNEVEN, *([x] * 8 for x in shapes)
    errors = []
    for n in (40, 320, 2560):
        found = time_steps(*problem, effects=(effect,), pieces=n, cycles=1)
        errors.append(np.abs(found.xi[0] - exact).max())
    assert errors[2] < 1e-5
    assert errors[1] < errors[0] / 5
    assert errors[2] < errors[1] / 5


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"angle": 0.7}, "below the angle of repose, 37.9 degrees"),
        ({"angle": 0.3, "weight": 4.0}, "slides down"),
        ({"angle": -0.1}, "angle must be a number from 0"),
    ],
)
def test_slopes_that_slide_by_themselves_are_refused(wrong, says):
    with pytest.raises(ValueError, match=says):
        Slope(**wrong)


def test_joints_and_gravity_together_do_what_the_ground_takes_up():
    alpha, alphadot = Circle(amplitude=0.8, centre=(0.2, -0.1)).cycle(256)
    options = {"effects": (Slope(0.3, towards=1.0, weight=0.3),), "cycles": 1}
    found = time_steps(GLASS, UNEVEN, alpha, alphadot, with_work=True, **options)
    joints = np.sum(found.work.bending_moment * alphadot)
    middles = []
    for shape, pose in zip(alpha, found.pose):
        ends = UNEVEN.points(shape, pose)
        middles.append(UNEVEN.fractions @ (ends[1:] + ends[:-1]) / 2)
    fall = (middles[0] - middles[-1]) @ [np.cos(1.0), np.sin(1.0)]
    gravity = 0.3 * np.sin(0.3) * fall / (2 * np.pi / 256)
    assert found.work.power.sum() == pytest.approx(joints + gravity, rel=2e-3)
    assert abs(gravity) > 0.01 * joints


def test_depth_along_a_straight_chain_in_closed_form():
    """In a viscous medium, straight, the tail's link turning: two linear equations for
    drift and turn. Pieces count as their centres."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    own, drift = np.zeros(2), np.zeros((2, 2))
    for low, high, rate in ((-1 / 2, -1 / 6, -1.0), (-1 / 6, 1 / 2, 0.0)):
        x = (low + high) / 2 + (high - low) / 2 * nodes
        f = weights * (high - low) / 2 * (1.5 + x)
        own += rate * np.array([f @ (x + 1 / 6), (f * x) @ (x + 1 / 6)])
        drift += [[f.sum(), f @ x], [f @ x, f @ x**2]]
    wanted = [0, *np.linalg.solve(drift, -own)]
    problem = Viscous(2.0), Chain(frame="link-2"), [0.0, 0.0], [1.0, 0.0]
    depth = (DepthProfile(along=(1.0, 2.0)),)
    counts = np.array([12, 24, 48, 96])
    xi = [body_velocity(*problem, effects=depth, pieces=n).xi for n in counts]
    errors = np.abs(np.array(xi) - wanted).max(1)
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order == pytest.approx(2, abs=0.05)
    assert errors[-1] < 2e-5


def test_a_towed_sled_by_an_independent_sum_of_forces():
    """Every force on the ground, and the sled's against the way it goes: they and their
    moments add up to nothing, and the joints put in what friction takes."""
    sled, body = TowedSled(pull=0.7, distance=0.3), Chain(UNEVEN.lengths, length=0.4)
    shapes = np.array([0.9, -0.4]), np.array([0.8, 0.5])
    towing = {"effects": (sled.in_metres(0.4),)}
    xi = body_velocity(GLASS, body, *shapes, **towing).checked().xi
    speed = xi / [0.4, 0.4, 1.0]
    place, velocity, along = points(body, *shapes, speed, middles(4000))
    force = drag(GLASS, velocity, along) * body.fractions[:, None] / 4000
    behind = np.array([-sled.distance / body.fractions[0]])
    at, v = (x[0, 0] for x in points(body, *shapes, speed, behind)[:2])
    pull = sled.pull * v / abs(v)
    assert abs(force.sum() + pull) < 2e-4
    assert abs((place.conj() * force).imag.sum() + (at.conj() * pull).imag) < 2e-4
    work = work_done(GLASS, body, *shapes, xi, **towing)
    by_joints = work.bending_moment @ shapes[1]
    assert by_joints == pytest.approx(work.power / 0.4, rel=1e-6)
    friction = (force.conj() * velocity).real.sum() + sled.pull * abs(v)
    assert by_joints == pytest.approx(friction, rel=1e-4)


@dataclasses.dataclass(frozen=True)
class Power:
    """Drag that grows with a power of the speed, three times as much across."""

    power: float

    def traction(self, v_t, v_n, eps=0.0):
        drag = (np.sqrt(v_t**2 + v_n**2 + eps**2) + 1e-300) ** (self.power - 1)
        return drag * v_t, 3.0 * drag * v_n


@pytest.mark.parametrize(
    ("effect", "medium", "said"),
    [
        (TowedSled(pull=0.1), Power(0.4), "a towed sled takes a medium .* dry as its"),
        (TowedSled(pull=0.1), Power(1.0), "a towed sled takes a medium .* dry as its"),
        (Slope(0.1), Viscous(), "takes a medium of grains, got Viscous"),
    ],
)
def test_media_that_an_effect_does_not_take_are_refused(effect, medium, said):
    with pytest.raises(ValueError, match=said):
        assemble(medium, Chain(), [effect])
    assert assemble(Power(0.0), Chain(), [TowedSled(pull=0.1)]).n_elements == 4
