"""The metric of shape space against known numbers and the work of gaits, and shape
space redrawn by it."""

import numpy as np
import pytest
from scipy.linalg import sqrtm

from geomech import plots
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection, metric
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.stretch import inverted_fraction, stretch
from geomech.mathematics.systems import Swimmer
from rft import Chain, Granular, Viscous

pytestmark = pytest.mark.usefixtures("fastest")
FLUID = Viscous(2.0)
SAND = Granular(C=1.8, gamma0=np.radians(13.8))
EQUAL = Chain()
FOUR = Chain((1, 1, 1, 1))


def power(medium, body=EQUAL):
    system = Swimmer(medium, body)

    def of_rates(alpha, alphadot):
        xi = system.velocity(alpha, alphadot)
        return system.work(alpha, alphadot, xi).power

    return of_rates


@pytest.fixture(scope="module")
def viscous():
    return metric.fit(power(FLUID), connection.grid(2, 31, 2.5))


def test_viscous_three_link_swimmer(viscous):
    """Published: [[0.0073160, 0.0050297], ...] at the straight shape."""
    M = np.array([[0.0073160, 0.0050297], [0.0050297, 0.0073160]])
    assert viscous.M[:, :, 15, 15] == pytest.approx(M, abs=1e-7)

    found = metric.path_length(viscous.norm, Circle(), [1.0])
    assert found == pytest.approx([0.512235], abs=1e-6)


def test_the_metric_is_the_power_of_any_rate():
    rng = np.random.default_rng(0)
    of_rates = power(FLUID, Chain((0.7, 1.4, 0.9, 0.5), length=0.3))
    M = metric.fit(of_rates, connection.grid(3, 9, 1.0))
    alpha = rng.choice(M.axes[0], (50, 3))
    rate = rng.normal(size=(50, 3))
    expected = of_rates(alpha, rate)
    assert M.norm(alpha, rate) ** 2 == pytest.approx(expected, rel=1e-10)
    assert (np.linalg.eigvalsh(np.moveaxis(M.M, (0, 1), (-2, -1))) > 0).all()


def test_a_norm_known_in_closed_form_comes_back():
    """F = |u| (2 + cos a + 0.3 sin 2 beta + 0.1 cos 4 beta): harmonics 0, 2 and 4."""
    axes = connection.grid(2, 25, 1.0)

    def F(alpha, u):
        beta = np.arctan2(u[..., 1], u[..., 0])
        waves = 0.3 * np.sin(2 * beta) + 0.1 * np.cos(4 * beta)
        return np.linalg.norm(u, axis=-1) * (2 + np.cos(alpha[..., 0]) + waves)

    found = metric.fit_norm(F, axes, 12, highest=6)
    assert found.residual.max() < 1e-13
    rng = np.random.default_rng(1)
    alpha = rng.uniform(-0.9, 0.9, (40, 2))
    u = rng.normal(size=(40, 2))
    assert found.norm(alpha, u) == pytest.approx(F(alpha, u), abs=1e-5)
    assert found.norm(alpha, -3 * u) == pytest.approx(3 * F(alpha, u), abs=1e-5)


def test_in_sand_length_is_work():
    system = Swimmer(SAND, Chain((0.7, 1.4, 0.9)))
    gait = Ellipse(semi_axes=(1.0, 0.4), tilt=0.7, centre=(0.2, -0.1))
    of_rates = power(SAND, system.body)
    table = metric.fit_norm(of_rates, connection.grid(2, 31, 2.0))
    run = system.run(*gait.cycle(256, [0.5, 1.0]), work=True)
    work = run.work.power.mean(-1) * 2 * np.pi
    looked_up = metric.path_length(table.norm, gait, [0.5, 1.0])
    assert looked_up == pytest.approx(work, rel=2e-3)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: metric.fit(lambda a, u: np.ones(3), connection.grid(2, 5)),
            "power must be finite",
        ),
        (
            lambda: metric.fit(
                lambda a, u: np.nan * (a[..., 0] + u[..., 0]), connection.grid(2, 5)
            ),
            "power must be finite",
        ),
        (lambda: stretch(constant(np.eye(2)), 3), "points must be"),
        (lambda: stretch(constant(np.eye(2)), 7.5), "points must be"),
        (lambda: stretch(constant(np.zeros((2, 2)))), "costs nothing"),
        (
            lambda: stretch(metric.fit(power(FLUID, FOUR), connection.grid(3, 5, 0.5))),
            "two joints",
        ),
        (
            lambda: metric.fit_norm(power(SAND), connection.grid(3, 5)),
            "two joint rates",
        ),
        (
            lambda: metric.fit_norm(power(SAND), connection.grid(2, 5), highest=3),
            "even",
        ),
        (
            lambda: metric.fit_norm(power(SAND), connection.grid(2, 5), 12, highest=12),
            "below",
        ),
    ],
)
def test_what_makes_no_metric_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


