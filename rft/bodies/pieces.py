"""A body with its longer elements cut into pieces that move as before: for laws that differ from place to place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rft.bodies.base import Body, Elements, Wrapped, halves

PIECES = 40  # to a body length, where nothing else is asked for; what they leave is estimated, not assumed


@dataclass(frozen=True, eq=False)
class Pieces(Wrapped):
    """``inner`` with every element cut into equal pieces no longer than ``longest``, in body lengths."""

    longest: float

    @cached_property
    def _cuts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(owner, centre, share): of each piece its element, and its middle and half length in the element's [-1,
        1]."""
        counts = np.maximum(1, np.ceil(2 * halves(self.inner) / self.longest - 1e-9).astype(int))
        owner = np.repeat(np.arange(counts.size), counts)
        rank = np.arange(owner.size) - np.repeat(np.cumsum(counts) - counts, counts)
        return owner, ((2 * rank + 1) / counts[owner] - 1)[:, None], (1 / counts[owner])[:, None]

    def motion(self, alpha, alphadot) -> Elements:
        owner, centre, share = self._cuts
        c, s, r_t, r_n, half, weight, v_t, v_n, v_w = (x[owner] for x in self.inner.motion(alpha, alphadot))
        v_n = v_n + v_w * centre
        return Elements(c, s, r_t, r_n + half * centre, half * share, weight * share, v_t, v_n, v_w * share)


def subdivide(body: Body, pieces: int) -> Body:
    """``body`` in pieces, so many to its length or more, or as it is where its elements are short enough."""
    longest = 1 / pieces
    return Pieces(body, longest) if (2 * halves(body) > longest * (1 + 1e-9)).any() else body
