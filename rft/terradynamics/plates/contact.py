"""The contact of straight elements with the ground, for intruders, legs and bellies in
the vertical plane (Eq. 4).

An element ``e`` with the motion ``g`` is cut where it crosses the surface and where it
begins to lead. The part that is below and leads bears the stress of
`rft.terradynamics.ground.base` at its middle. All functions but the last three are
formulas (`rft.formulas.vectors`): they take numbers, arrays that broadcast, and the
vectors of compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.formulas.vectors import (
    absolute,
    formula,
    is_formula,
    maximum,
    minimum,
    sqrt,
    where,
)
from rft.laws.records import law_numbers, record_class
from rft.terradynamics.ground.base import inverse_speed, strength_at
from rft.terradynamics.ground.lead import mean_ramp, rounded_step
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.plates.stress import PER_CUBIC_METRE, PlateStress, alpha

# Of the speed of a face: with a smaller speed along its normal it slides along itself
# and does not lead.
ROUNDOFF = 1e-14


class Element(NamedTuple):
    """Ends (x, z) of an element and the unit normals there, in the frame of its body,
    m; its area, m^2."""

    x1: float
    z1: float
    x2: float
    z2: float
    nx1: float
    nz1: float
    nx2: float
    nz2: float
    area: float


class Motion(NamedTuple):
    """Position (x, z) of a frame's origin, z = 0 the surface; cosine and sine of its
    angle about y; velocity of its origin; rate of its angle. SI units."""

    x: float
    z: float
    cos: float
    sin: float
    v_x: float
    v_z: float
    rate: float


class Part(NamedTuple):
    """The part of an element that is below the surface and leads, in the world.

    arm: from the frame's origin to the middle of the part, m. depth: of the middle, m;
    0 where there is no such part. area: m^2. n: unit normal at the middle, of either
    side where both sides are summed at once. v, speed: unit velocity and speed of the
    middle, m/s. first, last: ends of the part, 0 to 1 along the element.

    Examples
    --------
    >>> from rft.terradynamics.plates import Plate, parts
    >>> plate = Plate(length=0.04, width=0.02).outline(2)
    >>> part = parts(plate, [0.0, -0.05, 0.0], [0.0, -0.01, 0.0])
    >>> part.depth, part.area  # m, m^2
    (array([0.05, 0.05]), array([0.0004, 0.0004]))
    """

    arm: tuple[float, float]
    depth: float
    area: float
    n: tuple[float, float]
    v: tuple[float, float]
    speed: float
    first: float
    last: float


class Force(NamedTuple):
    """Force (x, z), N, and moment about the frame's origin, N m."""

    x: float
    z: float
    moment: float


@formula
def interpolate(a, b, t):
    """Return a + t (b - a), with t from 0 to 1."""
    return a + t * (b - a)


@formula
def negative_part(a, b):
    """Return the ends, 0 to 1, of the interval where a linear function from a to b is
    negative; first > last where it is nowhere."""
    drop = a - b
    zero = a / where(drop == 0.0, 1.0, drop)
    first = where(a < 0.0, 0.0, where(b < 0.0, zero, 1.0))
    last = where(b < 0.0, 1.0, where(a < 0.0, zero, 0.0))
    return first, last


@formula
def world_components(x, z, g):
    """Return the components along the world's axes of a vector (x, z) in the body's
    frame."""
    return g.cos * x + g.sin * z, g.cos * z - g.sin * x


@formula
def speeds_across(e, g, side):
    """Return the speeds, m/s, along the normals at both ends of an element, and a bound
    of their roundoff."""
    v_x = g.cos * g.v_x - g.sin * g.v_z
    v_z = g.cos * g.v_z + g.sin * g.v_x
    across1 = e.nx1 * v_x + e.nz1 * v_z + g.rate * (e.nx1 * e.z1 - e.nz1 * e.x1)
    across2 = e.nx2 * v_x + e.nz2 * v_z + g.rate * (e.nx2 * e.z2 - e.nz2 * e.x2)
    size = (
        absolute(v_x)
        + absolute(v_z)
        + absolute(g.rate) * (absolute(e.x1) + absolute(e.z1))
    )
    return side * across1, side * across2, ROUNDOFF * size


