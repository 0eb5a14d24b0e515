"""Shape space redrawn so that equal lengths on paper cost equal effort, as nearly as a plane can.

Sought are places u (2,) of the shapes of a grid with |u_b - u_a| = F(alpha, alpha_b - alpha_a), the cost of going from one to
the next, for all edges of the grid and both diagonals of its cells: sparse nonlinear least squares of the relative errors.
A metric with curvature does not lie flat, and the errors that are left say by how much (R. L. Hatton and H. Choset, "Kinematic
cartography", in Robotics: Science and Systems VII (2011)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.geometry.field import Field
from geomech.geometry.metric import Finsler, Metric
from rft.core.checks import in_range
from rft.core.refusal import Refusal

POINTS = 61  # an axis, at most: what a picture shows
STEPS, TOLERANCE = (
    200,
    1e-12,
)  # of the least squares; relative change of the sum of squares
NODES = np.polynomial.legendre.leggauss(3)  # along an edge


@dataclass(frozen=True, eq=False)
class Stretch:
    """u over shape space. field: values (2, N_1, N_2), in units of path length, 0 in the middle of the grid and turned by
    nothing on the whole. distortion: (N_1, N_2), rms of |du| / F - 1 over the edges at each shape; rms, largest: of all
    edges. folded: fraction of cells that are turned over, where u is no map of one to one."""

    field: Field
    distortion: np.ndarray
    rms: float
    largest: float
    folded: float

    def __repr__(self) -> str:
        size = " x ".join(str(len(a)) for a in self.field.axes)
        return f"Stretch({size} shapes; lengths off by {self.rms:.1%} rms, {self.largest:.1%} at most)"

    def __call__(self, alpha) -> np.ndarray:
        """Return u (..., 2) at shapes alpha (..., 2); ValueError outside the grid."""
        return self.field(alpha)

    @cached_property
    def area(self) -> Field:
        """det(du / d alpha): area on paper for each rad^2, on the grid."""
        (a, b), (c, d) = self.field.derivative(0), self.field.derivative(1)
        return Field(self.field.axes, a * d - b * c, self.field.degree)

    def density(self, field: Field) -> np.ndarray:
        """Return a two-form (..., N_1, N_2) on this grid per area on paper, from its ``field`` per rad^2."""
        shapes = np.stack(np.meshgrid(*self.field.axes, indexing="ij"), -1)
        values = (
            np.moveaxis(field(shapes), (0, 1), (-2, -1))
            if field.values.ndim > 2
            else field(shapes)
        )
        return values / np.where(self.area.values > 0, self.area.values, np.nan)


def stretch(metric: Metric | Finsler, points: int | None = None) -> Stretch:
    """Return the plane in which lengths come nearest to those of ``metric``, of two joints. points: an axis of the
    grid, POINTS or those of the metric's own grid if these are fewer."""
    if len(metric.axes) != 2:
        raise Refusal(
            "shape space is redrawn on a plane",
            because=f"two joints, got {len(metric.axes)}",
        )
    metric_points = [len(a) for a in metric.axes]
    in_range(
        "points", metric_points[0] if points is None else points, 5, 401, whole=True
    )
    counts = [min(n, POINTS) if points is None else int(points) for n in metric_points]
    axes = tuple(
        np.interp(np.linspace(0, len(a) - 1, n), np.arange(len(a)), a)
        for a, n in zip(metric.axes, counts)
    )
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    ends = _edges(counts)
    length = _lengths(metric, alpha.reshape(-1, 2), ends)
    u = _aligned(_relaxed(_first(metric, alpha).reshape(-1, 2), ends, length), alpha)
    relative_error = (
        np.linalg.norm(np.diff(u.reshape(-1, 2)[ends], axis=1)[:, 0], axis=-1) / length
        - 1
    )
    square, times = (
        np.bincount(ends.ravel(), np.repeat(w, 2), alpha[..., 0].size)
        for w in (relative_error**2, np.ones(len(relative_error)))
    )
    field = Field(axes, np.moveaxis(u, -1, 0), min(metric.degree, min(counts) - 1))
    distortion = np.sqrt(square / times).reshape(counts)
    return Stretch(
        field,
        distortion,
        float(np.sqrt((relative_error**2).mean())),
        float(np.abs(relative_error).max()),
        _inverted_fraction(u),
    )


