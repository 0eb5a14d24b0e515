"""Small systems of linear equations, one for each sample on the last axis."""

from __future__ import annotations

import numpy as np


def solve3(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """x (3, B) with matrix x = right, by Cramer's rule on (3, 3, B); a singular matrix gives no step."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    A, B, C = e * i - f * h, f * g - d * i, d * h - e * g
    det = a * A + b * B + c * C
    inverse = np.where(det == 0.0, 0.0, 1.0 / np.where(det == 0.0, 1.0, det))
    x, y, z = right
    rows = (
        A * x + (c * h - b * i) * y + (b * f - c * e) * z,
        B * x + (a * i - c * g) * y + (c * d - a * f) * z,
        C * x + (b * g - a * h) * y + (a * e - b * d) * z,
    )
    return np.stack(rows) * inverse


def solve4(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """x (4, k, B) with matrix (4, 4, B) x = right; a matrix that is singular, or no number, gives a step that fails."""
    matrix, right = np.moveaxis(matrix, -1, 0), np.moveaxis(right, -1, 0)
    sound = np.abs(np.linalg.det(matrix)) > 0
    x = np.linalg.solve(np.where(sound[:, None, None], matrix, np.eye(4)), right)
    return np.moveaxis(np.where(sound[:, None, None], x, np.nan), 0, -1)
