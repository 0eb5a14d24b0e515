"""Displacements that are zero by symmetry: which, and why."""

from __future__ import annotations

import numpy as np

from geomech.gaits import Gait
from geomech.geometry.images import SAME
from geomech.systems.base import System

PHASES = 240
MIRRORED = "the second half of the cycle mirrors the first"
BACKWARDS = "the cycle run backwards is its own image, head for tail"


def zero_by_symmetry(system: System, gait: Gait) -> dict[str, str]:
    """Return the reason by quantity, of heading and y, for those that are zero after a cycle by symmetry.

    With the premises of a connection the pose after a cycle is G = g1 m(g1), m the mirror image, where alpha(t + pi) =
    -alpha(t): no heading. Where P alpha(-t) = s alpha(t), P head for tail, G is its own inverse seen in a mirror across the
    body's axis (s = 1, in the mirror too: no y where there is no heading), or turned by half a turn (s = -1: no heading)."""
    traits, zero = system.traits, {}
    if traits.steps or not traits.odd:
        return zero
    alpha = gait.shape(2 * np.pi * np.arange(PHASES) / PHASES)
    nearly = SAME * 1e3 * np.abs(alpha).max()
    same = lambda x, y: bool(np.abs(x - y).max() <= nearly)
    if traits.mirror and same(np.roll(alpha, PHASES // 2, 0), -alpha):
        zero["heading"] = MIRRORED
    if traits.reversible:
        swapped = -alpha[:, ::-1]
        if any(same(np.roll(swapped[::-1], k, 0), alpha) for k in range(PHASES)):
            zero.setdefault("heading", BACKWARDS)
        if traits.mirror and "heading" in zero and same(np.roll(swapped[::-1], 1, 0), -alpha):
            zero["y"] = BACKWARDS
    return zero
