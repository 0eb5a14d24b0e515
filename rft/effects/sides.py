"""Loads that tell left from right: what effects of the ground's past share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rft.loads import ALONE, LoadLaw


def weakened(load: LoadLaw, shares: Callable) -> Weakened:
    """The load law with the drag across the body times a share for each side. shares(m, w, known) gives the shares, (2, n, B)
    for the parts of the elements that move to the left and to the right, and their derivatives with respect to m and w,
    or None where they do not depend on them."""
    before = (load.load, load.shares) if isinstance(load, Weakened) else (load, ())
    return Weakened(before[0], (*before[1], shares))


@dataclass(frozen=True)
class Weakened:
    """A load law times the shares of several effects, every element being cut once, at its pivot, where u = 0.

    There the drag across vanishes, so moving the pivot costs nothing and the derivatives are those of the parts.
    """

    load: LoadLaw
    shares: tuple[Callable, ...]

    def __call__(self, a, m, w, eps, known=ALONE):
        inside = np.abs(w) > np.abs(m)
        cut = np.flatnonzero(inside.any(1))
        pivot = np.where(inside, -m / np.where(inside, w, 1.0), -1.0)
        # From the pivot to the head's end of every element, then from the tail's end to the pivot where it lies inside.
        low, high = np.concatenate([pivot, -np.ones_like(pivot[cut])]), np.concatenate([np.ones_like(m), pivot[cut]])
        element = np.concatenate([np.arange(len(m)), cut])
        headwards = np.where(inside, w, m) > 0  # the part towards the head moves to the left
        leftward = np.concatenate([headwards, ~headwards[cut]])
        part = _part(self.load, a[element], m[element], w[element], eps, known, (high + low) / 2, (high - low) / 2)
        share, by_m, by_w = _product([shares(m, w, known) for shares in self.shares])

        def of_part(x):
            return np.where(leftward, x[0][element], x[1][element])

        drag = part[1:, 0].copy()
        part[1:] *= of_part(share)
        for column, slope in ((2, by_m), (3, by_w)):
            if slope is not None:
                part[1:, column] += of_part(slope) * drag
        out = part[:, :, : len(m)]
        out[:, :, cut] += part[:, :, len(m) :]
        return out


def _part(load, a, m, w, eps, known, centre, half):
    """What the part of an element from centre - half to centre + half, in [-1, 1], adds to its averages."""
    part = half * load(a, m + w * centre, w * half, eps, known)
    part[2] = centre * part[1] + half * part[2]
    part[:, 3] = centre * part[:, 2] + half * part[:, 3]
    return part


def _product(found: list) -> tuple:
    """Value and derivatives of a product from those of its factors."""
    value, *slopes = found[0]
    for factor, *more in found[1:]:
        slopes = [_sum(_times(s, factor), _times(t, value)) for s, t in zip(slopes, more)]
        value = value * factor
    return value, *slopes


def _times(slope, factor):
    return None if slope is None else slope * factor


def _sum(a, b):
    return b if a is None else a if b is None else a + b


def parts(m: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How the two sides of every element move. Mean velocity (2, n, B) of the part that moves to the left and of that to
    the right, 0 where there is none; the left one's share of the length (n, B); and whether the pivot lies inside."""
    turn = np.abs(w)
    inside = turn > np.abs(m)
    left = np.where(inside, (m + turn) / 2, np.maximum(m, 0.0))
    right = np.where(inside, (m - turn) / 2, np.minimum(m, 0.0))
    return np.stack([left, right]), np.where(inside, (1 + m / np.where(inside, turn, 1.0)) / 2, m > 0), inside
