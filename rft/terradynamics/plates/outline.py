"""The outline of a body whose section is the same along its width: straight elements
between points in the vertical plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import check_numbers, real_array
from rft.core.metres import LARGEST, metres
from rft.core.refusal import require

MOST_ELEMENTS = 5000
# Up to this number all pairs of elements are compared, without loading SciPy's tree.
MOST_COMPARED = 500


@dataclass(frozen=True, eq=False)
class Outline:
    """A chain of straight elements in the body's frame, m.

    points: (N + 1, 2) as (x, z), the last equal to the first if the outline is closed.
    smooth_normals: (N, 2, 2), unit normals at both ends of each element of a chain that
    stands for a curve; None for the normals of the elements.

    A closed outline faces outwards, and is stored counter-clockwise with x to the right
    and z up. An open one is a thin sheet, of which either side may lead. Refused:
    outlines that cross or touch themselves, and elements without length.

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
            f"an outline must have 1 to {MOST_ELEMENTS} elements, got "
            f"{len(points) - 1}",
        )
        require(
            bool((np.abs(points) <= LARGEST).all()),
            f"points must be finite and within {LARGEST:g} m",
        )
        normals = self.smooth_normals
        if normals is not None:
            normals = _checked_normals(normals, len(points) - 1)
        if self.closed and _area(points) < 0.0:
            points = points[::-1]
            normals = None if normals is None else normals[::-1, ::-1]
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "smooth_normals", normals)
        _check_simple(points, self.closed)

    @property
    def closed(self) -> bool:
        """True if the last point is the first."""
        first = np.asarray(self.points[0])
        last = np.asarray(self.points[-1])
        return len(self.points) > 3 and bool((first == last).all())

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
        """Unit normals (N, 2) of the elements, to the right of the direction from point
        to point: outwards if closed."""
        along = np.diff(self.points, axis=0) / self.lengths[:, None]
        return np.stack([along[:, 1], -along[:, 0]], -1)

    @property
    def end_normals(self) -> np.ndarray:
        """Unit normals (N, 2, 2) at the start and at the end of each element."""
        if self.smooth_normals is None:
            return np.repeat(self.normals[:, None], 2, 1)
        return self.smooth_normals


def _checked_normals(normals, elements: int) -> np.ndarray:
    """Return normals (N, 2, 2) as an array; ValueError unless they are finite numbers
    for this number of elements."""
    normals = real_array("smooth_normals", normals)
    require(
        normals.shape == (elements, 2, 2) and bool(np.isfinite(normals).all()),
        f"smooth_normals must be unit normals of shape ({elements}, 2, 2)",
    )
    return normals


def _area(points) -> float:
    """Return the enclosed area, m^2; positive if the points (N + 1, 2) run
    counter-clockwise."""
    x, z = points.T
    return float(np.sum(x[:-1] * z[1:] - x[1:] * z[:-1]) / 2)


def _cross(a, b):
    """Return the cross products (...,) of vectors (..., 2) in the plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _check_simple(points, closed: bool) -> None:
    """Raise ValueError for elements without length, for elements that fold back onto
    the one before, and for elements that cross."""
    along = np.diff(points, axis=0)
    lengths = np.hypot(*along.T)
    size = np.ptp(points, axis=0).max()
    short = np.flatnonzero(lengths <= 1e-12 * size)
    require(
        not short.size,
        f"points {short[:1]} and the next are the same",
        instead="keep one of them",
    )

    if closed:
        before = along
        after = np.roll(along, -1, 0)
    else:
        before = along[:-1]
        after = along[1:]
    is_parallel = np.abs(_cross(before, after)) <= 1e-12 * size**2
    is_reversed = (before * after).sum(-1) < 0
    folds = np.flatnonzero(is_parallel & is_reversed)
    require(
        not folds.size,
        f"the outline turns back onto itself after element {folds[:1]}",
        instead="remove the point there",
    )

    i, j = _crossings(points, along, closed)
    require(
        not i.size,
        f"elements {i[:1]} and {j[:1]} of the outline intersect or touch",
        instead="order its points along the edge",
    )


def _close_pairs(points, distance: float) -> np.ndarray:
    """Return the pairs (2, K) of points at most a distance from each other, as indices,
    the smaller first."""
    if len(points) <= MOST_COMPARED:
        difference = points[:, None] - points
        distances = np.hypot(difference[..., 0], difference[..., 1])
        return np.array(np.nonzero(np.triu(distances <= distance, 1)))
    from scipy.spatial import cKDTree

    return cKDTree(points).query_pairs(distance, output_type="ndarray").T


def _crossings(points, along, closed: bool):
    """Return the pairs of elements that cross or touch, as two arrays of indices, but
    for neighbours.

    along: (N, 2), vectors from the start to the end of each element."""
    # Only elements with close middles can cross.
    reach = np.hypot(*along.T).max() * (1 + 1e-9)
    i, j = _close_pairs(points[:-1] + along / 2, reach)
    joined_by_ends = (i == 0) & (j == len(along) - 1) & closed
    are_apart = (j > i + 1) & ~joined_by_ends
    i = i[are_apart]
    j = j[are_apart]

    # Elements cross where each has the ends of the other on both its sides, or on it.
    a = points[i]
    d = along[i]
    b = points[j]
    e = along[j]
    first_separates = _cross(d, b - a) * _cross(d, b + e - a) <= 0
    second_separates = _cross(e, a - b) * _cross(e, a + d - b) <= 0
    a_below_b = np.minimum(a, a + d) <= np.maximum(b, b + e)
    b_below_a = np.minimum(b, b + e) <= np.maximum(a, a + d)
    boxes_meet = (a_below_b & b_below_a).all(-1)
    crosses = boxes_meet & first_separates & second_separates
    return i[crosses], j[crosses]
