"""The contact of a straight element with the ground: intruders, legs and bellies of the vertical plane (Eq. 4).

An element is cut where it crosses the surface and where it begins to lead. The part that is below and leads bears, at
its middle, the stress of `rft.ground.base`. All functions but the last three are formulas (`rft.vectors`): they take
numbers, arrays that broadcast, and the vectors of compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.ground.base import per_speed, share
from rft.ground.lead import mean_ramp, rounded
from rft.laws.records import law_numbers, record_class
from rft.plates.outline import Outline
from rft.plates.stress import PER_CUBIC_METRE, PlateStress, alpha
from rft.vectors import absolute, formula, is_formula, maximum, minimum, sqrt, where

ROUNDOFF = 1e-14  # of its speed, within which a face slides along itself and does not lead


class Element(NamedTuple):
    """Ends (x, z) of an element and the unit normals there, in the frame of its body, m; its area, m^2."""

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
    """Place (x, z) of a frame's origin, z = 0 the surface, cosine and sine of its angle about y, velocity of its origin
    and rate, SI units."""

    x: float
    z: float
    cos: float
    sin: float
    v_x: float
    v_z: float
    rate: float


class Part(NamedTuple):
    """What of an element is below the surface and leads. arm: from the frame's origin to its middle, m. depth: of that,
    m, 0 if there is no such part. area: m^2. n, v: unit normal, of either side where both are one part, and unit
    velocity of its middle. speed: m/s. first, last: the part's ends, 0 to 1 along the element."""

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
def between(a, b, t):
    """Return what is at t, 0 to 1, on the way from a to b."""
    return a + t * (b - a)


@formula
def negative_part(a, b):
    """Return the first and last place, 0 to 1, where what goes evenly from a to b is negative; first > last if
    nowhere."""
    fall = a - b
    zero = a / where(fall == 0.0, 1.0, fall)
    return where(a < 0.0, 0.0, where(b < 0.0, zero, 1.0)), where(b < 0.0, 1.0, where(a < 0.0, zero, 0.0))


@formula
def turned(x, z, g):
    """Return a vector of the body's frame along the world's axes."""
    return g.cos * x + g.sin * z, g.cos * z - g.sin * x


@formula
def speeds_across(e, g, side):
    """Return the speeds across the face at both ends of an element, and what of them may be roundoff."""
    v_x, v_z = g.cos * g.v_x - g.sin * g.v_z, g.cos * g.v_z + g.sin * g.v_x
    across1 = e.nx1 * v_x + e.nz1 * v_z + g.rate * (e.nx1 * e.z1 - e.nz1 * e.x1)
    across2 = e.nx2 * v_x + e.nz2 * v_z + g.rate * (e.nx2 * e.z2 - e.nz2 * e.x2)
    size = absolute(v_x) + absolute(v_z) + absolute(g.rate) * (absolute(e.x1) + absolute(e.z1))
    return side * across1, side * across2, ROUNDOFF * size


@formula
def leading_part(e, g, side, faces):
    """Return the `Part` of an element of a body in motion. side: 1 or -1, the face along or against the normal that
    counts, 0: whichever leads. faces: whether any side is not 0."""
    first, last = negative_part(g.z + g.cos * e.z1 - g.sin * e.x1, g.z + g.cos * e.z2 - g.sin * e.x2)
    if faces:
        across1, across2, roundoff = speeds_across(e, g, side)
        behind = where(side == 0.0, -1.0, roundoff)
        begins, stops = negative_part(behind - across1, behind - across2)
        first, last = maximum(first, begins), minimum(last, stops)
    share, t = maximum(last - first, 0.0), 0.5 * (first + last)
    a_x, a_z = turned(between(e.x1, e.x2, t), between(e.z1, e.z2, t), g)
    n_x, n_z = turned(between(e.nx1, e.nx2, t), between(e.nz1, e.nz2, t), g)
    v_x, v_z = g.v_x + g.rate * a_z, g.v_z - g.rate * a_x
    speed, outward = sqrt(v_x * v_x + v_z * v_z), where(side < 0.0, -1.0, 1.0) / sqrt(n_x * n_x + n_z * n_z)
    per = 1.0 / where(speed == 0.0, 1.0, speed)
    depth = where(share > 0.0, -(g.z + a_z), 0.0)
    n, v = (outward * n_x, outward * n_z), (per * v_x, per * v_z)
    return Part((a_x, a_z), depth, e.area * share, n, v, speed, first, last)


@formula
def load(law, ground, e, g, side, faces, rests):
    """Return the `Force` of the grains on an element: area x depth x stress x lead, and the push of what leads.

    side, faces: see `leading_part`. rests: whether the lead is that of the part's middle, smooth where a body comes to
    rest; else it is the mean over the part of one that rises in proportion."""
    p = leading_part(e, g, side, faces)
    across, per = p.speed * (p.n[0] * p.v[0] + p.n[1] * p.v[1]), per_speed(ground, p.speed)
    stress = PER_CUBIC_METRE * p.depth * p.speed * per * share(ground, g.x + p.arm[0], p.v[0])
    if faces and rests:
        stress = stress * where(side == 0.0, 1.0, rounded(per * across, ground.sine))
    elif faces and ground.sine > 0.0:
        across1, across2, _ = speeds_across(e, g, side)
        begin, end = between(across1, across2, p.first), between(across1, across2, p.last)
        stress = stress * mean_ramp(per * begin, per * end, ground.sine)
    a_x, a_z = alpha(law, p.n, p.v)
    push = where(p.depth > 0.0, ground.flux * across * absolute(across), 0.0)
    f_x, f_z = -p.area * (stress * a_x + push * p.n[0]), p.area * (stress * a_z - push * p.n[1])
    return Force(f_x, f_z, p.arm[1] * f_x - p.arm[0] * f_z)


def record(law: PlateStress):
    """Return the record of a stress map: its numbers, and formulas of them, which both drivers take."""
    if not is_formula(type(law).alpha_ahead):
        return law
    numbers = law_numbers(law) | {"cut": law.cut}
    formulas = (("alpha_ahead", type(law).alpha_ahead),)
    return record_class(type(law).__name__, tuple(numbers), formulas)(*numbers.values())


def elements(outline: Outline) -> Element:
    """Return the elements of an outline, (E,)."""
    p, n = outline.points, outline.end_normals
    numbers = *p[:-1].T, *p[1:].T, *n[:, 0].T, *n[:, 1].T
    return Element(*np.ascontiguousarray(numbers), outline.width * outline.lengths)


def sides(closed: bool, tension: str) -> tuple[float, ...]:
    """Return the sides to sum: the outer one; both of a sheet at once, or one by one where it matters which leads."""
    return (1.0,) if closed else (0.0,) if tension == "keep" else (1.0, -1.0)
