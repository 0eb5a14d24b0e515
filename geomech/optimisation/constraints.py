"""Constraints that all loops of a search inherit from the first: being one stroke, and a distance from singular shapes."""

from __future__ import annotations

import numpy as np

from geomech.optimisation.loops import DENSE, Loops, waves
from geomech.optimisation.stroke import Stroke

MARGIN = 0.5  # of the first loop's distance from singular shapes
NEARLY = 0.95  # of that: allows for roundoff
SLIGHTLY = 0.05  # of the sweep of its first harmonic: a loop that goes back less is one stroke, or nearly so
SMALLER = 0.7 ** np.arange(12)  # sizes tried in turn


class Constraints:
    """Constraints inherited from the first loop of a search.

    singularity: of the system, or None. first: the loop to begin with, made smaller where it meets singular shapes.
    stroke: whether it is one stroke. away: how near to 0 the singularity may come."""

    def __init__(self, loops, singularity, first: np.ndarray):
        self.loops, self.singularity, self.away = loops, singularity, 0.0
        self.first = self._clear(first, first)
        self.stroke = isinstance(loops, Loops) and Stroke.is_one(
            loops, self.first, SLIGHTLY
        )
        if singularity is not None:
            self.away = MARGIN * float(np.abs(self._distance(self.first)).min())

    def feasible(self, p: np.ndarray) -> np.ndarray:
        """Return the loop if it satisfies the constraints, else a similar one that does, else the first.

        Tried in turn: smaller higher harmonics, smaller loops about the centre of the first."""
        if self.stroke and not Stroke.is_one(self.loops, p):
            rounder = (np.concatenate([p[:3], size * p[3:]]) for size in SMALLER)
            p = next((q for q in rounder if Stroke.is_one(self.loops, q)), self.first)
        return self._clear(p, self.first)

    def _clear(self, p: np.ndarray, first: np.ndarray) -> np.ndarray:
        if not self.meets_singular(p):
            return p
        smaller = (np.concatenate([first[:1], size * p[1:]]) for size in SMALLER)
        return next((q for q in smaller if not self.meets_singular(q)), first)

    def _distance(self, p: np.ndarray) -> np.ndarray:
        return self.singularity(waves(DENSE, self.loops.harmonics) @ p)

    def meets_singular(self, p: np.ndarray, share: float = 1.0) -> bool:
        """Return whether the loop meets singular shapes, or comes nearer to them than this share of the common
        distance."""
        if self.singularity is None:
            return False
        d = self._distance(p)
        return bool(np.ptp(np.sign(d)) > 0 or np.abs(d).min() < share * self.away)
