"""Connection, curvature, frames and the three tiers, on swimmers with a closed form."""

import dataclasses

import numpy as np
import pytest
import sympy as sp
from registry import MEDIA

from geomech.mathematics import symbolic
from geomech.mathematics.gaits import Circle, Ellipse, Fourier
from geomech.mathematics.geometry import connection, coordinates, curvature, reconstruct
from geomech.mathematics.geometry.representations.field import Field
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


def test_fit_residual_is_the_rms_misfit():
    """cos^3 = (3 cos + cos 3) / 4: the plane keeps 3/4 cos, and the misfit is
    cos 3t / 4, of rms sqrt(1/32)."""

    def swimmer(alpha, rate):
        first = rate[..., 0] + 0 * alpha[..., 0]
        return np.stack([first**3, first, 0 * first], -1)

    fitted = connection.fit(swimmer, connection.grid(2, 5, 1.0), 16, trusted=True)
    np.testing.assert_allclose(fitted.A[0, 0], 0.75, atol=1e-14)
    residual = [np.sqrt(1 / 32), 0, 0]
    np.testing.assert_allclose(fitted.residual[:, 2, 3], residual, atol=1e-14)


@pytest.mark.parametrize(("low", "high"), [(-1.0, 3.0), (0.5, 0.9)])
def test_angles_may_leave_the_grid_by_rounding_only(low, high):
    field = Field((np.linspace(low, high, 9),), np.linspace(0, 1, 9))
    slack = 1e-9 * (high - low)
    assert field([high + 0.99 * slack]) == pytest.approx(1, abs=1e-8)
    with pytest.raises(ValueError, match="alpha_1 = .* lies outside the field"):
        field([low - 1.01 * slack])


def test_ccf_agrees_with_sympy_everywhere():
    fitted = connection.fit(MIDDLE, connection.grid(2, 37, 1.2), degree=5)
    formula = symbolic.ccf(symbolic.simplified(A_MIDDLE, ALPHA), ALPHA)
    exact = sp.lambdify(ALPHA, list(formula), "numpy")
    expected = np.broadcast_arrays(*exact(*np.meshgrid(*fitted.axes, indexing="ij")))
    np.testing.assert_allclose(curvature.ccf(fitted).values, expected, atol=2e-6)


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-2", "link-3"])
def test_unit_circle_in_every_frame(frame):
    distance = np.hypot(*direct(viscous(frame), Circle())[:2])
    assert distance == pytest.approx(0.0512808243, abs=5e-11)
    fitted = connection.fit(viscous(frame), connection.grid(2, 61, 1.2), degree=5)
    looked_up = np.hypot(*path(fitted, Circle())[:2])
    assert looked_up == pytest.approx(0.0512808243, abs=1e-8)