@formula
def leading_part(e, g, side, one_sided):
    """Return the `Part` of an element.

    side: 1 or -1 for the face along or against the normal alone, 0 for whichever leads.
    one_sided: whether any side is not 0."""
    height1 = g.z + g.cos * e.z1 - g.sin * e.x1
    height2 = g.z + g.cos * e.z2 - g.sin * e.x2
    first, last = negative_part(height1, height2)
    if one_sided:
        across1, across2, roundoff = speeds_across(e, g, side)
        least = where(side == 0.0, -1.0, roundoff)  # speed across of a face that leads
        first_leading, last_leading = negative_part(least - across1, least - across2)
        first = maximum(first, first_leading)
        last = minimum(last, last_leading)
    share = maximum(last - first, 0.0)
    middle = 0.5 * (first + last)

    a_x, a_z = world_components(
        interpolate(e.x1, e.x2, middle), interpolate(e.z1, e.z2, middle), g
    )
    depth = where(share > 0.0, -(g.z + a_z), 0.0)
    n_x, n_z = world_components(
        interpolate(e.nx1, e.nx2, middle), interpolate(e.nz1, e.nz2, middle), g
    )
    to_unit = where(side < 0.0, -1.0, 1.0) / sqrt(n_x * n_x + n_z * n_z)
    n = to_unit * n_x, to_unit * n_z

    v_x = g.v_x + g.rate * a_z
    v_z = g.v_z - g.rate * a_x
    speed = sqrt(v_x * v_x + v_z * v_z)
    slowness = 1.0 / where(speed == 0.0, 1.0, speed)
    v = slowness * v_x, slowness * v_z
    return Part((a_x, a_z), depth, e.area * share, n, v, speed, first, last)


@formula
def load(law, ground, e, g, side, one_sided, lead_of_middle):
    """Return the `Force` of the grains on an element: area x depth x stress x lead, and
    the grains' inertia.

    side, one_sided: see `leading_part`. lead_of_middle: True for the lead
    `rounded_step` at the part's middle, which is smooth where a body comes to rest;
    False for the mean over the part of a lead that rises linearly."""
    p = leading_part(e, g, side, one_sided)
    across = p.speed * (p.n[0] * p.v[0] + p.n[1] * p.v[1])
    slowness = inverse_speed(ground, p.speed)
    strength = strength_at(ground, g.x + p.arm[0], p.v[0])
    stress = PER_CUBIC_METRE * p.depth * p.speed * slowness * strength

    if one_sided and lead_of_middle:
        lead = rounded_step(slowness * across, ground.grazing_sine)
        stress = stress * where(side == 0.0, 1.0, lead)
    elif one_sided and ground.grazing_sine > 0.0:
        across1, across2, _ = speeds_across(e, g, side)
        first = interpolate(across1, across2, p.first)
        last = interpolate(across1, across2, p.last)
        lead = mean_ramp(slowness * first, slowness * last, ground.grazing_sine)
        stress = stress * lead

    a_x, a_z = alpha(law, p.n, p.v)
    push = where(p.depth > 0.0, ground.flux * across * absolute(across), 0.0)
    f_x = -p.area * (stress * a_x + push * p.n[0])
    f_z = p.area * (stress * a_z - push * p.n[1])
    return Force(f_x, f_z, p.arm[1] * f_x - p.arm[0] * f_z)


def record(law: PlateStress):
    """Return the record of a stress map for both drivers, with its numbers and its
    formulas; a map whose `alpha_ahead` is no formula is returned itself."""
    if not is_formula(type(law).alpha_ahead):
        return law
    numbers = law_numbers(law) | {"cut": law.cut}
    formulas = (("alpha_ahead", type(law).alpha_ahead),)
    Record = record_class(type(law).__name__, tuple(numbers), formulas)
    return Record(*numbers.values())


def elements(outline: Outline) -> Element:
    """Return the elements (E,) of an outline."""
    points = outline.points
    normals = outline.end_normals
    numbers = *points[:-1].T, *points[1:].T, *normals[:, 0].T, *normals[:, 1].T
    return Element(*np.ascontiguousarray(numbers), outline.width * outline.lengths)


def sides(closed: bool, tension: str) -> tuple[float, ...]:
    """Return the sides of elements to sum over: the outer one of a closed outline, 1;
    both sides of a sheet at once, 0, or one after the other, 1 and -1, where tension is
    cut, which depends on the side that leads."""
    if closed:
        return (1.0,)
    if tension == "keep":
        return (0.0,)
    return (1.0, -1.0)
