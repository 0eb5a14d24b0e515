"""Shape space redrawn so that equal lengths on paper cost equal effort, as nearly as a
plane can.

The places u (2,) of the shapes of a grid are found with |u_b - u_a| = F(alpha, alpha_b
- alpha_a), the cost of going from one to the next, for all edges of the grid and both
diagonals of its cells. The method is sparse nonlinear least squares of the relative
errors. A metric with curvature does not lie flat, and the remaining errors measure by
how much (R. L. Hatton and H. Choset, "Kinematic cartography", in Robotics: Science and
Systems VII (2011))."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.representations.field import Field
from rft.core.checks import in_range
from rft.core.refusal import Refusal

POINTS = 61  # of an axis, at most: enough for a picture
MAX_STEPS = 200  # of the least squares
TOLERANCE = 1e-12  # relative change of the sum of squares
MAX_DAMPING = 1e12  # no smaller step exists
NODES = np.polynomial.legendre.leggauss(3)  # along an edge


@dataclass(frozen=True, eq=False)
class Stretch:
    """Places u on paper over shape space.

    field: values (2, N_1, N_2), in units of path length, 0 in the middle of the grid
    and without a net rotation. distortion: (N_1, N_2), rms of |du| / F - 1 over the
    edges at each shape; rms, largest: over all edges. folded: fraction of cells that
    are turned over, where u does not map one to one."""

    field: Field
    distortion: np.ndarray
    rms: float
    largest: float
    folded: float

    def __repr__(self) -> str:
        size = " x ".join(str(len(a)) for a in self.field.axes)
        return (
            f"Stretch({size} shapes; lengths off by"
            f" {self.rms:.1%} rms, {self.largest:.1%} at most)"
        )

    def __call__(self, alpha) -> np.ndarray:
        """Return u (..., 2) at shapes alpha (..., 2); ValueError outside the grid."""
        return self.field(alpha)

    @cached_property
    def area(self) -> Field:
        """det(du / d alpha): area on paper for each rad^2, on the grid."""
        a, b = self.field.derivative(0)
        c, d = self.field.derivative(1)
        return Field(self.field.axes, a * d - b * c, self.field.degree)

    def density(self, field: Field) -> np.ndarray:
        """Return a two-form (..., N_1, N_2) on this grid per area on paper, from its
        ``field`` per rad^2."""
        shapes = np.stack(np.meshgrid(*self.field.axes, indexing="ij"), -1)
        values = np.moveaxis(field(shapes), (0, 1), (-2, -1))
        return values / np.where(self.area.values > 0, self.area.values, np.nan)


def stretch(metric: Metric | Finsler, points: int | None = None) -> Stretch:
    """Return the plane in which lengths come nearest to those of ``metric``, of two
    joints.

    points: of an axis of the grid; by default POINTS, or those of the metric's own grid
    if these are fewer."""
    if len(metric.axes) != 2:
        raise Refusal(
            "shape space can be redrawn only as a plane",
            because=f"it needs two joints, got {len(metric.axes)}",
        )
    if metric.periods:
        raise Refusal(
            "shape space can be redrawn only as a plane",
            because="one of its variables repeats",
            instead="draw the map as it is",
        )
    if points is None:
        in_range("points", len(metric.axes[0]), 5, 401, whole=True)
        counts = [min(len(axis), POINTS) for axis in metric.axes]
    else:
        in_range("points", points, 5, 401, whole=True)
        counts = [int(points)] * 2
    axes = tuple(_resampled(axis, n) for axis, n in zip(metric.axes, counts))
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)

    ends = _edges(counts)
    length = _lengths(metric, alpha.reshape(-1, 2), ends)
    u = _relaxed(_linear_map(metric, alpha).reshape(-1, 2), ends, length)
    u = _aligned(u, alpha)

    edges = np.diff(u.reshape(-1, 2)[ends], axis=1)[:, 0]
    error = np.linalg.norm(edges, axis=-1) / length - 1
    # Every shape has edges, so both counts have one number for each.
    square = np.bincount(ends.ravel(), np.repeat(error**2, 2))
    n_edges = np.bincount(ends.ravel())
    return Stretch(
        field=Field(axes, np.moveaxis(u, -1, 0), min(metric.degree, min(counts) - 1)),
        distortion=np.sqrt(square / n_edges).reshape(counts),
        rms=float(np.sqrt((error**2).mean())),
        largest=float(np.abs(error).max()),
        folded=inverted_fraction(u),
    )


def _resampled(axis: np.ndarray, count: int) -> np.ndarray:
    """Return ``count`` angles along an axis, equally far apart in its index."""
    return np.interp(np.linspace(0, len(axis) - 1, count), np.arange(len(axis)), axis)


def _edges(counts) -> np.ndarray:
    """Return (E, 2): points of a grid, in C order, that are neighbours along an axis or
    a diagonal of a cell."""
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
    start = alpha[ends[:, 0]]
    step = alpha[ends[:, 1]] - start
    parts = [
        w / 2 * metric.norm(start + (x + 1) / 2 * step, step) for x, w in zip(*NODES)
    ]
    length = np.sum(parts, axis=0)
    if not (length > 0).all():
        raise Refusal(
            "shape space cannot be redrawn where a change of shape costs nothing",
            instead="reduce the extent",
        )
    return length


def _linear_map(metric, alpha: np.ndarray) -> np.ndarray:
    """Return places (N_1, N_2, 2) that are linear in the shapes, with the mean of the
    squared norm over the grid and all directions."""
    beta = np.pi * np.arange(12) / 12
    unit = np.stack([np.cos(beta), np.sin(beta)], -1)
    F2 = (metric.norm(alpha[:, :, None], unit) ** 2).mean((0, 1))
    x, y = unit.T
    forms = np.stack([x**2, 2 * x * y, y**2], -1)
    a, b, c = np.linalg.lstsq(forms, F2, rcond=None)[0]
    values, vectors = np.linalg.eigh([[a, b], [b, c]])
    scales = np.sqrt(np.maximum(values, 1e-6 * values[-1]))
    return alpha @ ((vectors * scales) @ vectors.T)


def _relaxed(u: np.ndarray, ends: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return u (n, 2) with the least sum of squares of |du| / length - 1, by damped
    Gauss-Newton steps."""
    from scipy.sparse import coo_array, diags_array
    from scipy.sparse.linalg import spsolve

    rows = np.repeat(np.arange(len(ends)), 4)
    columns = (2 * ends[:, :, None] + np.arange(2)).reshape(-1)  # of (end, component)
    scale = np.sqrt((length**2).mean())  # so that steps have no unit

    def residuals(u):
        d = u[ends[:, 1]] - u[ends[:, 0]]
        size = np.linalg.norm(d, axis=-1)
        return d, size, size / length - 1

    damping = 1e-3
    d, size, r = residuals(u)
    for _ in range(MAX_STEPS):
        slope = scale * d / (size * length)[:, None]
        values = np.stack([-slope, slope], 1).ravel()
        J = coo_array((values, (rows, columns)), (len(ends), u.size)).tocsr()
        normal = (J.T @ J).tocsc()
        diagonal = diags_array(normal.diagonal(), format="csc")
        right = J.T @ r
        square_before = r @ r

        # Stronger damping makes the step shorter, until the sum of squares falls.
        while damping < MAX_DAMPING:
            step = spsolve(normal + damping * diagonal, -right).reshape(-1, 2)
            d, size, r = residuals(u + scale * step)
            if r @ r <= square_before:
                break
            damping *= 8
        else:
            return u

        u = u + scale * step
        damping = max(damping / 8, 1e-12)
        if square_before - r @ r <= TOLERANCE * square_before:
            break
        if r @ r < 1e-28 * len(r):
            break
    return u


def _aligned(u: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Return u (N_1, N_2, 2) shifted so that the grid's middle lies at 0, and rotated
    so that its linear fit in alpha has no rotation."""
    u = u.reshape(alpha.shape)
    shapes = alpha.reshape(-1, 2) - alpha.reshape(-1, 2).mean(0)
    places = (u - u.mean((0, 1))).reshape(-1, 2)
    linear = np.linalg.lstsq(shapes, places, rcond=None)[0].T
    v, _, w = np.linalg.svd(linear)
    n, m = alpha.shape[:2]
    middle = u[[(n - 1) // 2, n // 2]][:, [(m - 1) // 2, m // 2]].mean((0, 1))
    return (u - middle) @ (v @ w)


def inverted_fraction(u: np.ndarray) -> float:
    """Return the fraction of the cells' triangles that are turned over."""
    a = u[:-1, :-1]
    b = u[1:, :-1]
    c = u[1:, 1:]
    d = u[:-1, 1:]

    def cross(p, q):
        return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]

    return float(np.mean([cross(b - a, c - a) <= 0, cross(c - a, d - a) <= 0]))
