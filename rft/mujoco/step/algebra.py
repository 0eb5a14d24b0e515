"""Linear algebra of small systems, by NumPy; `rft.mujoco.step.compiled_algebra` defines
it a second time for compiled code.

Geoms have Jacobians (G, 6, n), from the velocities of n degrees of freedom to the
twists of the geoms along their own axes; only some of these move a geom."""

from __future__ import annotations

import numpy as np


def cholesky(matrix: np.ndarray) -> np.ndarray:
    """Return the lower Cholesky factor of a matrix (n, n)."""
    return np.linalg.cholesky(matrix)


def inverse_norm2(lower: np.ndarray, x: np.ndarray) -> float:
    """Return x . (L L^T)^-1 x for the lower factor L (n, n)."""
    y = np.linalg.solve(lower, x)
    return float(y @ y)


def solve_linear(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the solution (n,) of linear equations, of numbers that are not finite for
    singular ones. Compiled code loses the matrix."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full(len(right), np.nan)


def multiply(matrix: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the product of a matrix and a vector."""
    return matrix @ x


def dot(x: np.ndarray, y: np.ndarray) -> float:
    """Return x . y."""
    return float(x @ y)


def add_outer(matrix: np.ndarray, factor: float, x: np.ndarray, y: np.ndarray) -> None:
    """Add a factor times x y^T to a matrix."""
    matrix += factor * np.outer(x, y)


def geom_twists(motion, velocity: np.ndarray) -> np.ndarray:
    """Return the twists (G, 6) of all geoms by the velocities (n,). motion:
    `rft.mujoco.step.implicit.Motion`."""
    return motion.jacobian @ velocity


def joint_forces(motion, wrenches: np.ndarray) -> np.ndarray:
    """Return the generalised forces (n,) of wrenches (G, 6) on the geoms."""
    return np.einsum("gin,gi->n", motion.jacobian, wrenches)


def add_projected(matrix: np.ndarray, factor: float, motion, slopes) -> None:
    """Add a factor times the slopes (G, 6, 6) of wrenches by twists to a matrix (n, n),
    by the velocities."""
    jacobian = motion.jacobian
    matrix += factor * (jacobian.swapaxes(1, 2) @ (slopes @ jacobian)).sum(0)


def solve_cholesky(lower: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the solution (n,) of L L^T y = x for the lower factor L (n, n)."""
    return np.linalg.solve(lower.T, np.linalg.solve(lower, x))


def submatrix(matrix: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return some rows and columns of a matrix."""
    return matrix[np.ix_(rows, columns)]


def number_blocks(
    trees: np.ndarray, jacobian: np.ndarray, used: np.ndarray
) -> np.ndarray:
    """Return for each degree of freedom (n,) the number of its block, 0, 1, ..., or -1
    where nothing in it is used.

    trees: (n,), number of the tree of each. jacobian: (r, n), of constraint rows, which
    join trees. used: (n,), whether a degree of freedom moves a geom in the ground."""
    block = trees.copy()
    for row in jacobian:
        joined = block[row != 0.0]
        if len(joined) > 0:
            block[np.isin(block, joined)] = joined.min()
    kept = np.unique(block[used])
    out = np.full(len(trees), -1)
    for number, one in enumerate(kept):
        out[block == one] = number
    return out
