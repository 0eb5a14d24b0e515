"""Zones of the ground with media of their own, bounded by vertical planes, and the share of a face in a zone.

A face across a boundary is shared between the zones by how far it reaches across, so that loads change smoothly as a body
crosses and the shares of all zones add up to 1. All functions are formulas (`rft.formulas.vectors`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.formulas.vectors import formula, maximum, minimum
from rft.terradynamics.meshes.contact import Part
from rft.terradynamics.meshes.triples import dot, times


class Zones(NamedTuple):
    """Zones in order: a place belongs to the first of them that holds it, and beyond all to the last, which has no planes.

    planes: (H, 3), a, b and c; a zone is where a x + b y > c for all of its planes, x and y in the world, m, a^2 + b^2 = 1.
    first: (Z + 1,), index of the first plane of each of Z zones, the last one without planes, and H."""

    planes: np.ndarray
    first: np.ndarray


EVERYWHERE = Zones(np.zeros((0, 3)), np.zeros(2, np.int64))
NOWHERE, PARTLY, WHOLLY = 0, 1, 2


class Place(NamedTuple):
    """Where a body is: rotation from its frame to the world, (3, 3, ...), and its origin (3, ...), m."""

    turn: np.ndarray
    origin: np.ndarray


@formula
def extent_in(zones, zone, x, y, radius):
    """Return whether a disc around (x, y), m, lies in a zone: `NOWHERE`, `PARTLY` or `WHOLLY`; nearby, `PARTLY` in doubt."""
    extent = 2
    for s in range(zone + 1):
        own = 2
        for h in range(zones.first[s], zones.first[s + 1]):
            distance = (
                zones.planes[h, 0] * x + zones.planes[h, 1] * y - zones.planes[h, 2]
            )
            own = min(own, 0 if distance <= -radius else 1 if distance < radius else 2)
        extent = min(extent, own if s == zone else 2 - own)
    return extent


@formula
def share_in(zones, zone, face, place):
    """Return the share of faces of a body that lies in a zone, 0 to 1."""
    share = 1.0 + 0.0 * face.area
    for s in range(zone + 1):
        own = 1.0 + 0.0 * face.area
        for h in range(zones.first[s], zones.first[s + 1]):
            a, b = zones.planes[h, 0], zones.planes[h, 1]
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
    """Return the share of the length of faces along a normal, in their frame, on which normal . x + offset > 0."""
    p = offset + dot(normal, (face.x1, face.y1, face.z1))
    q = offset + dot(normal, (face.x2, face.y2, face.z2))
    r = offset + dot(normal, (face.x3, face.y3, face.z3))
    high, low = maximum(maximum(p, q), r), minimum(minimum(p, q), r)
    return minimum(maximum(high, 0.0) / maximum(high - low, 1e-300), 1.0)


@formula
def shared(part, share):
    """Return a share of parts of faces."""
    return Part(
        part.n,
        part.middle,
        share * part.area,
        share * part.depth,
        times(share, part.arms),
    )
