"""The metric of shape space against known numbers, quadratic forms and the work of gaits."""

import numpy as np
import pytest

from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection, metric
from geomech.mathematics.systems import Swimmer
from rft import Chain, Granular, Viscous

pytestmark = pytest.mark.usefixtures("fastest")
FLUID, SAND, EQUAL = Viscous(2.0), Granular(C=1.8, gamma0=np.radians(13.8)), Chain()


def power(medium, body=EQUAL):
    system = Swimmer(medium, body)
    return lambda alpha, alphadot: (
        system.work(alpha, alphadot, system.velocity(alpha, alphadot)).power
    )


@pytest.fixture(scope="module")
def viscous():
    return metric.fit(power(FLUID), connection.grid(2, 31, 2.5))


def test_viscous_three_link_swimmer(viscous):
    assert viscous.M[:, :, 15, 15] == pytest.approx(
        np.array([[0.0073160, 0.0050297], [0.0050297, 0.0073160]]), abs=1e-7
    )
    assert metric.path_length(viscous.norm, Circle(), [1.0]) == pytest.approx(
        [0.512235], abs=1e-6
    )
    assert metric.path_length(
        lambda *a: np.sqrt(power(FLUID)(*a)), Circle(), [1.0]
    ) == pytest.approx([0.512235], abs=1e-6)


def test_the_metric_is_the_power_of_any_rate():
    rng, body = np.random.default_rng(0), Chain((0.7, 1.4, 0.9, 0.5), length=0.3)
    M = metric.fit(power(FLUID, body), connection.grid(3, 9, 1.0))
    alpha, rate = rng.choice(M.axes[0], (50, 3)), rng.normal(size=(50, 3))
    assert M.norm(alpha, rate) ** 2 == pytest.approx(
        power(FLUID, body)(alpha, rate), rel=1e-10
    )
    assert (np.linalg.eigvalsh(np.moveaxis(M.M, (0, 1), (-2, -1))) > 0).all()


def test_a_norm_known_in_closed_form_comes_back():
    """F = |u| (2 + cos a + 0.3 sin 2 beta + 0.1 cos 4 beta), which has harmonics 0, 2 and 4."""
    axes = connection.grid(2, 25, 1.0)

    def F(alpha, u):
        beta = np.arctan2(u[..., 1], u[..., 0])
        return np.hypot(*np.moveaxis(u, -1, 0)) * (
            2 + np.cos(alpha[..., 0]) + 0.3 * np.sin(2 * beta) + 0.1 * np.cos(4 * beta)
        )

    done: list[float] = []
    found = metric.fit_norm(F, axes, 12, progress=done.append, highest=6)
    assert done == sorted(done) and done[-1] == 1.0
    assert found.residual.max() < 1e-13
    assert np.abs(found.coefficients[:, 3, 5]) == pytest.approx(
        [2 + np.cos(axes[0][3]), 0, 0.3, 0.1, 0, 0, 0], abs=1e-13
    )
    rng = np.random.default_rng(1)
    alpha, u = rng.uniform(-0.9, 0.9, (40, 2)), rng.normal(size=(40, 2))
    assert found.norm(alpha, u) == pytest.approx(F(alpha, u), abs=1e-5)
    assert found.norm(alpha, -3 * u) == pytest.approx(
        3 * found.norm(alpha, u), rel=1e-12
    )


def test_in_sand_length_is_work():
    gait, system = (
        Ellipse(semi_axes=(1.0, 0.4), tilt=0.7, centre=(0.2, -0.1)),
        Swimmer(SAND, Chain((0.7, 1.4, 0.9))),
    )
    table = metric.fit_norm(power(SAND, system.body), connection.grid(2, 31, 2.0))
    assert table.residual.mean() < 0.005 * table.coefficients[0].mean()
    alpha, alphadot = gait.cycle(256, [0.5, 1.0])
    work = system.run(alpha, alphadot, work=True).work.power.mean(-1) * 2 * np.pi
    assert metric.path_length(
        power(SAND, system.body), gait, [0.5, 1.0]
    ) == pytest.approx(work, rel=1e-10)
    assert metric.path_length(table.norm, gait, [0.5, 1.0]) == pytest.approx(
        work, rel=2e-3
    )


@pytest.mark.parametrize(("degree", "order"), [(3, 4), (5, 6)])
def test_it_converges_with_the_grid(degree, order):
    """Length of the path of an off-centre loop, of unequal links, against the power itself."""
    body, gait = (
        Chain((0.7, 1.4, 0.9)),
        Ellipse(semi_axes=(1.0, 0.6), tilt=0.7, centre=(0.2, -0.1)),
    )
    F = power(FLUID, body)
    truth = metric.path_length(lambda *a: np.sqrt(F(*a)), gait, [1.0])
    grids = np.array([11, 21, 41])
    off = [
        np.abs(
            metric.path_length(
                metric.fit(F, connection.grid(2, n, 2.0), degree).norm, gait, [1.0]
            )
            - truth
        )[0]
        for n in grids
    ]
    assert np.log(off[0] / off[-1]) / np.log(40 / 10) > order - 0.7
    assert 0 < off[-1] < 1e-6


def test_length_does_not_depend_on_pacing(viscous):
    """The same loop run faster here and slower there."""
    t = 2 * np.pi * np.arange(400) / 400
    s, ds = t + 0.6 * np.sin(t), 1 + 0.6 * np.cos(t)
    loop = np.stack([np.cos(s), 0.7 * np.sin(s)], -1)
    rate = ds[:, None] * np.stack([-np.sin(s), 0.7 * np.cos(s)], -1)
    paced = viscous.norm(loop, rate).mean()
    even = viscous.norm(
        np.stack([np.cos(t), 0.7 * np.sin(t)], -1),
        np.stack([-np.sin(t), 0.7 * np.cos(t)], -1),
    ).mean()
    assert paced == pytest.approx(even, rel=1e-8)


@pytest.mark.parametrize("medium", [FLUID, SAND])
def test_indicatrix_has_unit_cost(medium, viscous):
    table = (
        viscous
        if medium is FLUID
        else metric.fit_norm(power(SAND), connection.grid(2, 15, 2.0))
    )
    where = np.array([[0.3, -0.8], [1.2, 1.0]])
    rates = table.indicatrix(where, 36)
    assert rates.shape == (2, 36, 2)
    assert table.norm(
        np.broadcast_to(where[:, None], rates.shape), rates
    ) == pytest.approx(np.ones((2, 36)))
    assert np.arctan2(rates[..., 1], rates[..., 0])[:, 9] == pytest.approx(np.pi / 2)


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
