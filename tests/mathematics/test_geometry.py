"""Connection, curvature, frames and the three tiers, on swimmers with a closed form."""

import dataclasses

import numpy as np
import pytest
import sympy as sp
from registry import GAITS, MEDIA
from scipy.special import ndtri
from scipy.stats import qmc

from geomech.mathematics import symbolic
from geomech.mathematics.gaits import Circle, Ellipse, Fourier
from geomech.mathematics.geometry import connection, coordinates, curvature, reconstruct
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.tiers.area import area
from geomech.mathematics.tiers.direct import direct
from geomech.mathematics.tiers.path import path
from geomech.scenes import load
from rft import Chain, Serpenoid, Viscous, body_velocity
from rft.formulas import se2

A_MIDDLE, ALPHA = symbolic.viscous_chain((1, 1, 1), 2, "link-2")
MIDDLE = symbolic.velocity(A_MIDDLE, ALPHA)


def viscous(frame="mean", ratio=2.0):
    return lambda a, d: (
        body_velocity(Viscous(ratio), Chain(frame=frame), a, d).checked().xi
    )


def around(centre, reach, points=41):
    return tuple(np.linspace(c - reach, c + reach, points) for c in centre)


def test_fit_recovers_a_linear_swimmer():
    fitted = connection.fit(MIDDLE, connection.grid(2, 41, 2.0), 8, degree=5)
    assert fitted.residual.max() < 1e-15
    shapes = np.random.default_rng(0).uniform(-1.8, 1.8, (50, 2))
    exact = np.stack([MIDDLE(shapes, e) for e in np.eye(2)], -1)
    np.testing.assert_allclose(fitted(shapes), exact, atol=2e-6)


@pytest.mark.parametrize("joints", [1, 3])
def test_fit_takes_any_number_of_joints(joints):
    rng = np.random.default_rng(1)
    M = rng.normal(size=(3, joints))
    swimmer = lambda a, d: (
        np.einsum("ij,...j->...i", M, np.broadcast_arrays(a, d)[1]) * np.cos(a[..., :1])
    )
    fitted = connection.fit(swimmer, connection.grid(joints, 9, 1.0), 16)
    assert fitted.A.shape == (3, joints, *(9,) * joints)
    np.testing.assert_allclose(fitted(np.zeros(joints)), M, atol=1e-12)


@pytest.mark.parametrize(("joints", "count"), [(1, 1), (2, 7), (3, 13), (5, 40)])
def test_directions_are_unit_vectors_that_span(joints, count):
    unit = connection.directions(joints, count)
    np.testing.assert_allclose(np.linalg.norm(unit, axis=-1), 1, atol=1e-15)
    assert unit.shape == (count, joints)
    assert np.linalg.svd(unit)[1].min() > 0.5


@pytest.mark.parametrize("points", [6, 7])
def test_half_the_grid_tells_the_other_half(points):
    asked = []

    def glass(a, d):
        asked.append(len(a))
        return (
            body_velocity(MEDIA["glass-0.3mm-loose"], Chain((1, 2, 3)), a, d)
            .checked()
            .xi
        )

    fit = lambda traits: connection.fit(
        glass, connection.grid(2, points), traits=traits, trusted=True
    )
    whole, half = fit(Traits()), fit(Traits(mirror=True))
    for name in ("A", "residual", "speed"):
        np.testing.assert_allclose(getattr(half, name), getattr(whole, name), atol=1e-7)
    assert asked[1] == (asked[0] + 1) // 2


def test_fit_residual_is_the_rms_misfit():
    swimmer = lambda a, d: (
        np.stack([d[..., 0] ** 3, d[..., 0], 0 * d[..., 0]], -1) + 0 * a[..., :1]
    )
    fitted = connection.fit(swimmer, connection.grid(2, 5, 1.0), 16, trusted=True)
    # cos^3 = (3 cos + cos 3)/4: the plane keeps 3/4 cos, the misfit is cos 3t / 4, rms sqrt(1/32).
    np.testing.assert_allclose(fitted.A[0, 0], 0.75, atol=1e-14)
    np.testing.assert_allclose(fitted.residual[0], np.sqrt(1 / 32), atol=1e-14)
    np.testing.assert_allclose(fitted.residual[1], 0, atol=1e-14)
    np.testing.assert_allclose(
        fitted.speed[:, 2, 3], np.sqrt([5 / 16, 1 / 2, 0]), atol=1e-14
    )


