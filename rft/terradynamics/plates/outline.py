"""The outline of a body that does not change along its width: straight elements between points in the vertical plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import check_numbers, real_array
from rft.core.metres import LARGEST, metres
from rft.core.refusal import require

MOST_ELEMENTS = 5000
FEW_ELEMENTS = 500  # elements up to which all pairs are compared at once, without loading SciPy's tree


@dataclass(frozen=True, eq=False)
class Outline:
    """A chain of straight elements in the body's frame, m.

    points: (N + 1, 2) as (x, z), the last repeating the first if the outline is closed. smooth_normals: (N, 2, 2), unit
    normals at both ends of each element of a chain that stands for a curve; None for the normals of the elements. A
    closed outline has faces outwards, and is stored counter-clockwise with x to the right and z up. An open one is a thin
    sheet; either side may lead. Refused: outlines that cross or touch themselves, elements of no length.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.plates import Outline
    >>> plate = Outline(np.array([[0.0, 0.0], [0.02, 0.0], [0.04, 0.0]]), width=0.02)
    >>> plate.elements, plate.closed
    (2, False)
    """

    points: np.ndarray
    width: Annotated[float, metres("width of the body across the plane")]
    smooth_normals: np.ndarray | None = None

    def __post_init__(self):
        check_numbers(self)
        points = real_array("points", self.points)
        require(
            points.ndim == 2 and points.shape[1] == 2, "points must be a list of (x, z)"
        )
        require(
            2 <= len(points) <= MOST_ELEMENTS + 1,
            f"an outline takes 1 to {MOST_ELEMENTS} elements, got {len(points) - 1}",
        )
        require(
            bool((np.abs(points) <= LARGEST).all()),
            f"points must be finite and within {LARGEST:g} m",
        )
        normals = (
            None
            if self.smooth_normals is None
            else real_array("smooth_normals", self.smooth_normals)
        )
        valid = normals is None or (
            normals.shape == (len(points) - 1, 2, 2)
            and bool(np.isfinite(normals).all())
        )
        require(
            valid,
            f"smooth_normals must be unit normals of shape ({len(points) - 1}, 2, 2)",
        )
        if self.closed and _area(points) < 0.0:
            points, normals = (
                points[::-1],
                None if normals is None else normals[::-1, ::-1],
            )
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "smooth_normals", normals)
        _check_simple(points, self.closed)

    @property
    def closed(self) -> bool:
        """True if the last point is the first."""
        return len(self.points) > 3 and bool(
            (np.asarray(self.points[0]) == np.asarray(self.points[-1])).all()
        )

    @property
    def elements(self) -> int:
        """Number N of elements."""
        return len(self.points) - 1

    @property
    def midpoints(self) -> np.ndarray:
        """Middles (N, 2) of the elements, m."""
        return (self.points[1:] + self.points[:-1]) / 2

    @property
    def lengths(self) -> np.ndarray:
        """Lengths (N,) of the elements, m."""
        return np.hypot(*np.diff(self.points, axis=0).T)

    @property
    def normals(self) -> np.ndarray:
        """Unit normals (N, 2) of the elements, to the right of the direction from point to point: outwards if closed."""
        along = np.diff(self.points, axis=0) / self.lengths[:, None]
        return np.stack([along[:, 1], -along[:, 0]], -1)

    @property
    def end_normals(self) -> np.ndarray:
        """Unit normals (N, 2, 2) at the start and at the end of each element."""
        return (
            np.repeat(self.normals[:, None], 2, 1)
            if self.smooth_normals is None
            else self.smooth_normals
        )


def _area(points) -> float:
    """Return the enclosed area, m^2; positive if the points (N + 1, 2) run counter-clockwise."""
    x, z = points.T
    return float(np.sum(x[:-1] * z[1:] - x[1:] * z[:-1]) / 2)


def _cross(a, b):
    """Return the cross products (...,) of vectors (..., 2) in the plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _check_simple(points, closed: bool) -> None:
    """Raise ValueError for elements of no length, elements that fold back onto the last, and elements that cross."""
    along = np.diff(points, axis=0)
    lengths, size = np.hypot(*along.T), np.ptp(points, axis=0).max()
    short = np.flatnonzero(lengths <= 1e-12 * size)
    require(
        not short.size,
        f"points {short[:1]} and the next are the same",
        instead="keep one",
    )
    last = along[1:] if not closed else np.roll(along, -1, 0)
    first = along[:-1] if not closed else along
    back = (np.abs(_cross(first, last)) <= 1e-12 * size**2) & (
        (first * last).sum(-1) < 0
    )
    require(
        not back.any(),
        f"the outline turns back onto itself after element {np.flatnonzero(back)[:1]}",
        instead="drop the point there",
    )
    i, j = _crossings(points, along, closed)
    require(
        not i.size,
        f"elements {i[:1]} and {j[:1]} of the outline cross or touch",
        instead="order its points along the edge",
    )


def _close(points, reach: float) -> np.ndarray:
    """Return the pairs (2, K) of points at most ``reach`` from each other, as indices, the smaller first."""
    if len(points) <= FEW_ELEMENTS:
        difference = points[:, None] - points
        return np.array(
            np.nonzero(
                np.triu(np.hypot(difference[..., 0], difference[..., 1]) <= reach, 1)
            )
        )
    from scipy.spatial import cKDTree

    return cKDTree(points).query_pairs(reach, output_type="ndarray").T


def _crossings(points, along, closed: bool):
    """Return the pairs of elements that cross or touch, but for neighbours; only elements with close middles can."""
    i, j = _close(points[:-1] + along / 2, np.hypot(*along.T).max() * (1 + 1e-9))
    no_neighbours = (j > i + 1) & ~((i == 0) & (j == len(along) - 1) & closed)
    i, j = i[no_neighbours], j[no_neighbours]
    a, d, b, e = points[i], along[i], points[j], along[j]
    sides = (
        _cross(d, b - a) * _cross(d, b + e - a),
        _cross(e, a - b) * _cross(e, a + d - b),
    )
    overlap = (np.minimum(a, a + d) <= np.maximum(b, b + e)) & (
        np.minimum(b, b + e) <= np.maximum(a, a + d)
    )
    crosses = overlap.all(-1) & (sides[0] <= 0) & (sides[1] <= 0)
    return i[crosses], j[crosses]
