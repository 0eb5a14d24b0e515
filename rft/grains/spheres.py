"""Bodies of overlapping spheres on rigid links, for grains to touch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rft.bodies.base import Elements
from rft.core.checks import in_range
from rft.core.refusal import Refusal, require

# Distance of neighbouring spheres, in radii: between them the surface dips by
# 1 - sqrt(1 - 1/64) = 0.8 % of a radius.
SPACING = 0.25
MOST_SPHERES = 1e5  # of a bar or plate: more take minutes to place
SHAPES = ("round", "half round", "half round, flat up", "square")


class Bar:
    """The skeleton of one rigid link, as a body without joints."""

    joints = 0
    length = 1.0

    def motion(self, alpha: np.ndarray, alphadot: np.ndarray) -> Elements:
        zero = np.zeros((1, alpha.shape[1]), complex)
        return Elements.from_complex(
            1.0 + zero, zero, zero, zero.real, np.full((1, 1), 0.5)
        )


class Placement(NamedTuple):
    """Spheres of a body in the world: centres (n, 3), m, velocities (n, 3), m/s, and
    rates of rotation about z (n,), rad/s."""

    centres: np.ndarray
    velocities: np.ndarray
    rates: np.ndarray


class Links(NamedTuple):
    """Links (n,) in a body frame at rest: exp(i heading), rates, rad/s, centres, m, and
    their velocities, m/s, as complex numbers."""

    heading: np.ndarray
    rates: np.ndarray
    centres: np.ndarray
    velocities: np.ndarray


@dataclass(frozen=True, eq=False)
class Spheres:
    """A body of spheres on rigid links, in a plane of constant height.

    skeleton: body of `rft.bodies`, or `Bar`, whose shapes are its joint angles. size
    (m): its length. link: (n,), index of each sphere's link. offsets: (n, 3), m, centre
    of each sphere in its link's frame: along it from its middle, to its left, upwards.
    radius: (n,), m. half_width (m): largest distance of the surface from the links'
    axes. density (kg/m^3): mass over the volume pi half_width^2 length of the links; as
    the packed grains' if None. through: a bar that spans a periodic bed along x.

    Examples
    --------
    >>> from rft.grains import chain
    >>> import rft
    >>> swimmer = chain(rft.Chain((1, 1, 1)), size=0.162, radius=6e-3)
    >>> len(swimmer.radius), swimmer.ends
    (102, 0.006)
    """

    skeleton: Any
    size: float
    link: np.ndarray
    offsets: np.ndarray
    radius: np.ndarray
    half_width: float
    density: float | None = None
    through: bool = False

    @property
    def joints(self) -> int:
        """Number of shape variables."""
        return self.skeleton.joints

    @property
    def ends(self) -> float:
        """Length of either end of the body, m, where spheres form its cap."""
        return 0.0 if self.through else self.half_width

    @property
    def arc_length(self) -> np.ndarray:
        """Distance of each sphere from the middle of the body along its links, tail to
        head, (n,), m."""
        half = self.half_lengths
        starts = np.concatenate([[0.0], np.cumsum(2 * half)[:-1]]) - half.sum()
        return starts[self.link] + half[self.link] + self.offsets[:, 0]

    @property
    def half_lengths(self) -> np.ndarray:
        """Half lengths of the links, (links,), m."""
        zero = np.zeros((self.joints, 1))
        half = self.skeleton.motion(zero, zero).half[:, 0]
        return self.size * np.broadcast_to(half, (self.n_links,))

    @property
    def n_links(self) -> int:
        """Number of links."""
        return int(self.link.max()) + 1

    @property
    def bottom(self) -> float:
        """Lowest point of the surface over the axis, m."""
        return float((self.offsets[:, 2] - self.radius).min())

    @property
    def top(self) -> float:
        """Highest point of the surface over the axis, m."""
        return float((self.offsets[:, 2] + self.radius).max())

    def mass(self, bulk: float) -> float:
        """Return the mass, kg. bulk: density of the packed grains, kg/m^3, of a body
        without its own."""
        return (self.density or bulk) * math.pi * self.half_width**2 * self.size

    def links(self, alpha: np.ndarray, alphadot: np.ndarray) -> Links:
        """Return the links in the body frame at joint angles (joints,), rad, and rates,
        rad/s."""
        e = self.skeleton.motion(
            np.reshape(alpha, (-1, 1)), np.reshape(alphadot, (-1, 1))
        )
        heading = (e.c + 1j * e.s)[:, 0]
        rates = (e.v_w / e.half)[:, 0]
        velocities = (e.v_t + 1j * e.v_n)[:, 0] * heading
        return Links(
            heading, rates, self.size * e.centres[:, 0], self.size * velocities
        )

    def placement(
        self,
        links: Links,
        x: complex,
        theta: float,
        v: complex,
        rate: float,
        height: float,
    ) -> Placement:
        """Return the spheres in the world, for links whose body frame is at x (m) with
        heading theta (rad), and moves at v (m/s) and ``rate`` (rad/s).

        height: of the axis, m."""
        turn = np.exp(1j * theta)
        offset = self.offsets[:, 0] + 1j * self.offsets[:, 1]
        lever = links.heading[self.link] * offset
        p = turn * (links.centres[self.link] + lever)
        inner = turn * (
            links.velocities[self.link] + 1j * links.rates[self.link] * lever
        )
        velocity = v + 1j * rate * p + inner
        z = height + self.offsets[:, 2]
        centres = np.column_stack([(x + p).real, (x + p).imag, z])
        velocities = np.column_stack([velocity.real, velocity.imag, np.zeros(len(p))])
        return Placement(centres, velocities, rate + links.rates[self.link])

    def require_clearance(self, shapes: np.ndarray) -> None:
        """Raise ValueError if links touch, other than neighbours at their joint, at one
        of the shapes (B, joints), rad."""
        s = self.arc_length
        zero = np.zeros(self.joints)
        # Spheres so near along the body belong to one link or to neighbours.
        are_distant = np.abs(s[:, None] - s) > 8 * self.half_width
        reach = self.radius[:, None] + self.radius
        for alpha in shapes:
            links = self.links(alpha, zero)
            p = self.placement(links, 0.0, 0.0, 0.0, 0.0, 0.0).centres
            gap = np.linalg.norm(p[:, None] - p, axis=-1) - reach
            angles = ", ".join(f"{x:.2f}" for x in alpha)
            require(
                not bool((are_distant & (gap < 0)).any()),
                f"links touch at the shape ({angles}) rad",
                because="grains have no space between them",
                instead="use smaller joint angles or a thinner body",
            )


def chain(
    skeleton: Any, size: float, radius: float, density: float | None = None
) -> Spheres:
    """Return a body of straight round links with round ends.

    skeleton: body of straight links such as `rft.Chain`. size (m): its length from end
    to end. radius (m): of the links; the spheres at both ends are its caps. density
    (kg/m^3): as for `Spheres`.

    Examples
    --------
    >>> import rft
    >>> from rft.grains import chain
    >>> chain(rft.Chain((1, 2, 1)), size=0.2, radius=6e-3).half_lengths
    array([0.025, 0.05 , 0.025])
    """
    _check_sizes(size=size, radius=radius)
    if not hasattr(skeleton, "motion"):
        raise Refusal("a chain of spheres needs a body of rft.bodies", value=skeleton)
    zero = np.zeros((skeleton.joints, 1))
    half = size * skeleton.motion(zero, zero).half[:, 0]
    require(
        bool((half >= radius).all()),
        "links must be longer than their width",
        value=(2 * half).tolist(),
    )
    last = len(half) - 1
    x = [
        _link_centres(h, radius, is_first=k == 0, is_last=k == last)
        for k, h in enumerate(half)
    ]
    link = np.repeat(np.arange(len(half)), [len(centres) for centres in x])
    x = np.concatenate(x)
    return Spheres(
        skeleton,
        float(size),
        link,
        np.column_stack([x, np.zeros((len(x), 2))]),
        np.full(len(x), float(radius)),
        float(radius),
        density,
    )


def _link_centres(
    half: float, radius: float, is_first: bool, is_last: bool
) -> np.ndarray:
    """Return the places of spheres along a link from its middle, m.

    From joint to joint spheres stand at the middles of equal pieces. An end of the
    chain has a sphere a radius inside it."""
    low = -half + radius if is_first else -half
    high = half - radius if is_last else half
    n = max(2, math.ceil((high - low) / (SPACING * radius)))
    edges = np.linspace(low, high, n + 1)
    centres = (edges[1:] + edges[:-1]) / 2
    if is_first:
        centres = np.concatenate([edges[:1], centres])
    if is_last:
        centres = np.concatenate([centres, edges[-1:]])
    return centres


def rod(
    length: float,
    radius: float,
    shape: str = "round",
    through: bool = False,
    grain: float = 1e-3,
) -> Spheres:
    """Return a rigid bar along x.

    length (m): from end to end. radius (m): half its width. shape: one of `SHAPES`;
    "half round" lies on its flat side. A round bar that ends in the bed has round ends.
    through: it spans a periodic bed of that length, as bars of other shapes must. grain
    (m): radius of the spheres on the outline of a shape that is not round or spans the
    bed.

    Examples
    --------
    >>> from rft.grains import rod
    >>> len(rod(0.162, 6e-3).radius)
    102
    >>> len(rod(0.06, 8e-3, "half round", through=True).radius)
    2160
    """
    require(shape in SHAPES, f"shape must be one of {', '.join(SHAPES)}", value=shape)
    _check_sizes(grain if through else None, length=length, radius=radius)
    if not through:
        require(
            shape == "round",
            f"a {shape} bar has no ends here",
            instead="use through=True",
        )
        return chain(Bar(), length, radius)
    outline = _outline(shape, radius, grain)
    n = max(4, math.ceil(length / grain))
    x = (np.arange(n) + 0.5) / n * length - length / 2
    offsets = np.column_stack(
        [np.repeat(x, len(outline)), np.tile(outline, (len(x), 1))]
    )
    return _bar_through_bed(length, offsets, grain, half_width=radius)


def plate(
    length: float,
    height: float,
    tilt: float,
    grain: float = 1e-3,
    thickness: float | None = None,
) -> Spheres:
    """Return a thin plate that spans a periodic bed along x.

    length (m): of the bed. height (m): of the plate. tilt (rad): its angle about x; 0
    is upright, and the face that looks towards +y looks up where it is positive. grain
    (m): radius of its spheres. thickness (m): one layer of spheres if None; else two,
    first those of the face that looks towards +y, then those of the other, which
    separates the forces on both.

    Examples
    --------
    >>> from rft.grains import plate
    >>> wall = plate(length=0.06, height=0.03, tilt=0.0)
    >>> round(wall.top, 3), wall.through
    (0.015, True)
    """
    _check_sizes(grain, length=length, height=height)
    in_range("tilt", tilt, -10, 10, unit="rad")
    if thickness is None:
        layers = [0.0]
    else:
        in_range("thickness", thickness, 2 * grain, height, unit="m")
        layers = [thickness / 2 - grain, grain - thickness / 2]

    # From sphere to sphere along x, then layer by layer, up the plate.
    x = np.arange(math.ceil(length / grain)) * grain - length / 2 + grain / 2
    n = max(2, math.ceil(height / grain))
    s = ((np.arange(n) + 0.5) / n - 0.5) * (height - 2 * grain)
    q, x, s = (a.ravel() for a in np.meshgrid(layers, x, s, indexing="ij"))
    cos = math.cos(tilt)
    sin = math.sin(tilt)
    offsets = np.column_stack([x, q * cos - s * sin, q * sin + s * cos])
    return _bar_through_bed(length, offsets, grain, half_width=height / 2)


def _bar_through_bed(
    length: float, offsets: np.ndarray, grain: float, half_width: float
) -> Spheres:
    """Return a bar of spheres of radius ``grain``, m, that spans its bed."""
    n = len(offsets)
    return Spheres(
        Bar(),
        length,
        np.zeros(n, int),
        offsets,
        np.full(n, grain),
        half_width,
        through=True,
    )


def _check_sizes(grain: float | None = None, **sizes: float) -> None:
    """Raise ValueError unless sizes, m, are positive and bounded, and spheres of radius
    ``grain``, m, resolve the smallest and are not too many."""
    for name, value in sizes.items():
        in_range(name, value, 1e-6, 1e3, unit="m")
    if grain is not None:
        in_range("grain", grain, 1e-7, min(sizes.values()) / 3, unit="m")
        count = math.prod(value / grain for value in sizes.values())
        require(
            count <= MOST_SPHERES,
            f"about {count:.0e} spheres are too many",
            instead="use a larger ``grain``",
        )


def _outline(shape: str, radius: float, grain: float) -> np.ndarray:
    """Return the centres (n, 2), m, of spheres of radius ``grain``, m, on the outline
    of a section."""
    inner = radius - grain
    if shape == "round":
        n = math.ceil(2 * math.pi * inner / grain)
        angle = np.arange(n) / n * 2 * math.pi
        return inner * np.column_stack([np.cos(angle), np.sin(angle)])
    if shape == "square":
        return _square(inner, grain)
    outline = _half_disc(inner, grain) - [0.0, radius / 2]
    if shape.endswith("flat up"):
        return outline * [1.0, -1.0]
    return outline


def _square(half: float, grain: float) -> np.ndarray:
    """Return points (n, 2), m, ``grain`` apart or less, on a square."""
    s = np.linspace(-half, half, math.ceil(2 * half / grain) + 1)
    points = []
    for x in s:
        points += [(x, -half), (x, half)]
    for x in (-half, half):
        points += [(x, y) for y in s[1:-1]]
    return np.array(points)


def _half_disc(inner: float, grain: float) -> np.ndarray:
    """Return the centres (n, 2), m, of spheres on half a disc: on the arc of a radius
    ``inner``, and on its flat side, a sphere's radius inside."""
    least = math.asin(grain / inner)
    n = math.ceil(math.pi * inner / grain) + 1
    angle = np.linspace(least, math.pi - least, n)
    arc = inner * np.column_stack([np.cos(angle), np.sin(angle)])
    half = inner * math.cos(least)
    y = np.linspace(-half, half, math.ceil(2 * half / grain) + 1)[1:-1]
    flat = np.column_stack([y, np.full(len(y), grain)])
    return np.concatenate([arc, flat])
