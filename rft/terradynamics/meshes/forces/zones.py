"""Zones of the ground that have their own media, bounded by vertical planes, and the
share of a face in a zone.

A face across a boundary is shared between the zones by how far it reaches across.
Loads therefore change smoothly as a body crosses, and the shares of all zones add up to
1. All functions are formulas (`rft.formulas.vectors`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.formulas.vectors import formula, maximum, minimum
from rft.terradynamics.meshes.forces.contact import Part
from rft.terradynamics.meshes.forces.triples import dot, times


class Zones(NamedTuple):
    """Zones in order: a place belongs to the first zone that holds it, or else to the
    last, which has no planes and so holds every place.

    planes: (H, 3), a, b and c; a zone is where a x + b y > c for all of its planes,
    with x and y in the world, m, and a^2 + b^2 = 1. first: (Z + 1,), index of the first
    plane of each of Z zones, and H."""

    planes: np.ndarray
    first: np.ndarray


EVERYWHERE = Zones(np.zeros((0, 3)), np.zeros(2, np.int64))
NOWHERE = 0
PARTLY = 1
WHOLLY = 2


class Place(NamedTuple):
    """Pose of a body. turn: rotation from its frame to the world, (3, 3, ...). origin:
    (3, ...), m, in the world."""

    turn: np.ndarray
    origin: np.ndarray


@formula
def extent_in(zones, zone, x, y, radius):
    """Return how much of a disc around (x, y), m, lies in a zone: `NOWHERE`, `PARTLY`
    or `WHOLLY`; near corners of zones, `PARTLY` also where it is one of the others."""
    extent = 2
    for s in range(zone + 1):
        own = 2  # extent within the planes of zone s
        for h in range(zones.first[s], zones.first[s + 1]):
            a = zones.planes[h, 0]
            b = zones.planes[h, 1]
            distance = a * x + b * y - zones.planes[h, 2]
            if distance <= -radius:
                own = 0
            elif distance < radius:
                own = min(own, 1)
        if s < zone:
            own = 2 - own  # a zone begins where those before it end
        extent = min(extent, own)
    return extent


@formula
def share_in(zones, zone, face, place):
    """Return the share of faces of a body that lies in a zone, 0 to 1."""
    share = 1.0 + 0.0 * face.area
    for s in range(zone + 1):
        own = 1.0 + 0.0 * face.area  # share within the planes of zone s
        for h in range(zones.first[s], zones.first[s + 1]):
            a = zones.planes[h, 0]
            b = zones.planes[h, 1]
            offset = a * place.origin[0] + b * place.origin[1] - zones.planes[h, 2]
            normal = (
                a * place.turn[0, 0] + b * place.turn[1, 0],
                a * place.turn[0, 1] + b * place.turn[1, 1],
                a * place.turn[0, 2] + b * place.turn[1, 2],
            )
            own = own * share_beyond(face, normal, offset)
        if s == zone:
            share = share * own
        else:
            share = share * (1.0 - own)
    return share


@formula
def share_beyond(face, normal, offset):
    """Return the share of the extent of faces along a normal, in their frame, for which
    normal . x + offset > 0."""
    p = offset + dot(normal, (face.x1, face.y1, face.z1))
    q = offset + dot(normal, (face.x2, face.y2, face.z2))
    r = offset + dot(normal, (face.x3, face.y3, face.z3))
    high = maximum(maximum(p, q), r)
    low = minimum(minimum(p, q), r)
    return minimum(maximum(high, 0.0) / maximum(high - low, 1e-300), 1.0)


@formula
def share_of_part(part, share):
    """Return parts of faces with their area, depth and arms times a share."""
    depth = share * part.depth
    arms = times(share, part.arms)
    return Part(part.n, part.middle, share * part.area, depth, arms)
