"""Small systems of linear equations, one for each sample on the last axis."""

from __future__ import annotations

import numpy as np


def solve3(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """x (3, B) with matrix x = right, by Cramer's rule on (3, 3, B); a singular matrix gives no step."""
    twice = np.empty((5, 5, matrix.shape[2]))  # rows and columns go round, so that every minor is of neighbours
    twice[:3, :3] = matrix
    twice[3:, :3] = matrix[:2]
    twice[:, 3:] = twice[:, :2]
    cofactors = twice[1:4, 1:4] * twice[2:, 2:]
    cofactors -= twice[1:4, 2:] * twice[2:, 1:4]
    det = np.einsum("jb,jb->b", matrix[0], cofactors[0])
    x = np.einsum("ijb,ib->jb", cofactors, right)
    if np.count_nonzero(det) < det.size:
        singular = det == 0.0
        x[:, singular], det[singular] = 0.0, 1.0
    x /= det
    return x


def solve4(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """x (4, k, B) with matrix (4, 4, B) x = right; a matrix that is singular, or no number, gives a step that fails."""
    matrix, right = np.moveaxis(matrix, -1, 0), np.moveaxis(right, -1, 0)
    sound = np.abs(np.linalg.det(matrix)) > 0
    x = np.linalg.solve(np.where(sound[:, None, None], matrix, np.eye(4)), right)
    return np.moveaxis(np.where(sound[:, None, None], x, np.nan), 0, -1)
