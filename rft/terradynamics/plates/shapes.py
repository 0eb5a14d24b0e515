"""Bodies as outlines, one class per kind; sizes in m.

The frame of rods, plates and wheels is at their centre, x forward and z up. The frame
of a leg is at the hip; its free end is straight below, at z = -2 R.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers, in_range, real_array
from rft.core.metres import LARGEST, metres
from rft.core.refusal import require
from rft.terradynamics.plates.outline import MOST_ELEMENTS, Outline

FEWEST_ROUND = 8  # elements of a curve
MOST_POINTS = 2000  # of a polygon or spline

Width = Annotated[float, metres("width across the plane")]
HalfLength = Annotated[
    float, metres("R, half the distance from the hip to the free end")
]


class Shape:
    """Base of bodies that have an outline.

    Examples
    --------
    >>> from rft.terradynamics.plates import Plate, Shape
    >>> isinstance(Plate(0.04, 0.02), Shape)
    True
    """

    width: float

    def __post_init__(self):
        check_numbers(self)

    def outline(self, elements: int = 100) -> Outline:
        """Return the outline of about ``elements`` elements, at least as many as the
        shape needs."""
        in_range("elements", elements, 1, MOST_ELEMENTS, whole=True)
        points, normals = self.curve(int(elements))
        return Outline(points, self.width, normals)

    def curve(self, elements: int):
        """Return points (N + 1, 2), m, and smooth_normals (N, 2, 2) or None of an
        `Outline`."""
        raise NotImplementedError


@dataclass(frozen=True)
class Plate(Shape):
    """A thin plate.

    Examples
    --------
    >>> from rft.terradynamics.plates import Plate
    >>> Plate(length=0.04, width=0.02).outline(2).points[:, 0]  # x along the plate, m
    array([-0.02,  0.  ,  0.02])
    """

    length: Annotated[float, metres("length in the plane")]
    width: Width
    tilt: Annotated[
        float, Number(-100, 100, "rad", "beta, 0 for a plate that lies flat")
    ] = 0.0

    def curve(self, elements: int):
        s = np.linspace(-0.5, 0.5, elements + 1)[:, None] * self.length
        return s * np.array([math.cos(self.tilt), math.sin(self.tilt)]), None


@dataclass(frozen=True)
class RoundRod(Shape):
    """A cylinder that lies across the plane (Fig. 8(a)).

    Examples
    --------
    >>> from rft.terradynamics.plates import RoundRod
    >>> RoundRod(radius=0.01, width=0.1).outline(40).elements
    40
    """

    radius: Annotated[float, metres("radius of the cylinder")]
    width: Width

    def curve(self, elements: int):
        return _arc(self.radius, 0.0, 2 * math.pi, elements)


@dataclass(frozen=True)
class HalfCylinder(Shape):
    """Half of a cylinder (Fig. 8(a)).

    flat (-): side on which it is flat, "down" or "up"; the frame is at the middle of
    the flat side.

    Examples
    --------
    >>> from rft.terradynamics.plates import HalfCylinder
    >>> HalfCylinder(radius=0.02, width=0.1, flat="down").outline(30).closed
    True
    """

    radius: Annotated[float, metres("radius of the cylinder")]
    width: Width
    flat: str = "down"

    def __post_init__(self):
        super().__post_init__()
        require(
            isinstance(self.flat, str) and self.flat in ("down", "up"),
            "flat must be 'down' or 'up'",
            value=self.flat,
        )

    def curve(self, elements: int):
        n_round = max(FEWEST_ROUND // 2, round(elements * math.pi / (math.pi + 2)))
        n_flat = max(1, elements - n_round)
        begin = 0.0 if self.flat == "down" else math.pi
        points, normals = _arc(self.radius, begin, begin + math.pi, n_round)
        side = np.linspace(points[-1], points[0], n_flat + 1)

        # Roundoff must not tilt the flat side, nor leave a gap at its ends.
        side[:, 1] = 0.0
        points[[0, -1], 1] = 0.0
        side[-1] = points[0]
        side[0] = points[-1]

        sign = 1.0 if self.flat == "up" else -1.0
        side_normals = np.broadcast_to([0.0, sign], (n_flat, 2, 2))
        points = np.concatenate([points, side[1:]])
        return points, np.concatenate([normals, side_normals])


@dataclass(frozen=True)
class SquareRod(Shape):
    """A square bar that lies across the plane, one side down (Fig. 8(a)).

    Examples
    --------
    >>> from rft.terradynamics.plates import SquareRod
    >>> SquareRod(side=0.02, width=0.1).outline(4).points
    array([[-0.01, -0.01],
           [ 0.01, -0.01],
           [ 0.01,  0.01],
           [-0.01,  0.01],
           [-0.01, -0.01]])
    """

    side: Annotated[float, metres("side of the square")]
    width: Width

    def curve(self, elements: int):
        h = self.side / 2
        corners = np.array([[-h, -h], [h, -h], [h, h], [-h, h], [-h, -h]])
        return _element_ends(corners, elements), None


@dataclass(frozen=True)
class CLeg(Shape):
    """A thin leg bent to an arc of a circle; hip and free end are 2 R from each other
    at any curvature (Fig. 12(c)).

    A leg of positive curvature that points down bulges backwards. Rotating at a
    positive rate, it enters the grains with the bulge ahead. The sign is assumed to be
    the paper's.

    Examples
    --------
    >>> from rft.terradynamics.plates import CLeg
    >>> leg = CLeg(radius=0.038, width=0.02).outline(24)
    >>> leg.points[[0, -1], 1].round(3)  # hip and free end, m
    array([ 0.   , -0.076])
    """

    radius: HalfLength
    width: Width
    relative_curvature: Annotated[
        float,
        Number(
            -1, 1, "-",
            "R / r, where r is the radius of the arc: 1 for half a circle, 0 for a "
            "flat leg, negative for a reversed leg, within +-1",
        ),
    ] = 1.0  # fmt: skip

    def curve(self, elements: int):
        c = self.relative_curvature
        s = np.linspace(-1.0, 1.0, elements + 1)
        half = math.asin(c)  # half the angle of the arc
        angle = half * s

        # along = sin(s asin c) / c and across = (cos(s asin c) - cos(asin c)) / c,
        # without a loss of digits as c -> 0.
        if c:
            along = np.sinc(angle / np.pi) * s * (half / c)
            across = 2 * np.sin((half + angle) / 2) * np.sin((half - angle) / 2) / c
        else:
            along = s
            across = 0.0 * s
        points = self.radius * np.stack([-across, -1.0 - along], -1)
        normal = np.stack([-np.cos(angle), -np.sin(angle)], -1)
        return points, np.stack([normal[:-1], normal[1:]], 1)


@dataclass(frozen=True)
class FlatLeg(Shape):
    """A thin straight leg of length 2 R.

    Examples
    --------
    >>> from rft.terradynamics.plates import FlatLeg
    >>> leg = FlatLeg(radius=0.038, width=0.02).outline(4)
    >>> leg.points[:, 1].round(3)  # from the hip downwards, m
    array([ 0.   , -0.019, -0.038, -0.057, -0.076])
    """

    radius: HalfLength
    width: Width

    def curve(self, elements: int):
        return CLeg(self.radius, self.width, 0.0).curve(elements)


@dataclass(frozen=True)
class Wheel(Shape):
    """A wheel with or without lugs: straight bars that stand off its rim, equally
    spaced.

    Examples
    --------
    >>> from rft.terradynamics.plates import Wheel
    >>> wheel = Wheel(0.05, width=0.03, lugs=12, lug_height=0.01, lug_width=0.004)
    >>> wheel.outline(200).closed
    True
    """

    radius: Annotated[float, metres("radius of the rim")]
    width: Width
    lugs: Annotated[
        int, Number(0, 200, "-", "number of lugs, 0 to 200", whole=True)
    ] = 0
    lug_height: Annotated[float, metres("height of a lug, 0 without lugs", 0)] = 0.0
    lug_width: Annotated[float, metres("width of a lug, 0 without lugs", 0)] = 0.0

    def __post_init__(self):
        super().__post_init__()
        if not self.lugs:
            require(
                self.lug_height == self.lug_width == 0,
                "lug_height and lug_width need lugs",
                instead="give lugs",
            )
            return
        for name in ("lug_height", "lug_width"):
            in_range(name, getattr(self, name), 1e-6, LARGEST, unit="m")
        widest = 2 * self.radius * math.sin(math.pi / max(3, self.lugs))
        require(
            self.lug_width < widest,
            f"lug_width must be below {widest:.3g} m, so that {self.lugs} lugs fit on "
            f"the rim, got {self.lug_width:g}",
        )

    def curve(self, elements: int):
        if not self.lugs:
            return _arc(self.radius, 0.0, 2 * math.pi, elements)
        pitch = 2 * math.pi / self.lugs
        half = math.asin(self.lug_width / (2 * self.radius))  # half a lug's angle

        # Elements are shared between the rim and the lugs by their lengths.
        rim = self.lugs * (pitch - 2 * half) * self.radius
        bars = self.lugs * (2 * self.lug_height + self.lug_width)
        n_arc = max(1, round(elements * rim / (rim + bars) / self.lugs))
        n_lug = max(3, round(elements * bars / (rim + bars) / self.lugs))
        first_lug = _element_ends(self._lug_corners(half), n_lug)

        points = []
        normals = []
        for k in range(self.lugs):
            cos = math.cos(k * pitch)
            sin = math.sin(k * pitch)
            lug = first_lug @ np.array([[cos, sin], [-sin, cos]])
            begin = k * pitch + half
            end = (k + 1) * pitch - half
            arc, arc_normals = _arc(self.radius, begin, end, n_arc)
            points += [lug, arc[1:-1]]
            normals += [np.repeat(_normals(lug)[:, None], 2, 1), arc_normals]
        return np.concatenate([*points, points[0][:1]]), np.concatenate(normals)

    def _lug_corners(self, half: float) -> np.ndarray:
        """Return the corners (4, 2) of the lug on +x, from -z to +z, m; ``half`` is
        half of its angle at the rim."""
        foot = self.radius * math.cos(half)
        top = foot + self.lug_height
        corners = np.array([[foot, -1], [top, -1], [top, 1], [foot, 1]])
        return corners * [1.0, self.lug_width / 2]


@dataclass(frozen=True)
class Polygon(Shape):
    """Straight edges between points.

    points (m): x and z of each point. closed (-): whether the last point is joined to
    the first, so that the body has an inside.

    Examples
    --------
    >>> from rft.terradynamics.plates import Polygon
    >>> Polygon(((0.0, 0.0), (0.02, 0.0), (0.01, 0.02)), width=0.05).outline(12).closed
    True
    """

    points: tuple[tuple[float, float], ...]
    width: Width
    closed: bool = True

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "points", _checked_points(self.points, self.closed))
        Outline(_corners(self.points, self.closed), self.width)

    def curve(self, elements: int):
        return _element_ends(_corners(self.points, self.closed), elements), None


@dataclass(frozen=True)
class Spline(Shape):
    """A smooth curve through points: a cubic spline whose parameter is the length of
    the chords.

    points (m): x and z of each point. closed (-): whether the last point is joined to
    the first, so that the body has an inside.

    Examples
    --------
    >>> from rft.terradynamics.plates import Spline
    >>> points = ((0.01, 0.0), (0.0, 0.01), (-0.01, 0.0), (0.0, -0.01))
    >>> Spline(points, width=0.1).outline(40).closed
    True
    """

    points: tuple[tuple[float, float], ...]
    width: Width
    closed: bool = True

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "points", _checked_points(self.points, self.closed))
        Polygon(self.points, self.width, self.closed)
        # A spline may cross itself where its chords do not.
        self.outline(min(4 * len(self.points), MOST_ELEMENTS))

    def curve(self, elements: int):
        from scipy.interpolate import CubicSpline

        points = _corners(self.points, self.closed)
        chords = np.hypot(*np.diff(points, axis=0).T)
        s = np.concatenate([[0.0], np.cumsum(chords)])
        ends = "periodic" if self.closed else "not-a-knot"
        spline = CubicSpline(s, points, bc_type=ends)
        s = np.linspace(0.0, s[-1], max(elements, FEWEST_ROUND) + 1)
        curve = spline(s)
        tangent = spline(s, 1)
        if self.closed:
            curve[-1] = curve[0]
            tangent[-1] = tangent[0]

        normal = _quarter_turn_right(tangent) / np.hypot(*tangent.T)[:, None]
        normals = np.stack([normal[:-1], normal[1:]], 1)
        x, z = curve.T
        if self.closed and np.sum(x[:-1] * z[1:] - x[1:] * z[:-1]) < 0:
            # `Outline` reverses clockwise points; normals have to point outwards.
            normals = -normals
        return curve, normals


SHAPES = {
    "plate": Plate,
    "round-rod": RoundRod,
    "half-cylinder": HalfCylinder,
    "square-rod": SquareRod,
    "c-leg": CLeg,
    "flat-leg": FlatLeg,
    "wheel": Wheel,
    "polygon": Polygon,
    "spline": Spline,
}


def _quarter_turn_right(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 2) rotated by a quarter turn to the right, with x to the
    right and z up."""
    return np.stack([vectors[..., 1], -vectors[..., 0]], -1)


