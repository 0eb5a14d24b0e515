"""The laws behind effects, each against a closed form, its own equation or a far finer computation."""

import dataclasses

import numpy as np
import pytest
from loads import as_array, element_load
from registry import BODIES
from scipy import integrate, optimize

from geomech import scenes
from geomech.mathematics.gaits import Circle, Sine
from rft import (
    CATALOGUE,
    Backbone,
    BodyInertia,
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
from rft.bodies.base import body_size
from rft.bodies.pieces import Pieces, subdivide
from rft.effects.base import Site
from rft.effects.contact import NO_MEMORY, assemble
from rft.effects.transient import part_velocities
from rft.formulas.link import (
    Factor,
    Incline,
    Memory,
    developed_direction,
    inclined_load,
    quadratic_load,
    scaled_load,
    two_sided_load,
)
from rft.grains.reversal import mean_direction
from rft.laws.records import record

pytestmark = pytest.mark.usefixtures("fastest")

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
    cap, psi, e = (
        EndCaps(radius=0.08, head=4.0, tail=0.0),
        np.linspace(0.01, 3.1, 20),
        4.0,
    )
    along, across = cap.traction(GLASS, np.cos(psi), np.sin(psi))
    unit = 2 * 0.08  # 2 r C_F L with C_F = L = 1
    axial = (
        e
        * np.pi
        * 0.08**2
        * GLASS.C
        * np.sin(np.arctan(np.cos(psi) / np.tan(GLASS.gamma0)))
        / unit
    )
    np.testing.assert_allclose(along, axial, rtol=1e-12)
    np.testing.assert_allclose(
        across, e * np.pi * 0.08**2 * np.sin(psi) / unit, rtol=1e-12
    )
    rounded = EndCaps(radius=0.08, head=4.0, tail=0.0, across=1.0).traction(
        GLASS, np.cos(psi), np.sin(psi)
    )
    np.testing.assert_allclose(
        rounded[0], along[0] / np.cos(psi[0]) * np.cos(psi), rtol=2e-3
    )  # as cos psi, from psi = 0
    np.testing.assert_array_equal(rounded[1], across)


def test_skin_friction_scales_the_drag_along_by_the_way_it_slides():
    """Forward over reference where an element slides towards its head, backward towards its tail; the drag across
    stays."""
    a, m, w = np.random.default_rng(6).normal(size=(3, 3, 40))
    a += 0.01 * np.sign(a)
    skin = SkinFriction(forward=0.12, backward=0.31, reference=0.25)
    factor = straight((skin,)).sides.factor
    plain = record(GLASS).average(a, m, w, 1e-3)
    found = as_array(scaled_load(plain, a, Factor(*(np.ravel(x) for x in factor))), a)
    without = as_array(plain, a)
    np.testing.assert_allclose(
        found[0], without[0] * np.where(a > 0, 0.12, 0.31) / 0.25, rtol=1e-14
    )
    np.testing.assert_array_equal(found[1:], without[1:])


def test_squared_speed_is_integrated_exactly():
    rng = np.random.default_rng(0)
    m, w = rng.normal(size=(2, 60))
    m[:10], w[10:20], w[20:30] = 0.0, 0.0, m[20:30] * rng.choice([-1.0, 1.0], 10)
    x, weight = np.polynomial.legendre.leggauss(3)
    pivot = np.clip(np.where(w == 0, -1.0, -m / np.where(w == 0, 1.0, w)), -1, 1)
    exact = np.zeros((2, 60))
    for low, high in (
        (-1.0, pivot),
        (pivot, 1.0),
    ):  # a polynomial on either side, for which three nodes are exact
        s = (low + high) / 2 + (high - low) / 2 * x[:, None]
        u = m + w * s
        part = np.array([np.abs(u) * u, s * np.abs(u) * u])
        exact += (weight[:, None] * part).sum(1) * (high - low) / 4
    squared_speed_load = lambda m, w: as_array(quadratic_load(m, w, 1.0), m)[1:]
    got = squared_speed_load(m, w)
    np.testing.assert_allclose(got[:, 0], exact, atol=1e-14)
    h = 1e-6
    np.testing.assert_allclose(
        got[:, 2],
        (squared_speed_load(m + h, w) - squared_speed_load(m - h, w))[:, 0] / (2 * h),
        atol=1e-5,
    )
    np.testing.assert_allclose(
        got[:, 3],
        (squared_speed_load(m, w + h) - squared_speed_load(m, w - h))[:, 0] / (2 * h),
        atol=1e-5,
    )


def test_sides_are_parts_of_the_whole():
    """Left and right add up to the element's load; each is that of the positive and of the negative velocities
    across."""
    rng = np.random.default_rng(2)
    a, m, w = rng.normal(size=(3, 4, 50))
    m[0], w[1] = 0.0, 0.0
    eps, load = np.full(50, 1e-3), element_load(GLASS)

    def side(share):
        return lambda a, m, w, eps: as_array(
            two_sided_load(record(GLASS), a, m, w, eps, given(share, 1 - share)), a
        )

    left, right = (side(share)(a, m, w, eps) for share in (1.0, 0.0))
    np.testing.assert_allclose((left + right)[1:], load(a, m, w, eps)[1:], atol=1e-12)
    s = (np.arange(8000) + 0.5) / 4000 - 1
    u = m + w * s[:, None, None]
    f_t, f_n = GLASS.traction(a, u, 1e-3)
    for part, where in ((left, u > 0), (right, u < 0)):
        np.testing.assert_allclose(
            part[0, 0], f_t.mean(0), atol=3e-4
        )  # along the body nothing is taken away
        for row, f in ((1, f_n), (2, s[:, None, None] * f_n)):
            np.testing.assert_allclose(part[row, 0], (f * where).mean(0), atol=3e-4)
    h, inner = 1e-6, np.abs(np.abs(m) - np.abs(w)) > 1e-3
    for column, step in ((2, (0, h, 0)), (3, (0, 0, h))):
        up, down = (
            side(1.0)(a + k * step[0], m + k * step[1], w + k * step[2], eps)
            for k in (1, -1)
        )
        slope = (up - down)[1:, 0] / (2 * h)
        np.testing.assert_allclose(
            left[1:, column][:, inner], slope[:, inner], rtol=1e-3, atol=1e-3
        )


def given(left, right):
    """A ground that leaves these shares of the drag across to either side, and develops none."""
    return NO_MEMORY._replace(intact_left=left, intact_right=right)


def test_shares_of_both_sides_multiply_the_drag_across():
    rng = np.random.default_rng(7)
    v, eps = rng.normal(size=(3, 4, 50)), np.full(50, 1e-3)
    sixth, plain = (
        as_array(two_sided_load(record(GLASS), *v, eps, given(x, x)), v[0])
        for x in (1 / 6, 1.0)
    )
    np.testing.assert_allclose(
        plain, element_load(GLASS)(*v, eps), rtol=1e-9, atol=1e-11
    )
    np.testing.assert_allclose(sixth[1:], plain[1:] / 6, atol=1e-12)
    np.testing.assert_allclose(sixth[0], plain[0], atol=1e-12)


def marched(effect, v, times, state=None):
    """Return the mean directions (2,) along and across of one element with velocities v(t) (3,), its past at rest."""
    state = np.zeros((2, 1, 1)) if state is None else state
    now = [np.reshape(v(t), (3, 1, 1)) for t in times]
    for k, dt in enumerate(np.diff(times)):
        state = effect.after(
            None, Site(1, dt, np.zeros((3, 1)), now[k]), state, now[k + 1]
        )
    return state[:, 0, 0]


def test_transients_follow_their_equation():
    """dm/dt = 3 |u| (sign(u) - m) / travel along and across by solve_ivp at 1e-10, of order 2 in the step."""
    effect, t_end = Transient(travel=0.4, ratio=0.6), 7.0
    v = lambda t: np.array(
        [np.cos(1.7 * t) - 0.2, np.sin(1.3 * t) + 0.3 * np.cos(2.1 * t), 0.0]
    )
    rates = lambda t, m: 3 * np.abs(v(t)[:2]) * (np.sign(v(t)[:2]) - m) / [0.24, 0.4]
    truth = integrate.solve_ivp(
        rates, (0, t_end), [0.0, 0.0], rtol=1e-10, atol=1e-10, max_step=0.01
    ).y[:, -1]
    counts = np.array([50, 100, 200, 400])
    errors = [
        np.abs(marched(effect, v, np.linspace(0, t_end, n + 1)) - truth) for n in counts
    ]
    assert errors[-1].max() < 1e-3
    for row in np.array(errors).T:
        assert -np.polyfit(np.log(counts), np.log(row), 1)[0] == pytest.approx(
            2, abs=0.4
        )


@pytest.mark.parametrize(
    ("angle", "travel", "at_once"), [(90, 0.3, 0.1), (0, 0.12, 0.6)]
)
def test_a_rod_to_and_fro_bears_the_drag_of_the_closed_form(angle, travel, at_once):
    """Shares after two reversals as `rft.grains.reversal` fits them to grains; little is lost after a short way back."""
    effect = Transient(travel=0.3, at_once=0.1, ratio=0.4, at_once_along=0.6)
    a, dx, row, states = 0.2, 0.01, int(angle > 0), [np.zeros((2, 1, 1))]
    u = np.where(
        (np.arange(1, 81) * dx + a - dx / 2) % (4 * a) < 2 * a, 1.0, -1.0
    )  # outward, and half a stretch more
    for sign in u:
        v = np.zeros((3, 1, 1))
        v[row] = sign
        states.append(
            effect.after(None, Site(1, dx, np.zeros((3, 1)), v), states[-1], v)
        )
    found = np.array(states)[1:, row, 0, 0] * u
    np.testing.assert_allclose(
        found, mean_direction(np.arange(1, 81) * dx - 1e-13, a, travel, 0.0), atol=1e-11
    )
    for back, dt in ((1.0, 1e-12), (-1.0, 1e-12), (1.0, 0.05), (-1.0, 0.05)):
        v = np.zeros((3, 1, 1))
        v[row] = back * u[-1]
        site = Site(
            1, dt, np.zeros((3, 1)), -0.6 * v
        )  # a load has the direction after the step
        memory = effect.apply(straight(()), site, states[-1]).memory
        load, steady = (
            two_sided_load(record(GLASS), *v, 1e-9, m) for m in (memory, NO_MEMORY)
        )
        m = u[-1] * effect.after(None, site, states[-1], v)[row, 0, 0]
        assert m == pytest.approx(found[-1]) if dt < 0.05 else abs(m - found[-1]) > 0.01
        share = as_array(load, v[0])[row, 0] / as_array(steady, v[0])[row, 0]
        assert share == pytest.approx(at_once + (1 - at_once) * (1 + back * m) / 2)


def test_slopes_of_a_load_with_memory_are_derivatives():
    """In all three velocities, of elements with and without a pivot, that move on or turn, in both directions."""
    rng = np.random.default_rng(3)
    v, directions, before = (
        rng.normal(size=(3, 4, 60)),
        rng.uniform(-1, 1, (2, 4, 60)),
        rng.normal(size=(2, 4, 60)),
    )
    numbers = rng.uniform(size=(4, 1, 60))
    memory = Memory(
        *directions,
        *before,
        *numbers[:2],
        *numbers[2:],
        np.full((1, 1), 0.9),
        np.full((1, 1), 0.4),
    )
    load = lambda v: as_array(
        two_sided_load(record(GLASS), *v, np.full(60, 0.1), memory), v[0]
    )
    found, h = load(v), 1e-6
    assert (np.abs(v[1]) > np.abs(v[2])).any() and (np.abs(v[1]) < np.abs(v[2])).any()
    for k in range(3):
        step = np.zeros((3, 1, 1))
        step[k] = h
        np.testing.assert_allclose(
            found[:, k + 1],
            (load(v + step) - load(v - step))[:, 0] / (2 * h),
            atol=1e-6,
        )


def test_directions_develop_by_the_way():
    rng = np.random.default_rng(3)
    direction, before, now = rng.uniform(-1, 1, (5, 40)), *rng.normal(size=(2, 5, 40))
    now = 0.01 + np.abs(now)
    values, slopes = developed_direction(direction, before, now, 0.6)
    assert (np.abs(values) <= 1).all()
    assert (
        slopes >= 0
    ).all()  # the faster to a side, the more of the drag to that side
    paused = developed_direction(direction, np.abs(before), 0 * now, 0.6)[
        0
    ]  # it went on for a while before it stopped
    np.testing.assert_allclose(
        paused, 1 - (1 - direction) * np.exp(-0.3 * np.abs(before)), rtol=1e-12
    )
    still = developed_direction(direction, before, now, np.inf)
    assert (still[0] == 1).all()
    assert (still[1] == 0).all()


def test_parts_of_elements_are_means_of_their_velocities():
    rng = np.random.default_rng(6)
    m, w = rng.normal(size=(2, 60))
    m[0], w[1], w[2] = 0.0, 0.0, -m[2]
    velocity, left = part_velocities(m, w)
    u = m + w * ((np.arange(200_000)[:, None] + 0.5) / 100_000 - 1)
    np.testing.assert_allclose(left, (u > 0).mean(0), atol=1e-5)
    for side, share, found in (
        (u > 0, left, velocity[0]),
        (u < 0, 1 - left, velocity[1]),
    ):
        np.testing.assert_allclose(share * found, (u * side).mean(0), atol=1e-5)


def test_a_piece_that_turns_remembers_both_of_its_sides():
    """About its middle for a long way: each half has built up its own side, so that the piece has none."""
    effect, still = Transient(travel=0.01), np.zeros((3, 2, 1))
    v = np.array(
        [[[0.0], [0.0]], [[0.0], [0.5]], [[1.0], [1.0]]]
    )  # the second has its pivot at a quarter of its length
    memory = effect.after(
        None, Site(1, 1.0, np.zeros((3, 1)), still), np.ones((2, 2, 1)), v
    )[1, :, 0]
    np.testing.assert_allclose(memory, [0.0, 0.5], atol=1e-12)


def straight(effects, body=None, rate=1.0, medium=GLASS):
    """The balance of a straight body."""
    body = body or Chain((1, 1))
    return assemble(medium, body, effects, pieces=40).problem(
        np.zeros((body.joints, 1)), np.full((body.joints, 1), rate)
    )


def test_ground_remembers_where_the_body_was():
    effect = DisturbedGround(radius=0.05, weakening=1.0)
    fresh = effect.begin(None, Site(0, 0.0, np.zeros((3, 2)), ()))
    ground = effect.with_track(fresh, np.array([[0.3 + 0.2j, 0.0]]))
    at = lambda *places: effect.disturbance(ground, np.array(places))
    # A whole disturbance on the axis, nothing far off, and nothing in the other sample's ground.
    assert at(0.3 + 0.2j, 0.3 + 0.2j) == pytest.approx([1, 0], abs=0.05)
    assert at(0.3 + 0.32j, 5.0) == pytest.approx([0, 0], abs=1e-12)
    assert at(0.3 + 0.25j, 0.05) == pytest.approx([0.5, 0.5], abs=0.1)
    # A patch that wraps round onto the same cells is untouched ground, and taking it over forgets the old.
    assert at(0.3 + 0.2j + 4, 0.0) == pytest.approx([0, 1], abs=0.05)
    ground = effect.with_track(ground, np.array([[4.3 + 0.2j, 0.0]]))
    assert at(0.3 + 0.2j, 0.0) == pytest.approx([0, 1], abs=0.05)
    assert all(
        (x == 0).all() for x in fresh.value
    )  # a step leaves the state it came from as it was
    assert (
        sum(x is not y for x, y in zip(fresh.value, ground.value)) < 10
    )  # and copies what it marks alone


def shares(effect, problem, site, ground):
    """What an effect leaves of the drag across, to the left and to the right, (2, n, B)."""
    memory = effect.apply(problem, site, ground).memory
    return np.stack([memory.intact_left, memory.intact_right])


def test_a_body_that_finds_fresh_ground_is_not_weakened():
    """The first steps of a straight-ahead chain: its own track lies behind and under it, not at its sides."""
    effect = DisturbedGround(radius=0.03, weakening=1.0)
    problem = straight((), subdivide(Chain((1, 1, 1)), 40))
    site = Site(1, 0.1, np.zeros((3, 1)), ())
    untouched = effect.after(
        problem, site._replace(count=0), effect.begin(problem, site), ()
    )
    aside = site._replace(pose=np.array([[0.0], [0.06], [0.0]]))
    assert (
        shares(effect, problem, aside, untouched) == 1.0
    ).all()  # at the first step there is no track
    ground = effect.after(problem, site, untouched, ())
    np.testing.assert_allclose(shares(effect, problem, site, ground), 1.0, atol=1e-12)
    left, right = shares(effect, problem, aside, ground)
    assert right.max() < 0.1  # the track it left
    assert left.min() == 1.0


def test_the_side_where_most_was_disturbed_does_not_weaken_the_whole():
    """A track beside one half of an element takes half of that side's drag: the mean along it, not the most."""
    effect, problem = DisturbedGround(radius=0.03, weakening=1.0), straight(())
    site = Site(1, 0.1, np.zeros((3, 1)), ())
    track = (
        np.linspace(-0.5, -0.25, 40)[:, None, None] + 0.06j
    )  # along the tail half of the tail's link, to its left
    ground = effect.with_track(effect.begin(problem, site), track)
    left, right = shares(effect, problem, site, ground)[..., 0]
    assert left[0] == pytest.approx(0.5, abs=0.08)
    assert [left[1], *right] == [1, 1, 1]


def test_a_parameter_that_all_samples_share_is_that_of_some():
    shared = SkinFriction().with_parameters(
        forward=np.array([0.2]), backward=np.array([0.1, 0.3, 0.5])
    )
    some = shared.take([2, 0])
    assert (some.forward.tolist(), some.backward.tolist()) == ([0.2], [0.5, 0.1])


def test_the_track_has_no_gaps_along_the_longest_element():
    """Points are half a radius apart at most, in the middles of equal parts."""
    effect, problem = (
        DisturbedGround(radius=0.03, weakening=1.0),
        straight((), Chain((1, 10))),
    )
    at = effect.points(problem, Site(1, 0.1, np.zeros((3, 1)), ()))[:, :, 0]
    half = problem.sides.elements.half[:, 0]
    assert np.abs(np.diff(at, axis=0)).max() <= 0.03 / 2
    np.testing.assert_allclose(np.abs(at[-1] - at[0]), 2 * half * (1 - 1 / len(at)))


@pytest.mark.parametrize("name", BODIES)
def test_pieces_move_as_the_body(name):
    """Cutting elements changes no force and no moment."""
    body, rng = BODIES[name], np.random.default_rng(4)
    alpha, alphadot = (
        rng.uniform(-1, 1, (20, body.joints)),
        rng.normal(size=(20, body.joints)),
    )
    whole = body_velocity(GLASS, body, alpha, alphadot, tolerance=1e-12)
    pieces = body_velocity(GLASS, Pieces(body, 0.03), alpha, alphadot, tolerance=1e-12)
    np.testing.assert_allclose(pieces.xi, whole.xi, atol=1e-7)


def test_depth_along_the_body():
    """Uniform depth changes nothing, whatever it is. A rising ground to the left mirrors one to the right."""
    body, rng = Chain((1, 1, 1)), np.random.default_rng(5)
    alpha, alphadot = rng.uniform(-1, 1, (20, 2)), rng.normal(size=(20, 2))
    plain = body_velocity(GLASS, body, alpha, alphadot).xi
    for depths in ((3.0, 3.0), (0.5, 0.5, 0.5)):
        level = body_velocity(
            GLASS, body, alpha, alphadot, effects=(DepthProfile(along=depths),)
        ).xi
        np.testing.assert_allclose(level, plain, atol=1e-8)
    heads = Backbone(20), *Sine(elements=20).cycle(32)
    up, down = (
        time_steps(
            GLASS,
            heads[0],
            sign * heads[1],
            sign * heads[2],
            effects=(DepthProfile(slope=0.5, towards=way),),
        )
        for sign, way in ((1, 0.8), (-1, -0.8))
    )
    np.testing.assert_allclose(up.pose, down.pose * [1, -1, -1], atol=1e-7)


def test_a_slope_rises_where_it_says():
    """Towards pi / 2 it is deeper where y > 0, so what lies there weighs more; every buried contact at its own
    place."""
    problem = straight((EndCaps(radius=0.05), TowedSled(pull=2.0)))

    def depths(effect, pose):
        deep = effect.apply(problem, Site(1, 0.1, np.array(pose)[:, None], ()), None)
        assert deep.points.factor.across[2, 0] == 2.0  # the sled lies on the surface
        return [contact.factor.across[:2, 0] for contact in (deep.sides, deep.points)]

    along_y = DepthProfile(slope=0.5, towards=np.pi / 2)
    side, ends = depths(
        along_y, (0.4, 0.1, np.pi / 2)
    )  # standing along y, its middle at 0.1
    np.testing.assert_allclose(side, 1 + 0.5 * np.array([-0.15, 0.35]), atol=1e-15)
    np.testing.assert_allclose(ends, 1 + 0.5 * np.array([-0.4, 0.6]), atol=1e-15)
    side, _ = depths(
        DepthProfile(along=(1.0, 3.0), slope=0.5, towards=np.pi / 6), (1.0, 0.0, 0.0)
    )
    np.testing.assert_allclose(
        side,
        [1.5 + 0.375 * np.cos(np.pi / 6), 2.5 + 0.625 * np.cos(np.pi / 6)],
        atol=1e-15,
    )


def test_a_slope_weakens_what_moves_downhill():
    """Half the drag straight downhill at 20 degrees (Sec. IV B), none more uphill; the weight pulls downhill, and does no
    work on the ground."""
    unit, speed = np.exp(1j * 0.7), 0.3
    for heading in (0.0, 2.0):
        v = (
            speed * -unit * np.exp(-1j * heading)
        )  # straight downhill, in the element's frame
        body, down = Chain((1.0, 1.0), frame="link-1"), -unit * np.exp(-1j * heading)
        site = Site(0, 0.0, np.array([[0.0], [0.0], [heading]]), ())
        level = assemble(GLASS, body).problem(np.zeros((1, 1)), np.ones((1, 1)))
        problem = Slope(np.radians(20.0), towards=0.7, weight=0.4).apply(level, site)
        incline = problem.sides.incline
        np.testing.assert_allclose(
            [incline.down_t[0, 0], incline.down_n[0, 0]],
            [down.real, down.imag],
            atol=1e-15,
        )
        for sign, share in ((1, 0.5), (-1, np.cos(np.radians(20.0)))):
            load = record(GLASS).average(sign * v.real, sign * v.imag, 0.0, 0.0)
            row = Incline(*(x[0, 0] for x in incline))
            found = inclined_load(load, (sign * v.real, sign * v.imag), 0.0, row)
            pull = 0.4 * np.sin(np.radians(20.0)) * problem.axial_drag
            expected = (
                share * load.t - pull * down.real,
                share * load.n - pull * down.imag,
                share * load.w,
            )
            np.testing.assert_allclose(
                (found.t, found.n, found.w), expected, atol=1e-12
            )


def test_a_slope_has_the_slopes_of_its_load():
    rng = np.random.default_rng(3)
    law, row = record(GLASS), Incline(0.6, -0.8, 0.9, 0.5, 0.3)

    def load(v):
        return inclined_load(law.average(*v, 1e-2), v, 1e-2, row)

    for v in rng.normal(size=(20, 3)):
        found = load(v)
        for k, column in enumerate(
            (("t_t", "n_t", "w_t"), ("t_n", "n_n", "w_n"), ("t_w", "n_w", "w_w"))
        ):
            h = 1e-6 * np.eye(3)[k]
            wanted = [
                (getattr(load(v + h), x) - getattr(load(v - h), x)) / 2e-6
                for x in "tnw"
            ]
            np.testing.assert_allclose(
                [getattr(found, x) for x in column], wanted, atol=2e-7
            )


def test_a_body_on_a_slope_against_an_integral_over_points():
    """Every point of the body by its own velocity, by SciPy; pieces count as their centres."""
    body, effect = (
        Chain((1, 1.4, 0.8)),
        Slope(0.35, towards=2.0, repose=0.6, weight=0.3),
    )
    alpha, alphadot = np.array([0.6, -0.4]), np.array([0.8, 1.1])
    s, weights = (2 * np.arange(20_000) + 1) / 20_000 - 1, np.full(20_000, 1 / 20_000)
    e = body.motion(alpha[:, None], alphadot[:, None])

    def net(xi):
        force = np.zeros(3)
        for c, sn, r_t, r_n, half, _, v_t, v_n, v_w in zip(*(x[:, 0] for x in e)):
            u_t = v_t + c * xi[0] + sn * xi[1] + r_t * xi[2] + 0 * s
            u_n = v_n + c * xi[1] - sn * xi[0] + r_n * xi[2] + s * (v_w + half * xi[2])
            down = -np.exp(2.0j) * (c - 1j * sn)
            d = np.maximum(down.real * u_t + down.imag * u_n, 0.0) / np.hypot(u_t, u_n)
            share = np.cos(0.35) - d * np.sin(0.35) / np.tan(0.6)
            f_t, f_n = (share * f for f in GLASS.traction(u_t, u_n))
            f_t, f_n = (
                f_t - 0.3 * np.sin(0.35) * down.real,
                f_n - 0.3 * np.sin(0.35) * down.imag,
            )
            t, n, w = (2 * half * np.sum(weights * f) for f in (f_t, f_n, s * f_n))
            force += [c * t - sn * n, sn * t + c * n, r_t * t + r_n * n + half * w]
        return force

    exact = optimize.root(net, np.zeros(3), method="hybr", tol=1e-10)
    assert exact.success
    cycle = np.stack([alpha] * 8), np.stack([alphadot] * 8)
    at = lambda n: time_steps(
        GLASS, body, *cycle, effects=(effect,), pieces=n, cycles=1
    ).xi[0]
    errors = [np.abs(at(n) - exact.x).max() for n in (40, 320, 2560)]
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
    with pytest.raises(ValueError, match="takes a medium of grains, got Viscous"):
        assemble(Viscous(), Chain(), (Slope(0.1),))


def test_gravity_does_no_work_on_the_ground():
    """Joints and gravity together do what the ground takes up."""
    body, (alpha, alphadot) = (
        Chain((1, 1.4, 0.8)),
        Circle(amplitude=0.8, centre=(0.2, -0.1)).cycle(256),
    )
    effect = Slope(0.3, towards=1.0, weight=0.3)
    found = time_steps(
        GLASS, body, alpha, alphadot, effects=(effect,), cycles=1, with_work=True
    )
    joints = np.sum(found.work.bending_moment * alphadot, -1).sum()
    middle = np.array([mean_place(body, alpha[k], found.pose[k]) for k in range(256)])
    fall = -np.diff(middle, axis=0) @ [np.cos(1.0), np.sin(1.0)]
    gravity = 0.3 * np.sin(0.3) * fall.sum() / (2 * np.pi / 256)
    assert found.work.power.sum() == pytest.approx(joints + gravity, rel=2e-3)
    assert abs(gravity) > 0.01 * joints


def mean_place(body, alpha, pose):
    ends = body.points(alpha, pose)
    return body.fractions @ (ends[1:] + ends[:-1]) / 2


def test_places_run_from_the_tail_to_the_head():
    problem = straight((EndCaps(radius=0.05, tail=4.0, head=0.0),), Chain((1, 3)))
    np.testing.assert_allclose(problem.sides.station[:, 0], [1 / 8, 5 / 8], atol=1e-15)
    np.testing.assert_allclose(problem.points.station[:, 0], [0, 1], atol=1e-15)
    np.testing.assert_allclose(
        problem.points.elements.centres[:, 0], [-0.5, 0.5], atol=1e-15
    )
    tail, head = problem.points.elements.weight[:, 0]
    assert tail > head == 0


def test_depth_along_a_straight_chain_in_closed_form():
    """In a viscous medium, straight, the tail's link turning: two linear equations for drift and turn."""
    depth = lambda x: 1.5 + x
    nodes, weights = np.polynomial.legendre.leggauss(40)
    own, drift = 0.0, np.zeros((2, 2))
    for low, high, rate in ((-1 / 2, -1 / 6, -1.0), (-1 / 6, 1 / 2, 0.0)):
        x = (low + high) / 2 + (high - low) / 2 * nodes
        f = weights * (high - low) / 2 * depth(x)
        own = own + np.array(
            [np.sum(f * rate * (x + 1 / 6)), np.sum(f * x * rate * (x + 1 / 6))]
        )
        drift += [[np.sum(f), np.sum(f * x)], [np.sum(f * x), np.sum(f * x * x)]]
    wanted = np.linalg.solve(drift, -own)
    effect, body = DepthProfile(along=(1.0, 2.0)), Chain((1, 1, 1), frame="link-2")
    counts = np.array([12, 24, 48, 96])
    xi = [
        body_velocity(
            Viscous(2.0), body, [0.0, 0.0], [1.0, 0.0], effects=(effect,), pieces=n
        ).xi
        for n in counts
    ]
    errors = np.abs(np.array(xi) - [0, *wanted]).max(1)  # pieces count as their centres
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(
        2, abs=0.05
    )
    assert errors[-1] < 2e-5


def test_the_first_step_of_a_march_knows_no_inertia():
    """Before it nothing is known to have moved: its moments are those that hold against the medium alone."""
    body, gait = Chain((1, 1.4, 0.8)), Circle(amplitude=0.8, centre=(0.2, -0.1))
    alpha, alphadot = gait.cycle(16)
    found = time_steps(
        GLASS,
        body,
        alpha,
        alphadot,
        effects=(BodyInertia(2.0, 0.5, 1.0, 1.0),),
        cycles=1,
        with_work=True,
    )
    alone = work_done(GLASS, body, alpha, alphadot, found.xi)
    np.testing.assert_allclose(
        found.work.bending_moment[0], alone.bending_moment[0], atol=1e-7
    )
    assert np.abs(found.work.bending_moment[1:] - alone.bending_moment[1:]).max() > 0.1


def test_drift_counts_all_of_a_cycle():
    """What two cycles differ by, and as much again that is to come as long as no ratio is known."""
    body, gait = Chain((1, 1.4, 0.8)), Circle(amplitude=0.8, centre=(0.2, -0.1))
    one, two = (
        time_steps(
            GLASS, body, *gait.cycle(16), effects=(Transient(travel=0.3),), cycles=n
        )
        for n in (1, 2)
    )
    changed = np.abs(two.displacement - one.displacement).max()
    assert changed > 1e-4
    assert two.drift == pytest.approx(2 * changed, rel=1e-6)


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-3"])
def test_a_towed_sled_by_an_independent_sum_of_forces(frame):
    """Every force on the ground, from headings and places by hand and velocities by differences, and the sled's against
    the way it goes: they and their moments add up to nothing, and the joints put in what friction takes."""
    lengths, sled = (1.0, 1.4, 0.8), TowedSled(pull=0.7, distance=0.3)
    body = Chain(lengths, length=0.4, frame=frame)
    alpha, alphadot, h = np.array([0.9, -0.4]), np.array([0.8, 0.5]), 1e-6
    effects = (sled.in_metres(0.4),)
    xi = body_velocity(GLASS, body, alpha, alphadot, effects=effects).checked().xi
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
        origin, turn = (
            (counts * (joints[1:] + joints[:-1]) / 2).sum(),
            (counts * heading).sum(),
        )
        onto = np.exp(1j * (t * xi[2] - turn))
        at = lambda z: (z - origin) * onto + t * (xi[0] + 1j * xi[1]) / body_size(body)
        return at(np.array(-sled.distance)), at(links), np.exp(1j * heading) * onto

    (ahead, links_ahead, _), (before, links_before, _), (place, links, along) = (
        places(h),
        places(-h),
        places(0.0),
    )
    v, u = (
        (ahead - before) / (2 * h),
        (links_ahead - links_before) / (2 * h) / along[:, None],
    )
    f_t, f_n = GLASS.traction(u.real, u.imag)
    force = (f_t + 1j * f_n) * along[:, None] * share[:, None] / 4000
    pull = sled.pull * v / abs(v)
    assert abs(force.sum() + pull) < 2e-4
    assert abs((links.conj() * force).imag.sum() + (place.conj() * pull).imag) < 2e-4
    done = work_done(GLASS, body, alpha, alphadot, xi, effects=effects)
    assert done.bending_moment @ alphadot * body_size(body) == pytest.approx(
        done.power, rel=1e-6
    )
    assert done.power / body_size(body) == pytest.approx(
        (force.conj() * (u * along[:, None])).real.sum() + sled.pull * abs(v), rel=1e-4
    )


def test_a_sled_far_heavier_than_the_drag_stays_where_it_is():
    sled, rng = TowedSled(pull=1000.0), np.random.default_rng(8)
    body = Chain((1, 1.4, 0.8), frame="link-1")
    alpha, alphadot = rng.uniform(-1, 1, (10, 2)), rng.normal(size=(10, 2))
    x, y, turn = (
        body_velocity(GLASS, body, alpha, alphadot, effects=(sled,)).checked().xi.T
    )
    tail = -0.5 / 3.2
    assert np.abs([x, y + tail * turn]).max() < 1e-5
    assert np.abs(turn).min() > 0.01


def test_a_sled_takes_no_viscous_medium():
    with pytest.raises(
        ValueError,
        match="a towed sled takes a medium without viscous drag, dry as itself, got Viscous",
    ):
        body_velocity(
            Viscous(2.0),
            Chain(),
            [0.1, 0.2],
            [1.0, 0.0],
            effects=(TowedSled(pull=0.1),),
        )
    for power in (0.4, 1.0):  # of a law without closed form
        with pytest.raises(
            ValueError,
            match="a towed sled takes a medium without viscous drag, dry as itself, got Power",
        ):
            assemble(Power(power), Chain(), [TowedSled(pull=0.1)])
    assert assemble(Power(0.0), Chain(), [TowedSled(pull=0.1)]).n_elements == 4
