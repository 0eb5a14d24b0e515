"""The body frame in which the connection is smallest: minimum-perturbation coordinates
on SE(2).

A frame at h(alpha) in the first one, g_2 = g_1 h, has the connection Ad_h^-1 A + h^-1
dh. Let h be a rotation by beta and then a shift by z = x + i y, and w = A^x + i A^y.
Then

    A^theta -> A^theta + d beta,     w -> e^(-i beta) w + dz + i A^theta z,

with the new A^theta. First beta and then z minimise the square of the right sides,
integrated over the grid, with natural boundary conditions: d beta cancels the gradient
part of A^theta (Hodge-Helmholtz decomposition). The smaller the connection, the closer
the area integral of the CCF to the displacement. Source: R. L. Hatton and H. Choset,
Int. J. Robotics Research 30, 988 (2011) and Eur. Phys. J. Special Topics 224, 3141
(2015)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.coordinates import change_connection
from geomech.mathematics.geometry.representations.field import Field
from rft.core.checks import real_array
from rft.core.refusal import Refusal
from rft.formulas import se2

ROUNDING = 1e-10  # of A^theta: more than the linear solve leaves of a gradient
TOLERANCE = 1e-12  # of conjugate gradients: residual over the right side
MAX_STEPS = 1000  # of conjugate gradients; some twenty are usual


@dataclass(frozen=True, eq=False)
class Frame:
    """A body frame in another one, over shape space.

    field: values (3, N_1, ..., N_d), its pose h = (x, y, theta), in rad and the unit of
    length of its connection. residual: of the linear systems, over their right
    sides."""

    field: Field
    residual: float = 0.0

    def __call__(self, alpha, alphadot) -> tuple[np.ndarray, np.ndarray]:
        """Return h and dh/dt, (..., 3) each, for alpha, alphadot (..., d), as
        `geomech.mathematics.geometry.coordinates.in_frame` takes them; ValueError
        outside the grid."""
        alphadot = real_array("alphadot", alphadot)
        rate = np.einsum("...ij,...j->...i", self.slopes(alpha), alphadot)
        return np.broadcast_arrays(self.pose(alpha), rate)

    def pose(self, alpha) -> np.ndarray:
        """Return h (..., 3) at shapes alpha (..., d)."""
        return self.field(alpha)

    def slopes(self, alpha) -> np.ndarray:
        """Return dh / d alpha (..., 3, d) at shapes alpha (..., d)."""
        alpha = self.field.inside(alpha)
        orders = np.eye(self.field.joints, dtype=int)
        return np.stack([self.field.spline(alpha, nu=nu) for nu in orders], -1)

    def net(self, g, alpha) -> np.ndarray:
        """Return the displacement (..., 3) of this frame over a cycle from shape alpha
        (..., d), from the displacement g (..., 3) of the first frame."""
        h = self.pose(alpha)
        return se2.compose(se2.inverse(h), se2.compose(real_array("g", g), h))

    @property
    def grid_slopes(self) -> np.ndarray:
        """dh / d alpha (N_1, ..., N_d, 3, d) on the grid."""
        slopes = [self.field.derivative(k) for k in range(self.field.joints)]
        return np.moveaxis(np.stack(slopes, -1), 0, -2)

    def connection(self, first: Connection) -> np.ndarray:
        """Return A (3, d, N_1, ..., N_d) in this frame on its grid, from the connection
        in the first frame."""
        h = np.moveaxis(self.field.values, 0, -1)
        A = np.moveaxis(first.A, (0, 1), (-2, -1))
        A = change_connection(A, h, self.grid_slopes)
        return np.moveaxis(A, (-2, -1), (0, 1))


def minimum_perturbation(connection: Connection) -> Frame:
    """Return the frame in which ``connection`` is smallest.

    It is parallel to the connection's own frame in the middle of the grid. h is a
    spline on the connection's grid and of its degree, and converges as that spline
    does. ValueError if the grid has singular shapes, RuntimeError if a linear system is
    not solved."""
    if connection.field.masked:
        raise Refusal(
            "no minimum-perturbation frame exists for a field with singular shapes",
            instead="reduce the extent so that it excludes them",
        )
    if connection.periods:
        raise Refusal(
            "no minimum-perturbation frame is known for a field whose variables repeat",
            instead="use another frame",
        )
    basis = Basis(connection.axes, connection.degree)
    A_x, A_y, A_theta = connection.A
    w = basis.at_nodes(basis.coefficients(A_x + 1j * A_y))  # (d, nodes)
    a = basis.at_nodes(basis.coefficients(A_theta))

    # First the rotation.
    beta, turn_residual = basis.least(a, np.zeros_like(a))
    beta = beta - _middle(connection, basis.on_grid(beta))
    remainder = a + basis.gradient(beta)
    is_gradient = np.abs(remainder).max() <= ROUNDING * np.abs(a).max()
    if is_gradient:
        remainder = np.zeros_like(a)

    # Then the shift.
    rotated = np.exp(-1j * basis.at_nodes(beta)) * w
    z, shift_residual = basis.least(rotated, remainder)
    beta = basis.on_grid(beta)
    z = np.exp(1j * beta) * basis.on_grid(z)
    h = np.stack([z.real, z.imag, beta])
    field = replace(connection.field, values=h)
    return Frame(field, max(turn_residual, shift_residual))


def _middle(connection: Connection, values: np.ndarray) -> float:
    """Return the value of a function on the grid at the grid's middle."""
    middle = np.array([(axis[0] + axis[-1]) / 2 for axis in connection.axes])
    return replace(connection.field, values=values)(middle)