def _normals(points: np.ndarray) -> np.ndarray:
    """Return the unit normals (N, 2) to the right of elements between points
    (N + 1, 2)."""
    along = np.diff(points, axis=0)
    return _quarter_turn_right(along) / np.hypot(*along.T)[:, None]


def _arc(radius: float, begin: float, end: float, elements: int):
    """Return points (N + 1, 2) and outward normals (N, 2, 2) of a counter-clockwise arc
    about the origin between two angles, closed if it is a full circle."""
    is_circle = end - begin > 6.28
    fewest = FEWEST_ROUND if is_circle else 1
    angle = np.linspace(begin, end, max(elements, fewest) + 1)
    normal = np.stack([np.cos(angle), np.sin(angle)], -1)
    if is_circle:
        normal[-1] = normal[0]
    return radius * normal, np.stack([normal[:-1], normal[1:]], 1)


def _element_ends(points, elements: int):
    """Return the ends of about ``elements`` elements along edges between points (N, 2).

    Elements are equal on each edge; their number is the edge's share of the length,
    rounded up."""
    lengths = np.hypot(*np.diff(points, axis=0).T)
    shares = elements * lengths / lengths.sum()
    counts = np.maximum(1, np.ceil(shares - 1e-9)).astype(int)
    edges = [
        np.linspace(start, end, count, endpoint=False)
        for start, end, count in zip(points[:-1], points[1:], counts)
    ]
    return np.concatenate([*edges, points[-1:]])


def _checked_points(points, closed) -> tuple[tuple[float, float], ...]:
    """Return points as pairs of numbers, without a last one that repeats the first;
    ValueError unless an outline can have them."""
    require(isinstance(closed, bool), "closed must be true or false", value=closed)
    array = real_array("points", points)
    require(
        array.ndim == 2 and array.shape[1] == 2,
        "points must be a list of (x, z)",
        value=points,
    )
    if closed and len(array) > 1 and (array[0] == array[-1]).all():
        array = array[:-1]
    kind = "closed" if closed else "open"
    fewest = 3 if closed else 2
    require(
        fewest <= len(array) <= MOST_POINTS,
        f"a {kind} outline must have {fewest} to {MOST_POINTS} points",
        value=len(array),
    )
    require(
        bool((np.abs(array) <= LARGEST).all()),
        f"points must be finite and within {LARGEST:g} m",
    )
    return tuple(map(tuple, array.tolist()))


def _corners(points, closed: bool) -> np.ndarray:
    """Return points (N, 2) as an array, with the first again at the end if the outline
    is closed."""
    corners = np.array(points)
    if closed:
        return np.concatenate([corners, corners[:1]])
    return corners