# Shape space redrawn by what it costs.


def constant(M):
    axes = connection.grid(2, 9, 1.5)
    return metric.Metric(axes, np.array(M)[..., None, None] * np.ones((9, 9)))


def shapes(axes):
    return np.stack(np.meshgrid(*axes, indexing="ij"))


@pytest.mark.parametrize("M", [np.eye(2), np.array([[2.0, 0.7], [0.7, 0.5]])])
def test_a_constant_metric_becomes_its_root(M):
    found = stretch(constant(M))
    expected = np.einsum("ij,jkl->ikl", sqrtm(M), shapes(found.field.axes))
    assert found.field.values == pytest.approx(expected, abs=1e-10)
    area = np.full((9, 9), np.sqrt(np.linalg.det(M)))
    assert found.area.values == pytest.approx(area, rel=1e-9)


def bent(alpha):
    """A plane in curved coordinates."""
    x, y = np.moveaxis(alpha, -1, 0)
    u = x + 0.3 * np.sin(y) + 0.1 * x**2
    return np.stack([u, 1.4 * y + 0.2 * x**2 - 0.2 * x], -1)


def pulled_back(alpha, rate):
    """Its metric."""
    x, y = np.moveaxis(alpha, -1, 0)
    u, v = np.moveaxis(rate, -1, 0)
    first = (1 + 0.2 * x) * u + 0.3 * np.cos(y) * v
    return first**2 + ((0.4 * x - 0.2) * u + 1.4 * v) ** 2


def test_a_flat_metric_in_disguise_is_flattened():
    off = []
    for points in (11, 21):
        found = stretch(metric.fit(pulled_back, connection.grid(2, points, 1.5)))
        true = bent(np.moveaxis(shapes(found.field.axes), 0, -1)).reshape(-1, 2)
        u = found.field.values.reshape(2, -1).T
        true -= true.mean(0)
        u = u - u.mean(0)
        turn, _, back = np.linalg.svd(u.T @ true)
        off.append(np.abs(u @ turn @ back - true).max())
    assert off[0] < 2e-3
    assert np.log2(off[0] / off[1]) > 1.8


def test_displacement_is_density_times_area_on_paper():
    found = stretch(metric.fit(pulled_back, connection.grid(2, 21, 1.5)))
    x, y = shapes(connection.grid(2, 31, 1.5))
    field = Field(connection.grid(2, 31, 1.5), np.stack([1 + 0 * x, x, x * y]))
    here = np.moveaxis(shapes(found.field.axes), 0, -1)
    expected = np.moveaxis(field(here), -1, 0)
    assert found.density(field) * found.area.values == pytest.approx(expected)


X, Y = shapes((np.arange(5.0), np.arange(4.0)))


@pytest.mark.parametrize(
    ("x", "y", "share"),
    [(X, Y, 0.0), (Y, X, 1.0), (np.minimum(X, 6.0 - X), Y, 0.25)],
)
def test_cells_that_are_turned_over_are_counted_by_triangles(x, y, share):
    """Of a plane that is folded along the middle of its third column of four, the last
    column is turned over."""
    assert inverted_fraction(np.stack([x, y], -1)) == share


def test_indicatrix_has_unit_cost(viscous):
    where = np.array([[0.3, -0.8], [1.2, 1.0]])
    for table in (viscous, metric.fit_norm(power(SAND), connection.grid(2, 9, 2.0))):
        rates = table.indicatrix(where, 36)
        assert table.norm(where[:, None] + 0 * rates, rates) == pytest.approx(1)


@pytest.mark.parametrize(("reverse", "word"), [(False, "backwards"), (True, "ahead")])
def test_the_area_is_shaded_by_what_it_adds(reverse, word):
    """CCF_x = -1: a counter-clockwise circle goes backwards, a clockwise one ahead."""
    axes = connection.grid(2, 15, 1.5)
    values = np.zeros((3, 15, 15))
    values[0] = -1.0
    gait = Circle(amplitude=0.8, reverse=reverse)
    ax = plots.figure(3, 3)[1][0, 0]
    drawn = plots.ccf_contours(Field(axes, values), 0, [gait], ax=ax)
    assert [text.get_text() for text in drawn.get_legend().get_texts()] == [word]