class Basis:
    """Tensor products of the splines on a grid.

    Coefficients have the grid's shape (N_1, ..., N_d). Values are (Q_1, ..., Q_d), at
    the nodes of Gauss's rule, which integrates products of splines exactly. Both may
    have leading axes."""

    def __init__(self, axes: tuple[np.ndarray, ...], degree: int):
        from scipy.interpolate import BSpline, make_interp_spline

        self.axes = axes
        self.degree = degree
        self.d = len(axes)
        # By axis: splines and their slopes at the nodes, weights, splines on the grid.
        self.values = []
        self.slopes = []
        self.weights = []
        self.grid_values = []
        for axis in axes:
            t = make_interp_spline(axis, axis, degree).t
            ends = np.unique(t)
            x, w = np.polynomial.legendre.leggauss(degree + 1)
            half = np.diff(ends)[:, None] / 2
            nodes = ((ends[:-1, None] + half) + half * x).ravel()
            self.values.append(BSpline.design_matrix(nodes, t, degree))
            unit = BSpline(t, np.eye(len(axis)), degree)
            self.slopes.append(type(self.values[-1])(unit.derivative()(nodes)))
            self.weights.append((half * w).ravel())
            self.grid_values.append(BSpline.design_matrix(axis, t, degree))

    def coefficients(self, values: np.ndarray) -> np.ndarray:
        """Return the spline coefficients of values (..., N_1, ..., N_d) on the grid."""
        from scipy.interpolate import make_interp_spline

        for k, axis in enumerate(self.axes):
            rows = np.moveaxis(values, k - self.d, 0)
            spline = make_interp_spline(axis, rows, self.degree)
            values = np.moveaxis(spline.c, 0, k - self.d)
        return values

    def on_grid(self, c: np.ndarray) -> np.ndarray:
        """Return values on the grid of splines with coefficients c (..., N_1, ...,
        N_d)."""
        return self._along(c, self.grid_values)

    def at_nodes(self, c: np.ndarray) -> np.ndarray:
        """Return values at the nodes."""
        return self._along(c, self.values)

    def gradient(self, c: np.ndarray) -> np.ndarray:
        """Return derivatives along the axes at the nodes, (d, Q_1, ..., Q_d), of one
        spline."""
        return np.stack([self._along(c, self._slope(k)) for k in range(self.d)])

    def load(self, f: np.ndarray) -> np.ndarray:
        """Return integrals of every basis function times f, given at the nodes."""
        return self._along(self.weighted(f), [v.T for v in self.values])

    def flux(self, f: np.ndarray) -> np.ndarray:
        """Return integrals of every basis function's gradient times the vector field f
        (d, Q_1, ..., Q_d)."""
        total = 0
        for k in range(self.d):
            transposed = [v.T for v in self._slope(k)]
            total = total + self._along(self.weighted(f[k]), transposed)
        return total

    def weighted(self, f: np.ndarray) -> np.ndarray:
        """Return f at the nodes times the weights of the rule."""
        for k, w in enumerate(self.weights):
            f = f * w.reshape(-1, *(1,) * (self.d - 1 - k))
        return f

    def _slope(self, k: int) -> list:
        """Return the matrices by axis of the derivative along axis k at the nodes."""
        return [*self.values[:k], self.slopes[k], *self.values[k + 1 :]]

    def _along(self, x: np.ndarray, matrices: list) -> np.ndarray:
        """Return x with each axis of the grid multiplied by its matrix."""
        for k, matrix in enumerate(matrices):
            rows = np.moveaxis(x, k - self.d, 0)
            product = matrix @ rows.reshape(len(rows), -1)
            x = np.moveaxis(product.reshape(-1, *rows.shape[1:]), 0, k - self.d)
        return x

    @cached_property
    def modes(self) -> tuple[list[np.ndarray], np.ndarray]:
        """Matrices (N, N) of each axis that make mass and stiffness diagonal, and the
        eigenvalues of -Laplace, ascending from 0 for the constant, (N_1, ..., N_d)."""
        from scipy.linalg import eigh

        vectors = []
        total = np.zeros((1,) * self.d)
        for k, weights in enumerate(self.weights):
            mass = _weighted_square(self.values[k], weights)
            stiffness = _weighted_square(self.slopes[k], weights)
            eigenvalues, axis_vectors = eigh(stiffness, mass)
            eigenvalues[0] = 0.0
            vectors.append(axis_vectors)
            total = total + eigenvalues.reshape(-1, *(1,) * (self.d - 1 - k))
        return vectors, total

    def least(self, w: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, float]:
        """Return coefficients of the z that makes the integral of |w + dz + i a z|^2
        least, and the residual of the linear system over its right side.

        w and a: (d, Q_1, ..., Q_d) at the nodes. Where a = 0, z is real if w is, and of
        mean zero. The method is conjugate gradients on the normal equations. They are
        preconditioned by the equations with the mean of |a|^2 in place of a, which
        separate by axes."""
        from scipy.sparse.linalg import LinearOperator, cg

        shape = tuple(map(len, self.axes))
        has_a = np.any(a)
        vectors, squares = self.modes
        transposed = [v.T for v in vectors]
        volume = self.weighted(np.ones(a.shape[1:])).sum()
        squares = squares + self.weighted((a**2).sum(0)).sum() / volume
        inverse = np.where(squares > 0, 1.0 / np.where(squares > 0, squares, 1.0), 0.0)

        def normal(z):
            z = z.reshape(shape)
            e = self.gradient(z)
            if has_a:
                e = e + 1j * a * self.at_nodes(z)
            return self._adjoint(e, a, has_a).ravel()

        def precondition(r):
            modes = inverse * self._along(r.reshape(shape), transposed)
            return self._along(modes, vectors).ravel()

        right = -self._adjoint(w, a, has_a).ravel()
        kind = complex if has_a or np.iscomplexobj(w) else float
        square = (right.size, right.size)
        operator = LinearOperator(square, normal, dtype=kind)
        preconditioner = LinearOperator(square, precondition, dtype=kind)
        z, failed = cg(
            operator, right, rtol=TOLERANCE, maxiter=MAX_STEPS, M=preconditioner
        )
        if failed:
            raise RuntimeError(
                "the minimum-perturbation frame did not converge:"
                " lower the grid or the extent"
            )
        size = np.linalg.norm(right)
        residual = 0.0
        if size:
            residual = float(np.linalg.norm(normal(z) - right) / size)
        return z.reshape(shape), residual

    def _adjoint(self, e: np.ndarray, a: np.ndarray, has_a: bool) -> np.ndarray:
        """Return the adjoint of z -> dz + i a z, applied to e (d, Q_1, ..., Q_d)."""
        if has_a:
            return self.flux(e) - 1j * self.load((a * e).sum(0))
        return self.flux(e)


def _weighted_square(matrix, weights: np.ndarray) -> np.ndarray:
    """Return matrix^T diag(weights) matrix as an array."""
    return (matrix.T @ matrix.multiply(weights[:, None]).tocsr()).toarray()
