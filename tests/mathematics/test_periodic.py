"""Fields over shape variables with periods: grids, splines, errors, images."""

import numpy as np
import pytest
from rolling import TURN, Lifted, Mirrored

from geomech.mathematics.geometry import connection, curvature, metric
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.representations.plane import (
    interpolated_plane,
    plane,
)
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.geometry.two_form import two_form
from geomech.mathematics.systems import as_system
from geomech.mathematics.tiers import Numerics, fitted
from rft.core.refusal import Refusal
from rft.formulas import se2

PERIODS = (None, TURN)
SHAPES = np.random.default_rng(4).uniform([-0.9, -9.0], [0.9, 9.0], (200, 2))
LATER = SHAPES + [0.0, 2 * TURN]


def wave(alpha):
    return np.cos(alpha[..., 1] + alpha[..., 0]) * (1 + alpha[..., 0] ** 2)


def field(points=31, degree=3, offset=0.0):
    axes = connection.grid(2, points, 1.0, PERIODS)
    axes = (axes[0], axes[1] + offset)
    shapes = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    return Field(axes, wave(shapes), degree, periods=PERIODS)


def fitted_connection(system, points=31, **options):
    axes = connection.grid(system.joints, points, 1.0, system.traits.periods)
    return connection.fit(
        system.velocity, axes, 4 * system.joints, traits=system.traits, **options
    )


def true_ccf(system, axes):
    """The CCF on a grid, by central differences of A itself."""
    shapes = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    step = 1e-5

    def A(shapes):
        return [system.velocity(shapes, unit) for unit in np.eye(2)]

    d_1 = (A(shapes + [step, 0])[1] - A(shapes - [step, 0])[1]) / (2 * step)
    d_2 = (A(shapes + [0, step])[0] - A(shapes - [0, step])[0]) / (2 * step)
    return np.moveaxis(d_1 - d_2 + se2.bracket(*A(shapes)), -1, 0)


@pytest.mark.parametrize("extent", [0.3, 1.0, 9.0])
def test_an_axis_with_a_period_covers_one_period_whatever_the_extent(extent):
    plain, around = connection.grid(2, 11, extent, PERIODS)
    assert (plain[0], plain[-1]) == (-extent, extent)
    assert (around[0], around[-1]) == (0.0, TURN)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("offset", [0.0, -np.pi, 1.0])