def test_scattered_directions_are_always_the_same_and_all_round():
    unit = connection.directions(3, 200)
    np.testing.assert_array_equal(connection.directions(3, 200), unit)
    np.testing.assert_array_equal(connection.directions(3, 50), unit[:50])
    normal = ndtri(qmc.Halton(3, scramble=False).random(201)[1:])
    np.testing.assert_array_equal(
        unit, normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    )
    np.testing.assert_allclose(unit.T @ unit / 200, np.eye(3) / 3, atol=0.02)
    np.testing.assert_allclose(unit.mean(0), 0, atol=0.02)


@pytest.mark.parametrize(("low", "high"), [(-1.0, 3.0), (0.5, 0.9)])
def test_angles_may_leave_the_grid_by_rounding_only(low, high):
    field = Field((np.linspace(low, high, 9),), np.linspace(0, 1, 9))
    slack = 1e-9 * (high - low)
    assert field([[low - 0.99 * slack], [high + 0.99 * slack]]) == pytest.approx(
        [0, 1], abs=1e-8
    )
    for out in (low - 1.01 * slack, high + 1.01 * slack):
        with pytest.raises(ValueError, match="lies outside the field's"):
            field([out])


def test_values_off_the_grid_are_refused():
    axes = connection.grid(2, 5)
    with pytest.raises(
        ValueError, match=r"values \(3, 5, 4\) do not end in the grid's shape \(5, 5\)"
    ):
        Field(axes, np.zeros((3, 5, 4)))
    with pytest.raises(
        ValueError, match="degree 5 needs more than that many grid points"
    ):
        Field(axes, np.zeros((3, 5, 5)), 5)


def test_ccf_at_the_straight_pose_for_any_ratio():
    r = sp.symbols("r", positive=True)
    A, (a, b) = symbolic.viscous_chain(ratio=r)
    here, dA_1, dA_2 = (
        A.subs({a: 0, b: 0}),
        A[:, 0].subs(a, 0).diff(b),
        A[:, 1].subs(b, 0).diff(a),
    )
    straight = (
        dA_2.subs(a, 0) - dA_1.subs(b, 0) + symbolic.bracket(here[:, 0], here[:, 1])
    )
    assert sp.simplify(straight[0] + 5 * (r - 1) / 243) == 0
    assert sp.simplify(straight[1]) == 0
    fitted = connection.fit(viscous("link-2", 7.5), around((0, 0), 0.3), degree=5)
    assert curvature.ccf(fitted).values[0, 20, 20] == pytest.approx(
        -5 * 6.5 / 243, abs=1e-9
    )


def test_ccf_agrees_with_sympy_everywhere():
    fitted = connection.fit(MIDDLE, connection.grid(2, 37, 1.2), degree=5)
    exact = sp.lambdify(
        ALPHA, list(symbolic.ccf(symbolic.simplified(A_MIDDLE, ALPHA), ALPHA)), "numpy"
    )
    a1, a2 = np.meshgrid(*fitted.axes, indexing="ij")
    np.testing.assert_allclose(
        curvature.ccf(fitted).values, np.broadcast_arrays(*exact(a1, a2)), atol=2e-6
    )


@pytest.mark.parametrize(("i", "j"), [(0, 1), (0, 2), (1, 2), (2, 1), (2, 0), (1, 0)])
def test_small_loops_follow_the_ccf_of_their_joints(i, j):
    """Every component, about a bent shape of four unlike links, in the plane of every two joints and either way round."""
    body, centre = (
        Chain((1, 1.6, 0.7, 1.2), length=0.6, frame="link-2"),
        np.array([0.5, -0.8, 0.3]),
    )
    solve = lambda a, d: body_velocity(Viscous(3.0), body, a, d).xi
    fitted = connection.fit(solve, around(centre, 0.1, 7), 16, degree=5)
    density = curvature.ccf(fitted, i, j).values[:, 3, 3, 3]
    waves = np.zeros((2, 3, 1))
    waves[0, i], waves[1, j] = 1.0, 0.7
    size = 1e-3
    loop = Fourier(amplitude=size, centre=tuple(centre), cos=waves[0], sin=waves[1])
    moved = direct(solve, loop, phases=64)
    # From the loop's start, a displacement of order 1 in its size away from where the density is taken.
    start = fitted(centre)[:, i] * size
    moved = se2.compose(se2.compose(se2.exp(start), moved), se2.inverse(se2.exp(start)))
    np.testing.assert_allclose(
        moved / (0.7 * np.pi * size**2), density, atol=2e-4 * np.abs(density).max()
    )
    assert np.abs(density).min() > 1e-4