def _edges(counts) -> np.ndarray:
    """Return (E, 2): points of a grid, in C order, that are neighbours along an axis or a diagonal of a cell."""
    k = np.arange(np.prod(counts)).reshape(counts)
    pairs = (
        (k[1:], k[:-1]),
        (k[:, 1:], k[:, :-1]),
        (k[1:, 1:], k[:-1, :-1]),
        (k[1:, :-1], k[:-1, 1:]),
    )
    return np.concatenate([np.stack([a.ravel(), b.ravel()], -1) for a, b in pairs])


def _lengths(metric, alpha: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the lengths (E,) of the straight lines between shapes alpha (n, 2)."""
    start, step = alpha[ends[:, 0]], alpha[ends[:, 1]] - alpha[ends[:, 0]]
    along = [
        w / 2 * metric.norm(start + (x + 1) / 2 * step, step) for x, w in zip(*NODES)
    ]
    length = np.sum(along, axis=0)
    if not (length > 0).all():
        raise Refusal(
            "shape space is not redrawn where a change of shape costs nothing",
            instead="narrow the extent",
        )
    return length


def _first(metric, alpha: np.ndarray) -> np.ndarray:
    """Return a linear map of shapes (N_1, N_2, 2) that has the mean of the squared norm, over the grid and all
    directions."""
    beta = np.pi * np.arange(12) / 12
    unit = np.stack([np.cos(beta), np.sin(beta)], -1)
    F2 = (metric.norm(alpha[:, :, None], unit) ** 2).mean((0, 1))
    forms = np.stack(
        [unit[:, 0] ** 2, 2 * unit[:, 0] * unit[:, 1], unit[:, 1] ** 2], -1
    )
    a, b, c = np.linalg.lstsq(forms, F2, rcond=None)[0]
    values, vectors = np.linalg.eigh([[a, b], [b, c]])
    return alpha @ (
        (vectors * np.sqrt(np.maximum(values, 1e-6 * values[-1]))) @ vectors.T
    )


def _relaxed(u: np.ndarray, ends: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return u (n, 2) with the least sum of squares of |du| / length - 1, by damped Gauss-Newton steps."""
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import spsolve

    rows = np.repeat(np.arange(len(ends)), 4)
    columns = (2 * ends[:, :, None] + np.arange(2)).reshape(-1)  # of (end, component)
    scale = np.sqrt((length**2).mean())  # so that steps have no unit

    def residuals(u):
        d = u[ends[:, 1]] - u[ends[:, 0]]
        size = np.linalg.norm(d, axis=-1)
        return d, size, size / length - 1

    damping, (d, size, r) = 1e-3, residuals(u)
    for _ in range(STEPS):
        slope = scale * d / (size * length)[:, None]
        J = coo_array(
            (np.stack([-slope, slope], 1).ravel(), (rows, columns)), (len(ends), u.size)
        ).tocsr()
        normal, right, before = (J.T @ J).tocsc(), J.T @ r, r @ r
        while damping < 1e12:
            step = spsolve(
                normal + damping * diags_array(normal.diagonal(), format="csc"), -right
            ).reshape(-1, 2)
            d, size, r = residuals(u + scale * step)
            if r @ r <= before:
                break
            damping *= 8
        else:
            return u
        u, damping = u + scale * step, max(damping / 8, 1e-12)
        if before - r @ r <= TOLERANCE * before or r @ r < 1e-28 * len(r):
            break
    return u


def _aligned(u: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Return u (N_1, N_2, 2) shifted so that the grid's middle lies at 0, and rotated so that its linear fit in alpha
    has no rotation."""
    u, flat = (
        u.reshape(alpha.shape),
        alpha.reshape(-1, 2) - alpha.reshape(-1, 2).mean(0),
    )
    linear = np.linalg.lstsq(flat, (u - u.mean((0, 1))).reshape(-1, 2), rcond=None)[0].T
    v, _, w = np.linalg.svd(linear)
    n, m = alpha.shape[:2]
    middle = u[[(n - 1) // 2, n // 2]][:, [(m - 1) // 2, m // 2]].mean((0, 1))
    return (u - middle) @ (v @ w)


def _inverted_fraction(u: np.ndarray) -> float:
    """Return fraction of the cells' triangles that are turned over."""
    a, b, c, d = u[:-1, :-1], u[1:, :-1], u[1:, 1:], u[:-1, 1:]
    cross = lambda p, q: p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    return float(np.mean([cross(b - a, c - a) <= 0, cross(c - a, d - a) <= 0]))
