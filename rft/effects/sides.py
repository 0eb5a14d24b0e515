"""Loads that tell left from right: what effects of the ground's past share."""

from __future__ import annotations

import numpy as np

from rft.loads import ALONE


def sides(load, a, m, w, eps, known=ALONE):
    """(left, right): the load (3, 4, n, B) on the parts of each element that move to the left (u > 0) and to the right.

    The parts meet at the pivot, where u = 0. There the drag across vanishes, so moving the pivot costs nothing and the
    derivatives are those of the parts.
    """
    inside = np.abs(w) > np.abs(m)
    pivot = np.where(inside, -m / np.where(inside, w, 1.0), -1.0)
    beyond = np.where(inside, w, m) > 0  # the part from the pivot to the head's end moves to the left
    upper = _part(load, a, m, w, eps, known, (1 + pivot) / 2, (1 - pivot) / 2)
    lower = _part(load, a, m, w, eps, known, (pivot - 1) / 2, (1 + pivot) / 2) if inside.any() else np.zeros_like(upper)
    return np.where(beyond, upper, lower), np.where(beyond, lower, upper)


def _part(load, a, m, w, eps, known, centre, half):
    """What the piece of an element from centre - half to centre + half, in [-1, 1], adds to its averages."""
    piece = half * load(a, m + w * centre, w * half, eps, known)
    piece[2] = centre * piece[1] + half * piece[2]
    piece[:, 3] = centre * piece[:, 2] + half * piece[:, 3]
    return piece


def weakened(load, shares):
    """The load law with the drag across the body times a share for each side. shares(m, known) gives (left, right) and
    their derivatives with respect to m, each (n, B)."""

    def law(a, m, w, eps, known=ALONE):
        parts = sides(load, a, m, w, eps, known)
        values, slopes = shares(m, known)
        out = parts[0] + parts[1]
        out[1:] = sum(share * part[1:] for share, part in zip(values, parts))
        out[1:, 2] += sum(slope * part[1:, 0] for slope, part in zip(slopes, parts))
        return out

    return law
