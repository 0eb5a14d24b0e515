"""Distances between links, where models of the fluid end."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import body_size
from rft.bodies.links import Links


def clearance(body: Links, alpha: ArrayLike) -> np.ndarray:
    """Return the shortest distance (...) at shapes (..., d) between the centre lines of
    links that are not neighbours, or between the free end of a link and its neighbour,
    in body lengths; 0 where two links cross.

    Neighbours overlap at their joint in any shape, so that only their other ends
    count."""
    ends = body.points(alpha) / body_size(body)
    ends = ends[..., 0] + 1j * ends[..., 1]
    start = ends[..., :-1]
    stop = ends[..., 1:]
    n = start.shape[-1]
    distances = []
    for i, j in itertools.combinations(range(n), 2):
        first = (start[..., i], stop[..., i])
        second = (start[..., j], stop[..., j])
        if j == i + 1:
            distances.append(_to_line(first[0], *second))
            distances.append(_to_line(second[1], *first))
            continue
        between = [_to_line(end, *second) for end in first]
        between += [_to_line(end, *first) for end in second]
        least = np.minimum.reduce(between)
        distances.append(np.where(_cross(*first, *second), 0.0, least))
    return np.minimum.reduce(distances)


def _to_line(point, start, stop):
    """Return the distance from a point to a link between two ends."""
    along = stop - start
    share = ((point - start) * along.conj()).real / np.abs(along) ** 2
    return np.abs(point - start - np.clip(share, 0, 1) * along)


def _cross(a, b, c, d):
    """Return whether the links a b and c d cross."""

    def side(p, q, r):
        return ((q - p).conj() * (r - p)).imag

    apart = side(a, b, c) * side(a, b, d) < 0
    return apart & (side(c, d, a) * side(c, d, b) < 0)