def test_small_circles_follow_the_ccf():
    """|displacement| -> 5 (r - 1) / 243 times the area."""
    for ratio in (2.0, 4.0):
        g = direct(viscous("link-2", ratio), Circle(), [0.01, 0.001])
        limit = 5 * (ratio - 1) / 243 * np.pi * np.array([0.01, 0.001]) ** 2
        np.testing.assert_allclose(np.hypot(g[:, 0], g[:, 1]), limit, rtol=2e-4)


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-2", "link-3"])
def test_unit_circle_in_every_frame(frame):
    g = direct(viscous(frame), Circle())
    assert np.hypot(g[0], g[1]) == pytest.approx(0.0512808243, abs=5e-11)
    fitted = connection.fit(viscous(frame), connection.grid(2, 61, 1.2), degree=5)
    looked_up = path(fitted, Circle())
    assert np.hypot(looked_up[0], looked_up[1]) == pytest.approx(0.0512808243, abs=1e-8)


def slope(x, y):
    return np.polyfit(np.log(x), np.log(y), 1)[0]


@pytest.mark.parametrize(
    ("centre", "frame", "order"),
    [((0.5, -0.8), "link-1", 3.0), ((0.9, 0.4), "mean", 3.0)],
)
def test_area_tier_is_of_order_three_in_a_generic_frame(centre, frame, order):
    fitted = connection.fit(viscous(frame), around(centre, 0.35, 61), degree=5)
    ccf = curvature.ccf(fitted)
    sizes = np.geomspace(0.01, 0.05, 7)
    gait = Ellipse(centre=centre, semi_axes=(1.0, 0.7), tilt=0.3)
    error = np.linalg.norm(
        area(ccf, gait, sizes) - path(viscous(frame), gait, sizes), axis=-1
    )
    assert slope(sizes, error) == pytest.approx(order, abs=0.1)
    wrong = Field(
        fitted.axes,
        curvature.exterior_derivative(fitted) - curvature.lie_bracket(fitted),
        5,
    )
    error = np.linalg.norm(
        area(wrong, gait, sizes) - path(viscous(frame), gait, sizes), axis=-1
    )
    assert slope(sizes, error) == pytest.approx(
        2.0, abs=0.1
    )  # the test can tell the bracket's sign


def test_area_counts_winding_numbers():
    """A figure-eight cancels, a circle run twice counts twice, a reversed gait counts against."""
    ones = np.ones((3, 31, 31)) * np.array([0.01, 0.0, 0.0])[:, None, None]
    ccf = Field(connection.grid(2, 31, 2.5), ones)
    circle = area(ccf, Circle())
    assert circle[0] == pytest.approx(0.01 * np.pi, rel=1e-12)
    eight = Fourier(cos=((0.0, 0.0), (0.0, 0.0)), sin=((1.0, 0.0), (0.0, 1.0)))
    twice = Fourier(cos=((0.0, 1.0), (0.0, 0.0)), sin=((0.0, 0.0), (0.0, 1.0)))
    assert area(ccf, eight)[0] == pytest.approx(0.0, abs=1e-15)
    assert area(ccf, twice)[0] == pytest.approx(2 * circle[0], rel=1e-12)
    assert area(ccf, Circle(reverse=True))[0] == pytest.approx(-circle[0], rel=1e-12)


def test_leaving_the_field_is_an_error_that_names_the_angle():
    fitted = connection.fit(MIDDLE, connection.grid(2, 11, 1.0))
    for tier in (
        lambda: path(fitted, Circle(amplitude=1.3)),
        lambda: area(curvature.ccf(fitted), Circle(), 1.3),
    ):
        with pytest.raises(
            ValueError, match=r"alpha_1 = .*1\.3 rad lies outside the field's -1 to 1"
        ):
            tier()
    for sign, joint in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        edge = np.array([0.3, 0.3])
        edge[joint] = sign * (1 + 1e-12)  # rounding
        assert np.isfinite(fitted(edge)).all()
        edge[joint] = sign * (1 + 1e-5)
        with pytest.raises(ValueError, match=f"alpha_{joint + 1} = .*lies outside"):
            fitted(edge)


