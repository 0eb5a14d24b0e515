"""The contact of triangles with the ground: meshes, hulls, legs and geoms in three
dimensions.

On the part of a face below the surface the stress is that of
`rft.terradynamics.ground.base`, with the alpha of the velocity at the part's middle;
|z| and its moments are integrated exactly. Vectors are triples along any axes. All
functions but the last two are formulas (`rft.formulas.vectors`): they take numbers,
arrays that broadcast, and the vectors of compiled code."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from rft.formulas.vectors import absolute, formula, maximum, sqrt, where
from rft.laws.records import law_numbers, record_class
from rft.terradynamics.ground import inverse_speed, strength_at
from rft.terradynamics.meshes.forces.submerged import part_of_triangle
from rft.terradynamics.meshes.forces.triples import (
    AHEAD,
    AXES,
    UP,
    cross,
    dot,
    minus,
    plus,
    times,
    weighted_sum,
)


class FaceLaw(Protocol):
    """A law of three dimensions.

    grazing_sine: sine of the grazing angle. numbers: the numbers that the formulas
    read. The methods are formulas."""

    grazing_sine: float
    numbers: dict[str, float]

    def traction(self, n, v, up=UP) -> tuple:
        """Return the force per area and depth, N/m^3, on faces with outward unit
        normals n and unit velocities v, whether or not they lead; ``up`` is the unit
        vector upwards."""
        ...

    def traction_slope(self, n, v, up, k) -> tuple:
        """Return the slope of ``traction`` by the component of v along k, linear in
        k."""
        ...

    def lead_slope(self, n_dot_v, grazing_sine, sheet=False) -> Any:
        """Return the slope of ``lead`` by n_dot_v."""
        ...

    def lead(self, n_dot_v, grazing_sine, sheet=False) -> Any:
        """Return the share of the traction that faces bear, 0 to 1
        (`rft.terradynamics.ground.lead`). sheet: whether either side may lead."""
        ...


class Face(NamedTuple):
    """A triangle in the frame of its body.

    x1 to z3: corners (x, y, z), m. nx, ny, nz: outward unit normal. area: m^2, negative
    where the corners run clockwise about the normal. sheet: 1 for a face of a thin
    sheet, of which either side may lead, else 0."""

    x1: float
    y1: float
    z1: float
    x2: float
    y2: float
    z2: float
    x3: float
    y3: float
    z3: float
    nx: float
    ny: float
    nz: float
    area: float
    sheet: float


class Part(NamedTuple):
    """The part of a face below the surface.

    n: outward unit normal. middle: from the origin, m. area: m^2. depth: integral of
    |z| over the part, m^3. arms: integral of |z| times the vector from the origin,
    m^4."""

    n: tuple
    middle: tuple
    area: float
    depth: float
    arms: tuple


class Motion(NamedTuple):
    """Motion of a body; all vectors are along the same axes.

    velocity: of the origin, m/s. spin: angular velocity, rad/s. x, height: of the
    origin along the world's x axis and above the surface, m. up, ahead: unit vectors
    upwards and along the world's x axis."""

    velocity: tuple
    spin: tuple
    x: float = 0.0
    up: tuple = UP
    ahead: tuple = AHEAD
    height: float = 0.0


@formula
def corner_heights(face, motion):
    """Return the heights, m, of a face's corners above the surface."""
    up = motion.up
    return (
        motion.height + dot(up, (face.x1, face.y1, face.z1)),
        motion.height + dot(up, (face.x2, face.y2, face.z2)),
        motion.height + dot(up, (face.x3, face.y3, face.z3)),
    )


@formula
def corners_and_normal(face):
    """Return the three corners of a face, m, and its outward unit normal."""
    return (
        (face.x1, face.y1, face.z1),
        (face.x2, face.y2, face.z2),
        (face.x3, face.y3, face.z3),
        (face.nx, face.ny, face.nz),
    )


@formula
def part_below(face, heights):
    """Return the `Part` of a face below the surface, from the heights of its corners,
    m."""
    share, middle, moments = part_of_triangle(-heights[0], -heights[1], -heights[2])
    a, b, c, n = corners_and_normal(face)
    depth = face.area * (moments[0] + moments[1] + moments[2])
    arms = times(face.area, weighted_sum(moments, a, b, c))
    return Part(n, weighted_sum(middle, a, b, c), face.area * share, depth, arms)


@formula
def whole_part(face, heights):
    """Return `part_below` of a face that is entirely below the surface."""
    a, b, c, n = corners_and_normal(face)
    d1 = -heights[0]
    d2 = -heights[1]
    d3 = -heights[2]
    total = d1 + d2 + d3
    third = 1.0 / 3.0
    moments = (d1 + total) / 12.0, (d2 + total) / 12.0, (d3 + total) / 12.0
    middle = weighted_sum((third, third, third), a, b, c)
    depth = face.area * (moments[0] + moments[1] + moments[2])
    arms = times(face.area, weighted_sum(moments, a, b, c))
    return Part(n, middle, face.area, depth, arms)


@formula
def velocity_of_middle(part, motion):
    """Return the velocity of a part's middle, m/s."""
    return plus(motion.velocity, cross(motion.spin, part.middle))


