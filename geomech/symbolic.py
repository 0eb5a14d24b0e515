"""Curvature in closed form, for connections given as sympy matrices."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp


def bracket(X: sp.Matrix, Y: sp.Matrix) -> sp.Matrix:
    """[X, Y] on se(2), columns (x, y, theta), as `rft.se2.bracket`."""
    return sp.Matrix([Y[2] * X[1] - X[2] * Y[1], X[2] * Y[0] - Y[2] * X[0], 0])


def ccf(A: sp.Matrix, alpha, i: int = 0, j: int = 1) -> sp.Matrix:
    """d_i A_j - d_j A_i + [A_i, A_j] of a connection A (3, d), a column of three."""
    return A[:, j].diff(alpha[i]) - A[:, i].diff(alpha[j]) + bracket(A[:, i], A[:, j])


def velocity(A: sp.Matrix, alpha) -> Callable[..., Any]:
    """The callable velocity(alpha, alphadot) -> xi that `geomech.connection.fit` and `geomech.tiers.direct.direct` take."""
    import numpy as np

    entries = sp.lambdify(alpha, list(A), "numpy", cse=True)
    rows, columns = A.shape

    def xi(a, adot):
        a, adot = np.broadcast_arrays(np.asarray(a, float), np.asarray(adot, float))
        flat = [np.broadcast_to(e, a.shape[:-1]) for e in entries(*np.moveaxis(a, -1, 0))]
        matrix = np.stack(flat, -1).reshape(*a.shape[:-1], rows, columns)
        return np.einsum("...ij,...j->...i", matrix, adot)

    return xi
