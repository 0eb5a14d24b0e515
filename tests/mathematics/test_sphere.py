"""Odd harmonics of the velocity on the sphere of directions, of three joint rates and
more."""

import numpy as np
import pytest

from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.systems import Swimmer
from rft import CATALOGUE, Chain

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium


def cubic(alpha, alphadot):
    """Odd and of degree one in alphadot, a polynomial of degree 3 on the sphere; no two
    joints are alike."""
    a, u = np.broadcast_arrays(alpha, alphadot)
    first = u[..., 0]
    second = u[..., 1]
    last = u[..., -1]
    square = (u**2).sum(-1)
    x = a[..., 0] * first + 0.3 * first**2 * u[..., 2] / square
    y = second * a[..., 2] + 0.7 * first * second * last / square
    turn = 0.5 * a[..., 1] * second**3 - 0.4 * last**2 * second
    return np.stack([x, y, 0.2 * last + turn / square], -1)


@pytest.mark.parametrize(("joints", "highest"), [(3, 3), (3, 7), (4, 3), (5, 3)])
def test_polynomials_on_the_sphere_come_back(joints, highest):
    count = 2 * harmonics.terms(joints, highest)
    axes = connection.grid(joints, 4, 1.0)
    table = harmonics.fit(cubic, axes, count, 1, highest=highest)
    assert (table.highest, table.coefficients.shape[1]) == (highest, count // 2)
    rng = np.random.default_rng(0)
    alpha = rng.uniform(-1, 1, (20, joints))
    u = 3.0 * rng.normal(size=(20, joints))
    expected = cubic(alpha, u)
    np.testing.assert_allclose(table.velocity(alpha, u), expected, atol=1e-10)
    assert table.residual.max() < 1e-10
    half = table.half(0).velocity(alpha, u)[..., 0]
    np.testing.assert_allclose(half, expected[..., 0], atol=1e-10)


def test_what_they_leave_is_that_of_other_directions_and_falls():
    system = Swimmer(GLASS, Chain((0.7, 1.4, 0.9, 0.6)))
    axes = connection.grid(3, 4, 1.0)
    rng = np.random.default_rng(2)
    alpha = rng.choice(axes[0], (400, 3))
    u = rng.normal(size=(400, 3))
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    truth = system.velocity(alpha, u)
    for highest, count, most in ((5, 42, 0.3), (9, 110, 0.12)):
        table = harmonics.fit(system.velocity, axes, count, highest=highest)
        left = np.sqrt(((table.velocity(alpha, u) - truth) ** 2).mean(0))
        residual = np.sqrt((table.residual**2).mean((1, 2, 3)))
        np.testing.assert_allclose(residual, left, rtol=0.35)
        assert (left < most * np.sqrt((truth**2).mean(0))).all()