@pytest.mark.parametrize("medium", ["viscous-2", "glass-0.3mm-loose"])
@pytest.mark.parametrize(
    "mean", [Chain((1, 2, 1), length=0.4), Serpenoid(elements=9, length=0.4, waves=0.8)]
)
def test_changing_frame_is_solving_in_that_frame(medium, mean):
    """Links' headings and rates, through the modes of a backbone too."""
    rng = np.random.default_rng(2)
    alpha, alphadot = rng.uniform(-2, 2, (30, 2)), rng.normal(size=(30, 2))
    solve = lambda body, a, d: body_velocity(MEDIA[medium], body, a, d).xi
    for frame in ("link-1", "link-2", "link-3"):
        other = dataclasses.replace(mean, frame=frame)
        carried = coordinates.in_frame(
            lambda a, d: solve(mean, a, d), lambda a, d: mean.frame_pose(frame, a, d)
        )
        np.testing.assert_allclose(
            carried(alpha, alphadot), solve(other, alpha, alphadot), atol=1e-8
        )


def test_connections_change_frame_like_velocities():
    body, alpha = Chain((1, 2, 1)), np.array([0.4, -1.1])
    A = np.stack([viscous()(alpha, e) for e in np.eye(2)], -1)
    poses = [Chain().frame_pose("link-3", alpha, e) for e in np.eye(2)]
    changed = coordinates.change_connection(
        A, poses[0][0], np.stack([p[1] for p in poses], -1)
    )
    np.testing.assert_allclose(
        changed,
        np.stack([viscous("link-3")(alpha, e) for e in np.eye(2)], -1),
        atol=1e-12,
    )
    assert body.frame_pose("mean", alpha, alpha)[0] == pytest.approx(0.0)


def test_connections_at_many_shapes_change_frame_one_by_one():
    rng = np.random.default_rng(6)
    A, h, dh = (
        rng.normal(size=(4, 5, 3, 2)),
        rng.normal(size=(4, 5, 3)),
        rng.normal(size=(4, 5, 3, 2)),
    )
    changed = coordinates.change_connection(A, h, dh)
    for at in np.ndindex(4, 5):
        np.testing.assert_allclose(
            changed[at], coordinates.change_connection(A[at], h[at], dh[at]), rtol=1e-14
        )
    assert coordinates.frame_velocity(
        [9.0, 7.0, np.pi / 2], [1.0, 2.0, 3.0]
    ) == pytest.approx([2.0, -1.0, 3.0])


@pytest.mark.parametrize("name", GAITS)
def test_displacement_is_conjugated_by_the_frame(name):
    gait = GAITS[name]
    mean, link = (direct(viscous(f), gait, phases=1024) for f in ("mean", "link-3"))
    h = Chain().frame_pose("link-3", gait.shape(0.0), gait.rate(0.0))[0]
    np.testing.assert_allclose(
        se2.compose(se2.compose(se2.inverse(h), mean), h), link, atol=1e-9
    )


@pytest.mark.parametrize("name", GAITS)
def test_a_reversed_gait_undoes_the_gait(name):
    forth = GAITS[name]
    back = dataclasses.replace(forth, reverse=not forth.reverse)
    g, h = (direct(viscous(), x) for x in (forth, back))
    np.testing.assert_allclose(se2.compose(g, h), 0, atol=1e-12)


def stepwise(velocity, gait, steps, end=2 * np.pi):
    """Displacement from phase 0 to ``end`` by many short exponentials, midpoint rule: order 2."""
    g = np.zeros(3)
    for t in (np.arange(steps) + 0.5) / steps * end:
        g = se2.compose(g, se2.exp(velocity(gait.shape(t), gait.rate(t)) * end / steps))
    return g


def test_spectral_integration_against_short_steps():
    gait = Ellipse(centre=(0.3, 0.6), semi_axes=(1.1, 0.5))
    spectral = direct(MIDDLE, gait)
    coarse, fine = (stepwise(MIDDLE, gait, n) for n in (400, 800))
    np.testing.assert_allclose(spectral, (4 * fine - coarse) / 3, atol=1e-9)


