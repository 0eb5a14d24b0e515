"""The laws behind effects, each against a closed form, its own equation or a far finer
computation."""

import numpy as np
import pytest
from by_hand import drag, middles, points
from loads import as_array
from registry import BODIES
from scipy import integrate, optimize

from rft import (
    CATALOGUE,
    Chain,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    SkinFriction,
    Slope,
    TowedSled,
    Transient,
    body_velocity,
    time_steps,
    work_done,
)
from rft.bodies.pieces import subdivide
from rft.core.refusal import Refusal
from rft.effects.base import Site
from rft.effects.contact import NO_MEMORY, assemble
from rft.formulas.link import Factor, quadratic_load, scaled_load, two_sided_load
from rft.grains.reversal import mean_direction
from rft.laws.records import record

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
UNEVEN = Chain((1, 1.4, 0.8))


def straight(effects, body=None):
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
    s = 2 * middles(8000)[:, None, None] - 1
    u = v[1] + v[2] * s
    f_t, f_n = GLASS.traction(v[0], u, 1e-3)
    for part, side in ((left, u > 0), (right, u < 0)):
        expected = [x.mean(0) for x in (f_t, f_n * side, s * f_n * side)]
        np.testing.assert_allclose(part[:, 0], expected, atol=3e-4)


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
    errors = []
    for n in (100, 400):
        velocities = v(np.linspace(0, t_end, n + 1)).T
        directions = after_steps(effect, velocities[:-1], velocities[1:], t_end / n)
        errors.append(np.abs(directions[-1] - truth))
    assert errors[1].max() < 1e-3
    assert np.log(errors[0] / errors[1]) / np.log(4) == pytest.approx([2, 2], abs=0.4)


@pytest.mark.parametrize(
    ("row", "travel", "at_once"),
    [(1, 0.3, 0.1), (0, 0.12, 0.6)],
    ids=["across", "along"],
)
def test_a_rod_to_and_fro_bears_the_drag_of_the_closed_form(row, travel, at_once):
    """Shares after two reversals as `rft.grains.reversal` fits them to grains; a share
    is there at once."""
    effect = Transient(travel=0.3, at_once=0.1, ratio=0.4, at_once_along=0.6)
    a, dx = 0.2, 0.01
    way = np.arange(1, 81) * dx
    u = np.where((way + a - dx / 2) % (4 * a) < 2 * a, 1.0, -1.0)
    v = np.eye(2)[row] * u[:, None]
    directions = after_steps(effect, v, v, dx)
    expected = mean_direction(way - 1e-13, a, travel, 0.0)
    np.testing.assert_allclose(directions[1:, row] * u, expected, atol=1e-11)
    for back in (1.0, -1.0):
        v = np.zeros((3, 1, 1))
        v[row] = back * u[-1]
        site = Site(1, 0.05, np.zeros((3, 1)), v)
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
    # On the axis, and not in the other sample's ground; far off; half a radius aside;
    # on the same cells a whole map further.
    for places, disturbed in (
        ((0.3 + 0.2j, 0.3 + 0.2j), [1, 0]),
        ((0.3 + 0.32j, 5.0), [0, 0]),
        ((0.3 + 0.25j, 0.05), [0.5, 0.5]),
        ((0.3 + 0.2j + 4, 0.0), [0, 1]),
    ):
        found = effect.disturbance(ground, np.array(places))
        assert found == pytest.approx(disturbed, abs=0.1), places


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
    ground = effect.after(problem, at_place, untouched, ())
    own = shares(effect, problem, at_place, ground)
    np.testing.assert_allclose(own, 1.0, atol=1e-12)
    left, right = shares(effect, problem, aside, ground)
    assert right.max() < 0.1  # the track it left
    assert left.min() == 1.0


@pytest.mark.parametrize("name", BODIES)
def test_cutting_elements_changes_no_force_and_no_moment(name):
    body, rng = BODIES[name], np.random.default_rng(4)
    alpha = rng.uniform(-1, 1, (20, body.joints))
    alphadot = rng.normal(size=(20, body.joints))
    whole, pieces = (
        body_velocity(GLASS, x, alpha, alphadot, tolerance=1e-12).xi
        for x in (body, subdivide(body, 33))
    )
    np.testing.assert_allclose(pieces, whole, atol=1e-7)


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
    found = time_steps(*problem, effects=(effect,), pieces=2560, cycles=1)
    np.testing.assert_allclose(found.xi[0], exact, atol=1e-5)


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
    friction = (force.conj() * velocity).real.sum() + sled.pull * abs(v)
    assert work.bending_moment @ shapes[1] == pytest.approx(friction, rel=1e-4)


def test_a_body_on_a_slope_is_refused_from_the_weight_at_which_it_slides():
    """The drag downhill is sin(repose - angle) / sin(repose) of the level one."""
    angle, repose = np.radians([20, 30])
    heaviest = np.sin(repose - angle) / np.sin(repose) / np.sin(angle)
    Slope(angle=angle, repose=repose, weight=0.99 * heaviest)
    with pytest.raises(Refusal):
        Slope(angle=angle, repose=repose, weight=1.01 * heaviest)