@pytest.mark.parametrize(
    ("centre", "frame"), [((0.5, -0.8), "link-1"), ((0.9, 0.4), "mean")]
)
@pytest.mark.parametrize(("sign", "order"), [(1, 3.0), (-1, 2.0)])
def test_the_area_with_its_bracket_is_of_order_three(centre, frame, sign, order):
    """In a generic frame; with the bracket's other sign it is of order two."""
    fitted = connection.fit(viscous(frame), around(centre, 0.35, 61), degree=5)
    bracket = curvature.lie_bracket(fitted)
    values = curvature.exterior_derivative(fitted) + sign * bracket
    sizes = np.geomspace(0.01, 0.05, 7)
    gait = Ellipse(centre=centre, semi_axes=(1.0, 0.7), tilt=0.3)
    true = path(viscous(frame), gait, sizes)
    found = area(Field(fitted.axes, values, 5), gait, sizes)
    error = np.linalg.norm(found - true, axis=-1)
    slope = np.polyfit(np.log(sizes), np.log(error), 1)[0]
    assert slope == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize(
    ("gait", "winding"),
    [
        (Circle(), 1),
        (Circle(reverse=True), -1),
        (Fourier(cos=((0, 0), (0, 0)), sin=((1, 0), (0, 1))), 0),  # a figure-eight
        (Fourier(cos=((0, 1), (0, 0)), sin=((0, 0), (0, 1))), 2),  # run twice
    ],
)
def test_area_counts_winding_numbers(gait, winding):
    values = np.zeros((3, 31, 31))
    values[0] = 0.01
    found = area(Field(connection.grid(2, 31, 2.5), values), gait)
    assert found[0] == pytest.approx(0.01 * np.pi * winding, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("frame", ["link-1", "link-2", "link-3"])
@pytest.mark.parametrize("medium", ["viscous-2", "glass-0.3mm-loose"])
@pytest.mark.parametrize(
    "mean", [Chain((1, 2, 1), length=0.4), Serpenoid(elements=9, length=0.4, waves=0.8)]
)
def test_changing_frame_is_solving_in_that_frame(medium, mean, frame):
    rng = np.random.default_rng(2)
    alpha = rng.uniform(-2, 2, (30, 2))
    alphadot = rng.normal(size=(30, 2))
    other = dataclasses.replace(mean, frame=frame)
    here, there = (
        body_velocity(MEDIA[medium], body, alpha, alphadot).xi for body in (mean, other)
    )
    h, hdot = mean.frame_pose(frame, alpha, alphadot)
    carried = coordinates.change_velocity(here, h, hdot)
    np.testing.assert_allclose(carried, there, atol=1e-8)
    velocity = coordinates.in_frame(lambda *_: here, lambda *_: (h, hdot))
    np.testing.assert_array_equal(velocity(alpha, alphadot), carried)


@pytest.mark.parametrize("phases", [8, 9])
def test_a_trajectory_has_the_velocity_it_was_made_from(phases):
    """At every phase of any samples, the highest wave of an even number of them
    included; and it ends at the displacement."""
    xi = np.random.default_rng(5).normal(size=(2, phases, 3))
    h = 1e-5
    t = 2 * np.pi * np.arange(phases) / phases
    before, at, after = (reconstruct.trajectory(xi, t + k * h) for k in (-1, 0, 1))
    rate = (after - before) / (2 * h)
    x, y = se2.rotated(-at[..., 2], rate[..., 0], rate[..., 1])
    np.testing.assert_allclose(np.stack([x, y, rate[..., 2]], -1), xi, atol=1e-8)
    end = reconstruct.trajectory(xi, [2 * np.pi])[:, 0]
    np.testing.assert_allclose(end, reconstruct.displacement(xi), atol=1e-13)


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.0, 2.0, -1.5])
def test_circles_are_integrated_in_closed_form(turn):
    xi = np.broadcast_to([0.2, -0.1, turn], (8, 3))
    expected = se2.exp(2 * np.pi * xi[0])
    np.testing.assert_allclose(reconstruct.displacement(xi), expected, atol=1e-14)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: connection.fit(MIDDLE, ([0.0, 0.0, 1.0, 2.0, 3.0],) * 2), "ascending"),
        (
            lambda: direct(lambda a, d: MIDDLE(a, d) * np.nan, Circle()),
            "not finite at ",
        ),
        (lambda: direct(MIDDLE, Circle(), [np.nan]), "amplitudes must be finite"),
        (
            lambda: Field(connection.grid(2, 5), np.zeros((3, 5, 4))),
            r"values \(3, 5, 4",
        ),
        (
            lambda: Field(connection.grid(2, 5), np.zeros((3, 5, 5)), 5),
            "degree 5 needs",
        ),
    ],
)
def test_bad_shapes_are_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


@pytest.mark.parametrize("count", [8, 16])
def test_a_connection_knows_the_error_of_its_directions(count):
    velocity = load("three-link-glass").system.velocity
    axes = connection.grid(2, 7)
    few, many = (connection.fit(velocity, axes, n) for n in (count, 64))
    off = np.sqrt(((few.A - many.A) ** 2).mean((1, 2, 3)))
    error = np.sqrt((few.direction_error**2).mean((1, 2, 3)))
    assert (off < error).all()
    assert (error < 5 * off).all()
