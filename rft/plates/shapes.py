"""Bodies as outlines, one class a kind; sizes in m. Each gives its `Outline` of about so many elements.

The frame of rods, plates and wheels is at their centre, x forward and z up. That of a leg is at the hip, and its free end is
straight below, at z = -2 R.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.checks import Number, check_numbers, in_range, real_array, require, shown
from rft.metres import LARGEST, metres
from rft.plates.outline import MOST_ELEMENTS, Outline

FEWEST_ROUND = 8  # elements of a curve
MOST_POINTS = 2000  # of an outline of one's own

Width = Annotated[float, metres("width across the plane")]
HalfLength = Annotated[float, metres("R, half the distance from hip to free end")]


class Shape:
    """Base of bodies, with an outline."""

    width: float

    def __post_init__(self):
        check_numbers(self)

    def outline(self, elements: int = 100) -> Outline:
        """Return the outline of about so many elements, and at least those that the shape takes."""
        in_range("elements", elements, 1, MOST_ELEMENTS, whole=True)
        points, bends = self.curve(int(elements))
        return Outline(points, self.width, bends)

    def curve(self, elements: int):
        """Return points (N + 1, 2), m, and bends (N, 2, 2) or None as of `Outline`."""
        raise NotImplementedError


@dataclass(frozen=True)
class Plate(Shape):
    """A thin plate."""

    length: Annotated[float, metres("length in the plane")]
    width: Width
    tilt: Annotated[float, Number(-100, 100, "rad", "beta, 0 lying flat")] = 0.0

    def curve(self, elements: int):
        s = np.linspace(-0.5, 0.5, elements + 1)[:, None] * self.length
        return s * np.array([math.cos(self.tilt), math.sin(self.tilt)]), None


@dataclass(frozen=True)
class RoundRod(Shape):
    """A cylinder that lies across the plane (Fig. 8(a))."""

    radius: Annotated[float, metres("radius of the cylinder")]
    width: Width

    def curve(self, elements: int):
        return _arc(self.radius, 0.0, 2 * math.pi, elements)


@dataclass(frozen=True)
class HalfCylinder(Shape):
    """Half of a cylinder (Fig. 8(a)).

    flat (-): where its flat side is, "down" or "up"; the frame is at the middle of that side.
    """

    radius: Annotated[float, metres("radius of the cylinder")]
    width: Width
    flat: str = "down"

    def __post_init__(self):
        super().__post_init__()
        require(
            isinstance(self.flat, str) and self.flat in ("down", "up"),
            f"flat must be 'down' or 'up', got {shown(self.flat)}",
        )

    def curve(self, elements: int):
        round_part = max(FEWEST_ROUND // 2, round(elements * math.pi / (math.pi + 2)))
        begin = 0.0 if self.flat == "down" else math.pi
        points, bends = _arc(self.radius, begin, begin + math.pi, round_part)
        side = np.linspace(points[-1], points[0], max(1, elements - round_part) + 1)
        sign = 1.0 if self.flat == "up" else -1.0
        flat = np.broadcast_to([0.0, sign], (len(side) - 1, 2, 2))
        side[:, 1] = 0.0
        points[0, 1] = points[-1, 1] = 0.0
        side[-1], side[0] = points[0], points[-1]
        return np.concatenate([points, side[1:]]), np.concatenate([bends, flat])


@dataclass(frozen=True)
class SquareRod(Shape):
    """A square bar that lies across the plane, one side down (Fig. 8(a))."""

    side: Annotated[float, metres("side of the square")]
    width: Width

    def curve(self, elements: int):
        h = self.side / 2
        return _divided(np.array([[-h, -h], [h, -h], [h, h], [-h, h], [-h, -h]]), elements), None


@dataclass(frozen=True)
class CLeg(Shape):
    """A thin leg bent to an arc of a circle; hip and free end are 2 R apart whatever it bends by (Fig. 12(c)).

    A leg of positive curvature bulges backwards as it points down, and enters the grains with the bulge ahead as it turns
    at a positive rate; that the paper calls this one positive is assumed.
    """

    radius: HalfLength
    width: Width
    relative_curvature: Annotated[
        float,
        Number(
            -1, 1, "-",
            "R / r, r that of the arc: 1 for half a circle, 0 for a flat leg, negative for a reversed one, within +-1",
        ),
    ] = 1.0  # fmt: skip

    def curve(self, elements: int):
        c, s = self.relative_curvature, np.linspace(-1.0, 1.0, elements + 1)
        half = math.asin(c)  # of the angle by which the arc turns
        turned = half * s
        # Sines of s asin(c) over c, and (cos(s asin c) - cos(asin c)) over c, both regular as c -> 0.
        along = np.sinc(turned / np.pi) * s * (half / c if c else 1.0)
        across = 2 * np.sin((half + turned) / 2) * np.sin((half - turned) / 2) / c if c else 0.0 * s
        points = self.radius * np.stack([-across, -1.0 - along], -1)
        normal = np.stack([-np.cos(turned), -np.sin(turned)], -1)
        return points, np.stack([normal[:-1], normal[1:]], 1)


@dataclass(frozen=True)
class FlatLeg(Shape):
    """A thin straight leg of length 2 R."""

    radius: HalfLength
    width: Width

    def curve(self, elements: int):
        return CLeg(self.radius, self.width, 0.0).curve(elements)


@dataclass(frozen=True)
class Wheel(Shape):
    """A wheel with or without lugs: straight bars that stand off its rim, equally spaced."""

    radius: Annotated[float, metres("radius of the rim")]
    width: Width
    lugs: Annotated[int, Number(0, 200, "-", "number of lugs, 0 to 200", whole=True)] = 0
    lug_height: Annotated[float, metres("height of a lug; 0 without lugs", 0)] = 0.0
    lug_width: Annotated[float, metres("width of a lug; 0 without lugs", 0)] = 0.0

    def __post_init__(self):
        super().__post_init__()
        if not self.lugs:
            require(self.lug_height == self.lug_width == 0, "lug_height and lug_width need lugs: say how many")
            return
        for name in ("lug_height", "lug_width"):
            in_range(name, getattr(self, name), 1e-6, LARGEST, unit="m")
        room = 2 * self.radius * math.sin(math.pi / max(3, self.lugs))
        told = f"lug_width must be below {room:.3g} m, so that {self.lugs} lugs have room on the rim, got {self.lug_width:g}"
        require(self.lug_width < room, told)

    def curve(self, elements: int):
        if not self.lugs:
            return _arc(self.radius, 0.0, 2 * math.pi, elements)
        half = math.asin(self.lug_width / (2 * self.radius))  # of the angle that a lug takes of the rim
        pitch, top = 2 * math.pi / self.lugs, self.radius * math.cos(half) + self.lug_height
        rim = self.lugs * (pitch - 2 * half) * self.radius
        bars = self.lugs * (2 * self.lug_height + self.lug_width)
        each = max(1, round(elements * rim / (rim + bars) / self.lugs))
        bar = np.array([[self.radius * math.cos(half), -1], [top, -1], [top, 1], [self.radius * math.cos(half), 1]])
        bar = _divided(bar * [1.0, self.lug_width / 2], max(3, round(elements * bars / (rim + bars) / self.lugs)))
        points, bends = [], []
        for k in range(self.lugs):
            cos, sin = math.cos(k * pitch), math.sin(k * pitch)
            here = bar @ np.array([[cos, sin], [-sin, cos]])
            arc, normals = _arc(self.radius, k * pitch + half, (k + 1) * pitch - half, each)
            along = np.diff(here, axis=0)
            side = np.stack([along[:, 1], -along[:, 0]], -1) / np.hypot(*along.T)[:, None]
            points += [here, arc[1:-1]]
            bends += [np.repeat(side[:, None], 2, 1), normals]
        return np.concatenate([*points, points[0][:1]]), np.concatenate(bends)


@dataclass(frozen=True)
class Polygon(Shape):
    """Straight edges between points. points (m): (x, z) of each. closed (-): the last is joined to the first, and it has an
    inside."""

    points: tuple[tuple[float, float], ...]
    width: Width
    closed: bool = True

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "points", _listed(self.points, self.closed))
        Outline(_joined(self.points, self.closed), self.width)

    def curve(self, elements: int):
        return _divided(_joined(self.points, self.closed), elements), None


@dataclass(frozen=True)
class Spline(Shape):
    """A smooth curve through points, a cubic spline over the chords' length.

    points (m): (x, z) of each. closed (-): the last is joined to the first, and it has an inside.
    """

    points: tuple[tuple[float, float], ...]
    width: Width
    closed: bool = True

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "points", _listed(self.points, self.closed))
        Polygon(self.points, self.width, self.closed)
        self.outline(min(4 * len(self.points), MOST_ELEMENTS))  # it may cross where its chords do not

    def curve(self, elements: int):
        from scipy.interpolate import CubicSpline

        points = _joined(self.points, self.closed)
        s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        spline = CubicSpline(s, points, bc_type="periodic" if self.closed else "not-a-knot")
        at = np.linspace(0.0, s[-1], max(elements, FEWEST_ROUND) + 1)
        curve, along = spline(at), spline(at, 1)
        if self.closed:
            curve[-1], along[-1] = curve[0], along[0]
        normal = np.stack([along[:, 1], -along[:, 0]], -1) / np.hypot(*along.T)[:, None]
        bends = np.stack([normal[:-1], normal[1:]], 1)
        x, z = curve.T
        if self.closed and np.sum(x[:-1] * z[1:] - x[1:] * z[:-1]) < 0:
            bends = -bends  # an outline turns itself counter-clockwise, with these outwards
        return curve, bends


SHAPES = {
    "plate": Plate, "round-rod": RoundRod, "half-cylinder": HalfCylinder, "square-rod": SquareRod, "c-leg": CLeg,
    "flat-leg": FlatLeg, "wheel": Wheel, "polygon": Polygon, "spline": Spline,
}  # fmt: skip


def _arc(radius: float, begin: float, end: float, elements: int):
    """Counter-clockwise about the origin, with its outward normals; closed if it goes all the way round."""
    whole = end - begin > 6.28
    angle = np.linspace(begin, end, max(elements, FEWEST_ROUND if whole else 1) + 1)
    normal = np.stack([np.cos(angle), np.sin(angle)], -1)
    if whole:
        normal[-1] = normal[0]
    return radius * normal, np.stack([normal[:-1], normal[1:]], 1)


def _divided(points, elements: int):
    """Edges cut into equal pieces, each as many as its share of the whole length, rounded up."""
    lengths = np.hypot(*np.diff(points, axis=0).T)
    pieces = np.maximum(1, np.ceil(elements * lengths / lengths.sum() - 1e-9)).astype(int)
    cut = [np.linspace(a, b, k, endpoint=False) for a, b, k in zip(points[:-1], points[1:], pieces)]
    return np.concatenate([*cut, points[-1:]])


def _listed(points, closed) -> tuple[tuple[float, float], ...]:
    require(isinstance(closed, bool), f"closed must be true or false, got {shown(closed)}")
    array = real_array("points", points)
    require(array.ndim == 2 and array.shape[1] == 2, f"points must be a list of (x, z), got {shown(points)}")
    if closed and len(array) > 1 and (array[0] == array[-1]).all():
        array = array[:-1]
    fewest = 3 if closed else 2
    told = f"a {'closed' if closed else 'open'} outline takes {fewest} to {MOST_POINTS} points, got {len(array)}"
    require(fewest <= len(array) <= MOST_POINTS, told)
    require(bool((np.abs(array) <= LARGEST).all()), f"points must be finite and within {LARGEST:g} m")
    return tuple(map(tuple, array.tolist()))


def _joined(points, closed: bool):
    points = np.array(points)
    return np.concatenate([points, points[:1]]) if closed else points
