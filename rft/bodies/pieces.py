"""Subdivision of elements into pieces, for effects that vary along an element."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rft.bodies.base import Body, Elements, WrappedBody, half_lengths

PIECES = 40  # to a body length, by default; estimates of errors include theirs


@dataclass(frozen=True, eq=False)
class Pieces(WrappedBody):
    """The body ``inner`` with every element cut into equal pieces no longer than
    ``longest``, in body lengths."""

    longest: float

    @cached_property
    def _cuts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Element, centre and half length of each piece; the latter two in the
        element's coordinate s in [-1, 1]."""
        exact_counts = 2 * half_lengths(self.inner) / self.longest
        counts = np.maximum(1, np.ceil(exact_counts - 1e-9).astype(int))
        owner = np.repeat(np.arange(counts.size), counts)
        rank = np.arange(owner.size) - np.repeat(np.cumsum(counts) - counts, counts)
        centre = (2 * rank + 1) / counts[owner] - 1
        half = 1 / counts[owner]
        return owner, centre[:, None], half[:, None]

    def motion(self, alpha, alphadot) -> Elements:
        owner, centre, fraction = self._cuts
        c, s, r_t, r_n, half, weight, v_t, v_n, v_w = (
            x[owner] for x in self.inner.motion(alpha, alphadot)
        )
        v_n = v_n + v_w * centre
        return Elements(
            c,
            s,
            r_t,
            r_n + half * centre,
            half * fraction,
            weight * fraction,
            v_t,
            v_n,
            v_w * fraction,
        )


@dataclass(frozen=True, eq=False)
class PiecesWithContact(Pieces):
    """Such pieces of a body whose elements touch the ground by its own rule."""

    @property
    def stations(self) -> np.ndarray:
        """Places (n, 1) of the pieces along the body, 0 at its tail."""
        owner, centre, _ = self._cuts
        inner: Any = self.inner
        half = half_lengths(inner)[owner, None]
        return inner.stations[owner] + half * centre

    def contact_factors(
        self,
        alpha: np.ndarray,
        elements: Elements,
        station: np.ndarray,
        fraction: np.ndarray,
    ) -> np.ndarray:
        """Return the factors (n, B) of the drag on the pieces at shapes (joints, B):
        those of their elements."""
        inner: Any = self.inner
        return inner.contact_factors(alpha, elements, station, fraction)[self._cuts[0]]


def subdivide(body: Body, pieces: int) -> Body:
    """Return the body with at least ``pieces`` elements to its length; the body itself
    where its elements are short enough."""
    longest = 1 / pieces
    if (2 * half_lengths(body) > longest * (1 + 1e-9)).any():
        if hasattr(body, "stations"):
            return PiecesWithContact(body, longest)
        return Pieces(body, longest)
    return body
