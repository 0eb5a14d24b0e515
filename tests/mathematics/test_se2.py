"""The group of planar motions: axioms, 50 digits, the bracket as a commutator."""

import itertools

import mpmath as mp
import numpy as np
import pytest

from rft.formulas import se2

mp.mp.dps = 50
CORNERS = np.array(
    list(itertools.product([-3.0, -1e-9, 0.0, 5e-324, 1e-4, 2.0, 3.0], repeat=3))
)
ANGLES = np.concatenate(
    [10.0 ** np.arange(-16, 0.5), np.pi - 10.0 ** np.arange(-12, 0), [0.0, 1.0, 3.0]]
)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("size", ANGLES)
def test_exp_and_log_in_fifty_digits(size, sign):
    theta = mp.mpf(sign * float(size))
    x = mp.mpf("0.7")
    y = mp.mpf("-1.3")
    a = c = mp.mpf(1)
    b = mp.mpf(0)
    if theta:
        a = mp.sin(theta) / theta
        b = (1 - mp.cos(theta)) / theta
        c = theta / 2 / mp.tan(theta / 2)
    close = {"rtol": 1e-15, "atol": 4e-16}
    truth = [float(a * x - b * y), float(b * x + a * y), float(theta)]
    np.testing.assert_allclose(se2.exp([0.7, -1.3, float(theta)]), truth, **close)
    half = theta / 2
    truth = [float(c * x + half * y), float(c * y - half * x), float(theta)]
    np.testing.assert_allclose(se2.log([0.7, -1.3, float(theta)]), truth, **close)


@pytest.mark.parametrize(
    ("turn", "short"),
    [(2 * np.pi + 0.3, 0.3), (-2 * np.pi - 0.3, -0.3), (3.5, 3.5 - 2 * np.pi)],
)
def test_log_turns_the_short_way(turn, short):
    found = se2.exp(se2.log([0.4, -0.2, turn]))
    np.testing.assert_allclose(found, [0.4, -0.2, short], atol=1e-15)


def poses(count):
    """Batches (N, 3) of random poses, and of corners in random order."""
    rng = np.random.default_rng(0)
    return [
        np.concatenate(
            [rng.uniform(-3.0, 3.0, (500, 3)), rng.permuted(CORNERS, axis=0)]
        )
        for _ in range(count)
    ]


def test_group_axioms():
    f, g, h = poses(3)
    np.testing.assert_allclose(
        se2.compose(se2.compose(f, g), h), se2.compose(f, se2.compose(g, h)), atol=1e-13
    )
    np.testing.assert_allclose(se2.compose(g, se2.inverse(g)), 0, atol=1e-14)


def test_adjoint_is_conjugation():
    g, xi = poses(2)
    xi = 0.3 * xi
    conjugated = se2.compose(se2.compose(g, se2.exp(xi)), se2.inverse(g))
    np.testing.assert_allclose(
        se2.exp((se2.adjoint(g) @ xi[..., None])[..., 0]), conjugated, atol=1e-12
    )
    np.testing.assert_allclose(se2.log(se2.exp(xi)), xi, atol=1e-14)


def test_bracket_is_the_commutator_of_matrices():
    def matrix(xi):
        x, y, turn = xi.T
        return np.moveaxis(
            np.array([[0 * x, -turn, x], [turn, 0 * x, y], [0 * x, 0 * x, 0 * x]]),
            -1,
            0,
        )

    X, Y = poses(2)
    commutator = matrix(X) @ matrix(Y) - matrix(Y) @ matrix(X)
    np.testing.assert_allclose(matrix(se2.bracket(X, Y)), commutator, atol=1e-13)
