"""Gaits: rates are derivatives, amplitudes scale about the centre, the butterfly is
the published one."""

import numpy as np
import pytest
from registry import GAITS

from geomech.mathematics.gaits import (
    Butterfly,
    Circle,
    Ellipse,
    Fourier,
    Points,
    Polygon,
)
from geomech.mathematics.geometry.gait import loop_area
from geomech.scenes import load
from geomech.studies.estimates import estimate
from rft.formulas import se2

T = np.linspace(0, 2 * np.pi, 33)


@pytest.mark.parametrize("name", GAITS)
def test_rate_is_the_derivative_of_shape(name):
    gait = GAITS[name]
    slope = (gait.shape(T + 1e-5) - gait.shape(T - 1e-5)) / 2e-5
    np.testing.assert_allclose(gait.rate(T), slope, atol=1e-8)
    np.testing.assert_allclose(gait.shape(0.0), gait.shape(2 * np.pi), atol=1e-12)


@pytest.mark.parametrize("name", GAITS)
def test_amplitudes_are_a_batch_axis(name):
    gait = GAITS[name]
    alpha, alphadot = gait.cycle(16, [0.5, 2.0])
    assert alpha.shape == alphadot.shape == (2, 16, gait.joints)
    small, large = alpha - gait.middle
    np.testing.assert_allclose(large / 4, small, atol=1e-15)


def test_butterfly_is_the_published_one():
    a1, a2 = Butterfly().shape(T).T
    even = 1.0908 * np.cos(T) - 0.2508 * np.cos(3 * T) - 0.18 * np.cos(5 * T)
    odd = 1.052 * np.sin(T) + 0.0859 * np.sin(3 * T)
    np.testing.assert_allclose((a1 + a2) / 2, even, atol=1e-14)
    np.testing.assert_allclose((a1 - a2) / 2, odd, atol=1e-14)


@pytest.mark.parametrize(
    ("gait", "t", "shape"),
    [
        (Circle(amplitude=2.0), 0.0, [2, 0]),
        (Circle(amplitude=2.0), np.pi / 2, [0, 2]),
        (Circle(reverse=True), np.pi / 2, [0, -1]),
        (Ellipse(semi_axes=(2, 1), tilt=np.pi / 2), 0.0, [0, 2]),
        (
            Ellipse(semi_axes=(1.3, 0.4), tilt=0.7),
            np.pi / 2,
            [-0.4 * np.sin(0.7), 0.4 * np.cos(0.7)],
        ),
    ],
)
def test_orientation_start_and_reversal(gait, t, shape):
    np.testing.assert_allclose(gait.shape(t), shape, atol=1e-15)


def test_points_are_passed_through_in_order():
    points = GAITS["points"].points
    curve = GAITS["points"].shape(np.linspace(0, 2 * np.pi, 20001))
    distances = np.linalg.norm(curve - np.array(points)[:, None], axis=-1)
    assert distances.min(1).max() < 1e-3
    assert (np.diff(distances.argmin(1)) > 0).all()


def test_points_are_reached_as_their_chords_are_run():
    """Steps of 3, 4 and 5 rad: phase runs with chord length, not by points."""
    points = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])
    found = Points(points=points.tolist()).shape(2 * np.pi * np.array([0, 3, 7]) / 12)
    np.testing.assert_allclose(found, points, atol=1e-14)


CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])


def side_by_side(system, corners, nodes=32):
    """Return the pose after the sides of a polygon, each in steps of order 4 by Magnus'
    expansion."""
    pose = np.zeros(3)
    for corner, side in zip(corners, np.roll(corners, -1, 0) - corners):
        for k in range(nodes):
            places = corner + np.array([[k], [k + 0.5], [k + 1]]) / nodes * side
            a, b, c = system.velocity(places, side / nodes)
            step = (a + 4 * b + c) / 6 + se2.bracket(a, c) / 12
            pose = se2.compose(pose, se2.exp(step))
    return pose


@pytest.mark.parametrize(("phases", "most"), [(64, 1e-4), (256, 5e-8)])
def test_a_polygon_is_purcells_square(phases, most):
    """Against an integration side by side, with errors that cover it and fall fast."""
    scene = load("three-link-viscous")
    true = side_by_side(scene.system, CORNERS)
    assert np.hypot(*true[:2]) == pytest.approx(0.0602, abs=5e-5)
    gait = Polygon(CORNERS.tolist())
    (net,), (error,) = estimate.direct(scene, gait, np.array([1.0]), phases)
    assert np.hypot(*(net - true)[:2]) < error[0] < most


def test_a_polygon_has_straight_sides_and_no_jump_of_its_rates():
    gait = Polygon([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [0.0, 0.0]])
    t = np.linspace(0, 2 * np.pi, 1201)
    assert (gait.shape(t[:301])[:, 1] == 0).all()
    assert np.abs(gait.rate(t[[0, 300, 700]])).max() < 1e-12


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Polygon(points=((0, 0), (1, 1))), "at least 3 shapes"),
        (
            lambda: Fourier(cos=((1.0,), (1.0, 2.0)), sin=((1.0,),)),
            "array of real numbers",
        ),
        (lambda: Points(points=((0, 0), (0, 0), (1, 1))), "neighbours must differ"),
        (lambda: Butterfly().cycle(10), "at least 11 for this gait"),
    ],
)
def test_bad_gaits_are_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


@pytest.mark.parametrize(
    ("gait", "amplitudes", "area"),
    [
        (Circle(centre=(0.3, -0.2)), [0.5, -0.5, 0.0], [np.pi / 4, np.pi / 4, 0.0]),
        (Circle(reverse=True), [0.5], [-np.pi / 4]),
        (Ellipse(semi_axes=(0.3, 0.2), tilt=0.4), [2.0], [0.24 * np.pi]),
        (Polygon(points=[(0, 0), (2, 0), (2, 1), (0, 1)]), [0.5], [0.5]),
    ],
)
def test_a_loop_encloses_its_area(gait, amplitudes, area):
    for phases in (32, 63):
        found, error = loop_area(gait, phases, amplitudes)
        assert (np.abs(found - area) <= error + 1e-15).all()
        assert (error < 1e-3).all()
