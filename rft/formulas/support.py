"""What touches the ground, and whether it supports the body or lets it tip over."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

TOUCHES = 0.5  # weight of contact from which a part counts as support
DIRECTIONS = 360  # of the lines that bound the support


class ContactState(NamedTuple):
    """Contact of B shapes of a body of n parts, its links or its legs.

    weight: (B, n), 0 to 1. load: (B, n), on a part, over the mean load of the body;
    where the body is buried that is its weight of contact. margin: (B,), how far the
    centre of mass lies inside the support, body lengths; negative outside
    (`support_margin`)."""

    weight: np.ndarray
    load: np.ndarray
    margin: np.ndarray


def support_margin(
    weights: np.ndarray,
    fraction: np.ndarray,
    centres: np.ndarray,
    along: np.ndarray,
    width: float = 0.0,
    shift: np.ndarray | complex = 0.0,
) -> np.ndarray:
    """Return how far (B,) the centre of mass lies inside the support, the convex hull
    of the parts that touch; negative outside, in body lengths.

    weights: (n, B), of contact; a part supports from a weight of 0.5. fraction: (n, 1),
    of the body's length. centres: (n, B), x + i y. along: (n, B), exp(i theta) of the
    headings. width: of the body. shift: (B,), by which the centre of mass is seen from
    the ground downhill, its height times the tangent of the slope, x + i y. The
    distance is that to the nearest of the lines in 360 directions that bound the
    hull: 4e-5 of the support's size too large at most."""
    middle = (fraction * centres).sum(0) + shift
    aside = 0.5j * width * along
    places = np.concatenate([centres + aside, centres - aside]) - middle
    touches = np.concatenate([weights, weights]) >= TOUCHES
    margin = np.full(places.shape[-1], np.inf)
    for angle in 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
        reach = np.where(touches, (places * np.exp(-1j * angle)).real, -np.inf)
        margin = np.minimum(margin, reach.max(0))
    return margin