@formula
def load(law, ground, part, motion, v, sheet):
    """Return force, N, moment about the origin, N m, and stress per depth, N/m^3, of
    the grains on a part of a face.

    v: `velocity_of_middle`. sheet: whether the face is one of a thin sheet, of which
    either side may lead."""
    n = part.n
    speed = sqrt(dot(v, v))
    across = dot(n, v)
    slowness = inverse_speed(ground, speed)
    unit = times(1.0 / where(speed == 0.0, 1.0, speed), v)

    share = speed * slowness * law.lead(across * slowness, ground.grazing_sine, sheet)
    if ground.downhill_loss == 0.0 and len(ground.disturbed) == 0:
        share = share * ground.strength
    else:
        x = motion.x + dot(motion.ahead, part.middle)
        share = share * strength_at(ground, x, dot(motion.ahead, unit))
    stress = times(share, law.traction(n, unit, motion.up))
    force = times(part.depth, stress)
    moment = cross(part.arms, stress)

    if ground.flux != 0.0:
        across = where(sheet, across, maximum(across, 0.0))
        push = times(ground.flux * across * absolute(across) * part.area, n)
        force = minus(force, push)
        moment = minus(moment, cross(part.middle, push))
    return force, moment, stress


class SlopeTerms(NamedTuple):
    """Terms of the slopes of a part's load by its velocity (see `load_with_slopes`).

    unit: of the velocity. full_traction: with the ground's strength, N/m^3. by_unit,
    by_n: slopes of the share of the traction, s/m, along the velocity and along the
    normal.
    by_direction: slope of the load by the direction of the traction, s/m. strength: of
    the ground. loss: relative loss of the strength by motion ahead. flow: flux x area x
    speed across, kg/s."""

    unit: tuple
    full_traction: tuple  # compiled code takes ``traction`` for a law's formula
    by_unit: float
    by_n: float
    by_direction: float
    strength: float
    loss: float
    flow: float


@formula
def _slopes_along(law, part, motion, terms, k):
    """Return the slopes of force and moment by the component of the velocity along the
    unit vector k."""
    u_k = dot(terms.unit, k)
    n_k = dot(part.n, k)
    sideways = minus(k, times(u_k, terms.unit))
    share = terms.by_unit * u_k + terms.by_n * n_k
    share = share - terms.by_direction * terms.loss * dot(motion.ahead, sideways)
    turning = law.traction_slope(part.n, terms.unit, motion.up, sideways)
    slope = plus(
        times(share, terms.full_traction),
        times(terms.by_direction * terms.strength, turning),
    )
    push = times(2.0 * terms.flow * n_k, part.n)
    return (
        minus(times(part.depth, slope), push),
        minus(cross(part.arms, slope), cross(part.middle, push)),
    )


@formula
def load_with_slopes(law, ground, part, motion, v, sheet):
    """Return force and moment of `load`, and their slopes by the components x, y, z of
    v: three triples each.

    With s = 1 / sqrt(v^2 + rounding^2), the unit vector u of v and x = s n . v, the
    stress is S = |v| s lead(x) T(u), so that

        dS = T (lead s (1 - |v|^2 s^2) u . dv + |v| s lead' dx)
             + s lead dT (dv - u u . dv),
        dx = s (n - x |v| s u) . dv.
    """
    n = part.n
    speed = sqrt(dot(v, v))
    across = dot(n, v)
    slowness = inverse_speed(ground, speed)
    unit = times(1.0 / where(speed == 0.0, 1.0, speed), v)
    rounded_speed = speed * slowness  # |v| s
    leading = across * slowness  # x
    lead = law.lead(leading, ground.grazing_sine, sheet)
    lead_slope = law.lead_slope(leading, ground.grazing_sine, sheet)

    strength = ground.strength
    loss = 0.0
    if not (ground.downhill_loss == 0.0 and len(ground.disturbed) == 0):
        along = dot(motion.ahead, unit)
        strength = strength_at(ground, motion.x + dot(motion.ahead, part.middle), along)
        lost = maximum(ground.downhill_loss * along, 0.0)
        loss = where(lost > 0.0, ground.downhill_loss / (1.0 - lost), 0.0)
    traction = times(strength, law.traction(n, unit, motion.up))
    stress = times(rounded_speed * lead, traction)
    force = times(part.depth, stress)
    moment = cross(part.arms, stress)

    by_n = rounded_speed * lead_slope * slowness
    by_unit = lead * slowness * (1.0 - rounded_speed * rounded_speed)
    by_unit = by_unit - by_n * leading * rounded_speed

    flow = 0.0 * across
    if ground.flux != 0.0:
        flow = ground.flux * part.area * where(sheet, across, maximum(across, 0.0))
        push = times(flow * absolute(across), n)
        force = minus(force, push)
        moment = minus(moment, cross(part.middle, push))

    by_direction = lead * slowness
    terms = SlopeTerms(
        unit, traction, by_unit, by_n, by_direction, strength, loss, absolute(flow)
    )
    fx, mx = _slopes_along(law, part, motion, terms, AXES[0])
    fy, my = _slopes_along(law, part, motion, terms, AXES[1])
    fz, mz = _slopes_along(law, part, motion, terms, AXES[2])
    return force, moment, (fx, fy, fz), (mx, my, mz)


def record(law: FaceLaw):
    """Return the record of a law for compiled code: its numbers and its formulas."""
    names = "traction", "traction_slope", "lead", "lead_slope"
    formulas = tuple((name, getattr(type(law), name)) for name in names)
    numbers = law_numbers(law)
    Record = record_class(type(law).__name__, tuple(numbers), formulas)
    return Record(*numbers.values())


def faces(
    corners: np.ndarray, normals: np.ndarray, sheet: np.ndarray | bool = False
) -> Face:
    """Return the faces (T,) with corners (T, 3, 3), m, and outward unit normals (T, 3).
    sheet: whether they belong to a thin sheet, of which either side may lead."""
    a, b, c = corners.swapaxes(0, 1)
    across = np.cross(b - a, c - a)
    area = np.copysign(np.linalg.norm(across, axis=1) / 2, (across * normals).sum(1))
    is_sheet = np.broadcast_to(sheet, area.shape).astype(float)
    return Face(*a.T, *b.T, *c.T, *normals.T, area, is_sheet)