def test_trajectory_ends_where_the_displacement_says():
    gait = Circle(centre=(0.5, 0.2))
    steps = (
        stepwise(MIDDLE, gait, 800, end=np.pi),
        stepwise(MIDDLE, gait, 400, end=np.pi),
    )
    for phases in (50, 51, 200):
        xi = MIDDLE(*gait.cycle(phases))
        path = reconstruct.trajectory(xi, [0.0, np.pi, 2 * np.pi])
        np.testing.assert_allclose(path[0], 0, atol=1e-15)
        np.testing.assert_allclose(path[1], (4 * steps[0] - steps[1]) / 3, atol=1e-9)
        np.testing.assert_allclose(path[2], reconstruct.displacement(xi), atol=1e-13)


@pytest.mark.parametrize("phases", [8, 9])
def test_a_trajectory_has_the_velocity_it_was_made_from(phases):
    """At every phase of any samples, the highest wave of an even number of them included."""
    xi, h = np.random.default_rng(5).normal(size=(2, phases, 3)), 1e-5
    t = 2 * np.pi * np.arange(phases) / phases
    before, at, after = (reconstruct.trajectory(xi, t + k * h) for k in (-1, 0, 1))
    rate = (after - before) / (2 * h)
    x, y = se2.rotated(-at[..., 2], rate[..., 0], rate[..., 1])
    np.testing.assert_allclose(np.stack([x, y, rate[..., 2]], -1), xi, atol=1e-8)
    theta = at[..., 2] - t * xi[..., 2].mean(1)[:, None]
    np.testing.assert_allclose(
        reconstruct.turning(xi), theta - theta.mean(1)[:, None], atol=1e-13
    )


def test_full_turns_are_integrated_too():
    """A constant turn: circles in closed form, whole turns included."""
    for turn in (0.0, 0.3, 1.0, 2.0, -1.5):
        xi = np.broadcast_to([0.2, -0.1, turn], (8, 3))
        np.testing.assert_allclose(
            reconstruct.displacement(xi), se2.exp(2 * np.pi * xi[0]), atol=1e-14
        )


def test_bad_shapes_are_refused():
    with pytest.raises(ValueError, match=r"got \(2, 3\)"):
        reconstruct.displacement(np.zeros((2, 3)))
    with pytest.raises(ValueError, match="grid must"):
        connection.grid(2, 3)
    with pytest.raises(ValueError, match="extent must"):
        connection.grid(2, 9, float("nan"))
    with pytest.raises(ValueError, match="directions must"):
        connection.directions(3, 8)
    with pytest.raises(ValueError, match="ascending"):
        connection.fit(MIDDLE, ([0.0, 0.0, 1.0, 2.0, 3.0],) * 2)
    with pytest.raises(ValueError, match=r"must return shape \(.*, 3\).*got .*1\)"):
        connection.fit(lambda a, d: MIDDLE(a, d)[..., :1], connection.grid(2, 5))
    with pytest.raises(ValueError, match="not finite at alpha"):
        direct(lambda a, d: MIDDLE(a, d) * np.nan, Circle())
    with pytest.raises(ValueError, match="amplitudes must be finite"):
        direct(MIDDLE, Circle(), [np.nan])
    with pytest.raises(ValueError, match="xi must be finite"):
        reconstruct.displacement(np.full((4, 3), np.inf))
    with pytest.raises(ValueError, match="two joints"):
        curvature.ccf(
            connection.fit(
                lambda a, d: np.zeros((*np.broadcast_shapes(a.shape, d.shape)[:-1], 3)),
                (np.linspace(0, 1, 9),),
            )
        )


@pytest.mark.parametrize("name", ["three-link-glass", "three-link-coulomb"])
@pytest.mark.parametrize("count", [8, 16])
def test_a_connection_knows_the_error_of_its_directions(name, count):
    """Against 64 directions, as rms of each row."""
    velocity, axes = load(name).system.velocity, connection.grid(2, 9)
    few, many = (connection.fit(velocity, axes, n) for n in (count, 64))
    off, error = (
        np.sqrt((x**2).mean((1, 2, 3))) for x in (few.A - many.A, few.direction_error)
    )
    assert (off < error).all()
    assert (error < 5 * off).all()