def test_a_field_repeats_and_converges_across_its_seam(degree, offset):
    errors = []
    for points in (21, 41, 81):
        values = field(points, degree, offset)(LATER)
        np.testing.assert_allclose(values, field(points, degree, offset)(SHAPES))
        errors.append(np.abs(values - wave(SHAPES)).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders.max() > degree + 0.8


def test_slopes_are_smooth_across_the_seam():
    found = field(61)
    shapes = np.stack(np.meshgrid(*found.axes, indexing="ij"), -1)
    slopes = -np.sin(shapes.sum(-1)) * (1 + shapes[..., 0] ** 2)
    errors = np.abs(found.derivative(1) - slopes)
    assert errors[:, [0, -1]].max() < 1.2 * errors[:, 20:40].max()
    np.testing.assert_array_equal(*found.derivative(1)[:, [0, -1]].T)


@pytest.mark.parametrize("mean", [0.0, 0.7])
def test_an_integral_around_an_axis_keeps_what_it_gains_per_turn(mean):
    axis = connection.grid(1, 61, periods=(TURN,))[0]
    integral = Field((axis,), mean + np.cos(axis), 5, periods=(TURN,)).antiderivative(0)
    angles = np.linspace(-20.0, 30.0, 41)
    expected = mean * angles + np.sin(angles)
    np.testing.assert_allclose(integral(angles[:, None]), expected, atol=1e-7)


def test_an_integral_along_a_plain_axis_repeats_around_the_other():
    integral = field(61).antiderivative(0)
    np.testing.assert_allclose(integral(LATER), integral(SHAPES), atol=1e-12)


def test_runs_between_masks_go_on_across_the_seam():
    """Two points are masked; the slopes elsewhere are those of one run."""
    axis = connection.grid(1, 41, periods=(TURN,))[0]
    values = np.sin(axis)
    values[[20, 21]] = np.nan
    slopes = Field((axis,), values, periods=(TURN,)).derivative(0)
    assert np.isnan(slopes[[20, 21]]).all()
    good = np.isfinite(slopes)
    assert good.sum() == 39
    np.testing.assert_allclose(slopes[good], np.cos(axis)[good], atol=2e-3)
    np.testing.assert_allclose(slopes[[0, 1, -2, -1]], np.cos(axis)[[0, 1, -2, -1]],
                               atol=1e-4)  # fmt: skip


def test_singular_shapes_are_masked_across_the_seam():
    signs = np.array([-1.0, 1.0, 1.0, 1.0, -1.0])
    mask = connection.sign_changes(signs, (TURN,))
    assert mask.tolist() == [True, True, False, True, True]
    rises = np.array([0.5, 1.0, 1.0, -1.0, 0.5])
    mask = connection.sign_changes(rises, (TURN,))
    assert mask.tolist() == [True, False, True, True, True]


@pytest.mark.parametrize("points", [20, 21, 31, 32])
@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_the_told_error_of_a_ccf_covers_the_true_one(points, drift):
    system = Lifted(drift)
    A = fitted_connection(system, points)
    found = curvature.ccf(A)
    told = curvature.error(A).values
    true = np.abs(found.values - true_ccf(system, A.axes))
    assert (true <= told + 1e-9).mean() > 0.99
    np.testing.assert_array_equal(told[..., 0], told[..., -1])


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("points", [20, 21])
def test_half_of_a_grid_has_the_period_of_the_whole(first, points):
    A = fitted_connection(Lifted(1.0), points)
    half = A.half(first)
    assert half.periods == PERIODS
    np.testing.assert_allclose(half(LATER), half(SHAPES), atol=1e-12)
    assert np.abs(half(SHAPES) - A(SHAPES)).max() < 0.05


@pytest.mark.parametrize("points", [20, 21])
def test_images_save_balances_and_change_no_field(points):
    saving = Mirrored()
    plain = Mirrored(claims=False)
    A = fitted_connection(saving, points, trusted=True)
    B = fitted_connection(plain, points, trusted=True)
    np.testing.assert_allclose(A.A, B.A, atol=1e-13)
    assert plain.solved == 8 * points * (points - 1)
    assert saving.solved < 0.56 * plain.solved
    for system in (saving, plain):
        numerics = Numerics(grid=points, directions=8)
        forecast = fitted.table(as_system(system), numerics).balances
        assert forecast == system.solved


@pytest.mark.parametrize("pair", [(1, 2), (2, 1), (1, 3), (3, 2)])
@pytest.mark.parametrize("at", [(0.0, 0.0, 0.0), (0.0, 0.0, np.pi), (0.0, 0.3, 1.0)])
def test_a_plane_with_a_period_is_the_same_with_and_without_images(pair, at):
    def velocity(alpha, alphadot):
        p, q, tau = np.moveaxis(alpha, -1, 0)
        dp, dq, dtau = np.moveaxis(alphadot, -1, 0)
        x = np.sin(p + tau) * dq + np.sin(tau) * np.cos(q) * dp
        y = np.cos(tau + p) * dp + np.cos(q - tau) * dtau
        return np.stack([x, y, np.cos(2 * tau + q) * dq], -1)

    periods = (None, None, TURN)
    axes = connection.grid(3, 15, 1.0, periods)
    of_pair = [axes[k - 1] for k in pair]
    saving = Traits(linear=True, mirror=True, periods=periods)
    plain = Traits(linear=True, periods=periods)
    given = (velocity, of_pair, pair, at, 12)
    with_images = plane(*given, traits=saving).connection
    without = plane(*given, traits=plain).connection
    np.testing.assert_allclose(with_images.A, without.A, atol=1e-13)
    assert without.periods == tuple(periods[k - 1] for k in pair) or 3 not in pair


def test_planes_and_slices_of_a_field_repeat():
    A = fitted_connection(Lifted(1.0, links=2), 15)
    cut = interpolated_plane(A, (1, 3), (0.0, 0.2, 5 * TURN))
    assert cut.connection.periods == PERIODS
    here = interpolated_plane(A, (1, 3), (0.0, 0.2, 0.0)).connection.A
    np.testing.assert_allclose(cut.connection.A, here, atol=1e-12)
    form = two_form(A)
    assert form.slice(1, 3, (0.0, 0.2, 1.0)).periods == PERIODS
    assert form.slice(1, 2, (0.0, 0.2, 1.0)).periods == ()
    turned = form.slice(1, 2, (0.0, 0.2, 1.0 - TURN))
    np.testing.assert_allclose(
        turned.values, form.slice(1, 2, (0.0, 0.2, 1.0)).values, atol=1e-12
    )


def test_harmonics_and_metrics_repeat():
    system = Lifted(1.0)
    axes = connection.grid(2, 21, 1.0, PERIODS)
    series = harmonics.fit(system.velocity, axes, traits=system.traits)
    rates = np.random.default_rng(1).normal(size=SHAPES.shape)
    np.testing.assert_allclose(
        series.velocity(LATER, rates), series.velocity(SHAPES, rates), atol=1e-12
    )
    assert series.half(1).periods == PERIODS

    def power(alpha, alphadot):
        stiffness = 2 + np.cos(alpha[..., 1])
        return stiffness * (alphadot**2).sum(-1)

    quadratic = metric.fit(power, axes, periods=PERIODS)
    finsler = metric.fit_norm(
        lambda *arguments: np.sqrt(power(*arguments)), axes, periods=PERIODS
    )
    for norm in (quadratic.norm, finsler.norm):
        np.testing.assert_allclose(norm(LATER, rates), norm(SHAPES, rates))
        np.testing.assert_allclose(
            norm(LATER, rates), np.sqrt(power(SHAPES, rates)), rtol=1e-3
        )


def test_a_velocity_without_its_period_is_noticed():
    def drifting(alpha, alphadot):
        x = (1 + alpha[..., 1]) * alphadot[..., 0]
        return np.stack([x, 0 * x, 0 * x], -1)

    traits = Traits(linear=True, periods=PERIODS)
    with pytest.warns(UserWarning, match="period"):
        connection.fit(drifting, connection.grid(2, 9, 1.0, PERIODS), traits=traits)


@pytest.mark.parametrize(
    "build",
    [
        lambda: Traits(periods=(None, -1.0)),
        lambda: Traits(periods=(None, "2 pi")),
        lambda: Traits(periods=(True,)),
        lambda: Field((np.linspace(0, 6, 9),), np.zeros(9), periods=(TURN,)),
        lambda: Field((np.linspace(0, TURN, 9),), np.arange(9.0), periods=(TURN,)),
        lambda: Field((np.linspace(0, TURN, 9),), np.zeros(9), periods=(TURN, None)),
        lambda: connection.grid(3, periods=PERIODS),
    ],
)
def test_periods_that_cannot_be_are_refused(build):
    with pytest.raises(Refusal, match="period"):
        build()
