"""Loads that tell left from right: what effects of the ground's past share. Every element is split once, at its pivot."""

from __future__ import annotations

import numpy as np


def sided(law, shares: tuple, v_t, v_n, spin, eps) -> np.ndarray:
    """The load (3, 4, n, B) of a law with the drag across of either side times the product of the shares (`rft.contact`).

    An element is split at its pivot, where it does not move across. There the drag across vanishes, so moving the pivot
    costs nothing and the derivatives are those of the parts.
    """
    inside = np.abs(spin) > np.abs(v_n)
    split = np.flatnonzero(inside.any(1))
    pivot = np.where(inside, -v_n / np.where(inside, spin, 1.0), -1.0)
    # From the pivot to the head's end of every element, then from the tail's end to the pivot where it lies inside.
    low, high = np.concatenate([pivot, -np.ones_like(pivot[split])]), np.concatenate([np.ones_like(v_n), pivot[split]])
    element = np.concatenate([np.arange(len(v_n)), split])
    headwards = np.where(inside, spin, v_n) > 0  # the part towards the head moves to the left
    leftward = np.concatenate([headwards, ~headwards[split]])
    part = _part(law, v_t[element], v_n[element], spin[element], eps, (high + low) / 2, (high - low) / 2)
    share, by_v_n, by_spin = _product([one(v_n, spin) for one in shares])

    def of_part(x):
        return np.where(leftward, x[0][element], x[1][element])

    drag = part[1:, 0].copy()
    part[1:] *= of_part(share)
    for column, slope in ((2, by_v_n), (3, by_spin)):
        if slope is not None:
            part[1:, column] += of_part(slope) * drag
    out = part[:, :, : len(v_n)]
    out[:, :, split] += part[:, :, len(v_n) :]
    return out


def _part(law, v_t, v_n, spin, eps, centre, half):
    """What the part of an element from centre - half to centre + half, in [-1, 1], adds to its averages."""
    part = half * law(v_t, v_n + spin * centre, spin * half, eps)
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


def parts(v_n: np.ndarray, spin: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How the two sides of every element move. Mean velocity (2, n, B) of the part that moves to the left and of that to
    the right, 0 where there is none; the left one's share of the length (n, B); and whether the pivot lies inside."""
    turn = np.abs(spin)
    inside = turn > np.abs(v_n)
    left = np.where(inside, (v_n + turn) / 2, np.maximum(v_n, 0.0))
    right = np.where(inside, (v_n - turn) / 2, np.minimum(v_n, 0.0))
    return np.array([left, right]), np.where(inside, (1 + v_n / np.where(inside, turn, 1.0)) / 2, v_n > 0), inside
