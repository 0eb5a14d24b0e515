"""What touches the ground, and with how much load, as a body moves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.bodies.base import half_lengths
from rft.bodies.pieces import PIECES, subdivide
from rft.contacts.support import support_margin
from rft.contacts.touching import Touching


class ContactState(NamedTuple):
    """Contact of B shapes of a body of n elements.

    weight: (B, n), 0 to 1. load: (B, n), on an element's length, over the mean load of
    the body; where the body is buried that is its weight of contact. margin: (B,), how
    far the centre of mass lies inside the support, body lengths; negative outside
    (`support_margin`)."""

    weight: np.ndarray
    load: np.ndarray
    margin: np.ndarray


def contact_state(
    body: Touching,
    alpha: np.ndarray,
    shift: np.ndarray | complex = 0.0,
    pieces: int = PIECES,
) -> ContactState:
    """Return the contact of a body at shapes (B, joints).

    shift: (B,), as of `support_margin`. pieces: to a body length, into which elements
    are cut, and over which weights and loads of an element are means.

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Chain
    >>> from rft.contacts import LinkContact, Touching, contact_state
    >>> feet = LinkContact(links=((0.0, 0.6), (), (0.5, 0.1)), bearing="normalised")
    >>> body = Touching(Chain(), feet)
    >>> state = contact_state(body, np.array([[0.3, 0.3, np.pi / 2]]))
    >>> state.weight, state.load  # of a body that rests on its tail link
    (array([[1., 0., 0.]]), array([[3., 0., 0.]]))
    """
    shapes = np.ascontiguousarray(alpha.T)
    cut = subdivide(body, pieces)
    elements = cut.motion(shapes, np.zeros_like(shapes))
    half = elements.half
    station = np.cumsum(2 * half, 0) - half
    fraction = half / half.sum()
    size = (len(half), shapes.shape[1])
    centres = np.broadcast_to(elements.centres, size)
    along = np.broadcast_to(elements.c + 1j * elements.s, size)
    rule = body.contact
    phase = body.contact_phase(shapes)
    weight = rule.checked_weights(rule.placed(station, body.inner), phase)
    load = body.contact_factors(shapes, elements, station, fraction)
    margin = support_margin(weight, fraction, centres, along, rule.width or 0.0, shift)

    ends = np.cumsum(2 * half_lengths(body.inner))
    owner = np.searchsorted(ends, station[:, 0] - 1e-12)
    owned = fraction[:, 0] * (owner == np.arange(len(ends))[:, None])
    means = owned / owned.sum(1, keepdims=True)
    return ContactState((means @ weight).T, (means @ load).T, margin)
