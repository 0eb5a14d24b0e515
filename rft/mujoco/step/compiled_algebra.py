"""The functions of `rft.mujoco.step.algebra` for compiled code, in loops: of a dozen
degrees of freedom they take a fraction of what calls of LAPACK do. Importing this
module loads numba."""

from __future__ import annotations

import numpy as np
from numba.extending import overload

from rft.mujoco.step import algebra


@overload(algebra.cholesky)
def _cholesky(matrix):
    def cholesky(matrix):
        n = len(matrix)
        lower = np.zeros((n, n))
        for i in range(n):
            for j in range(i + 1):
                total = matrix[i, j]
                for k in range(j):
                    total -= lower[i, k] * lower[j, k]
                if i == j:
                    lower[i, i] = np.sqrt(max(total, 1e-300))
                else:
                    lower[i, j] = total / lower[j, j]
        return lower

    return cholesky


@overload(algebra.inverse_norm2)
def _inverse_norm2(lower, x):
    def inverse_norm2(lower, x):
        n = len(x)
        total = 0.0
        y = np.empty(n)
        for i in range(n):
            y[i] = x[i]
            for j in range(i):
                y[i] -= lower[i, j] * y[j]
            y[i] /= lower[i, i]
            total += y[i] * y[i]
        return total

    return inverse_norm2


@overload(algebra.solve_linear)
def _solve_linear(matrix, right):
    def solve_linear(matrix, right):
        n = len(right)
        x = right.copy()
        for k in range(n):
            pivot = k
            for i in range(k + 1, n):
                if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                    pivot = i
            if pivot != k:
                for j in range(k, n):
                    matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
                x[k], x[pivot] = x[pivot], x[k]
            for i in range(k + 1, n):
                factor = matrix[i, k] / matrix[k, k]
                if factor != 0.0:
                    for j in range(k + 1, n):
                        matrix[i, j] -= factor * matrix[k, j]
                    x[i] -= factor * x[k]
        for i in range(n - 1, -1, -1):
            for j in range(i + 1, n):
                x[i] -= matrix[i, j] * x[j]
            x[i] /= matrix[i, i]
        return x

    return solve_linear


@overload(algebra.multiply)
def _multiply(matrix, x):
    def multiply(matrix, x):
        y = np.zeros(matrix.shape[0])
        for i in range(matrix.shape[0]):
            for j in range(matrix.shape[1]):
                y[i] += matrix[i, j] * x[j]
        return y

    return multiply


@overload(algebra.dot)
def _dot(x, y):
    def dot(x, y):
        total = 0.0
        for i in range(len(x)):
            total += x[i] * y[i]
        return total

    return dot


@overload(algebra.add_outer)
def _add_outer(matrix, factor, x, y):
    def add_outer(matrix, factor, x, y):
        for i in range(len(x)):
            if x[i] != 0.0:
                for j in range(len(y)):
                    matrix[i, j] += factor * x[i] * y[j]

    return add_outer


@overload(algebra.geom_twists)
def _geom_twists(motion, velocity):
    def geom_twists(motion, velocity):
        jacobian = motion.jacobian
        dofs = motion.dofs
        first = motion.first
        twists = np.zeros((len(jacobian), 6))
        for g in motion.members:
            for c in dofs[first[g] : first[g + 1]]:
                for i in range(6):
                    twists[g, i] += jacobian[g, i, c] * velocity[c]
        return twists

    return geom_twists


@overload(algebra.joint_forces)
def _joint_forces(motion, wrenches):
    def joint_forces(motion, wrenches):
        jacobian = motion.jacobian
        dofs = motion.dofs
        first = motion.first
        forces = np.zeros(jacobian.shape[2])
        for g in motion.members:
            for c in dofs[first[g] : first[g + 1]]:
                for i in range(6):
                    forces[c] += jacobian[g, i, c] * wrenches[g, i]
        return forces

    return joint_forces


@overload(algebra.add_projected)
def _add_projected(matrix, factor, motion, slopes):
    def add_projected(matrix, factor, motion, slopes):
        jacobian = motion.jacobian
        moved = np.empty((6, jacobian.shape[2]))
        for g in motion.members:
            dofs = motion.dofs[motion.first[g] : motion.first[g + 1]]
            for d in dofs:
                for i in range(6):
                    moved[i, d] = 0.0
                    for j in range(6):
                        moved[i, d] += factor * slopes[g, i, j] * jacobian[g, j, d]
            for c in dofs:
                for d in dofs:
                    total = 0.0
                    for i in range(6):
                        total += jacobian[g, i, c] * moved[i, d]
                    matrix[c, d] += total

    return add_projected


@overload(algebra.solve_cholesky)
def _solve_cholesky(lower, x):
    def solve_cholesky(lower, x):
        n = len(x)
        y = np.empty(n)
        for i in range(n):
            y[i] = x[i]
            for j in range(i):
                y[i] -= lower[i, j] * y[j]
            y[i] /= lower[i, i]
        for i in range(n - 1, -1, -1):
            for j in range(i + 1, n):
                y[i] -= lower[j, i] * y[j]
            y[i] /= lower[i, i]
        return y

    return solve_cholesky


@overload(algebra.submatrix)
def _submatrix(matrix, rows, columns):
    def submatrix(matrix, rows, columns):
        out = np.empty((len(rows), len(columns)))
        for i in range(len(rows)):
            for j in range(len(columns)):
                out[i, j] = matrix[rows[i], columns[j]]
        return out

    return submatrix


@overload(algebra.number_blocks)
def _number_blocks(trees, jacobian, used):
    def number_blocks(trees, jacobian, used):
        n = len(trees)
        block = trees.copy()
        for row in range(len(jacobian)):
            joined = -1
            for i in range(n):
                if jacobian[row, i] == 0.0 or block[i] == joined:
                    continue
                if joined < 0:
                    joined = block[i]
                    continue
                low = min(joined, block[i])
                high = max(joined, block[i])
                for j in range(n):
                    if block[j] == high:
                        block[j] = low
                joined = low
        out = np.full(n, -1)
        count = 0
        for i in range(n):
            if not used[i] or out[i] >= 0:
                continue
            for j in range(n):
                if block[j] == block[i]:
                    out[j] = count
            count += 1
        return out

    return number_blocks
