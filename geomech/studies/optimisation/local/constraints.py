"""Constraints that all loops of a search inherit from the first one.

They stay one stroke, and at a distance from singular shapes."""

from __future__ import annotations

import numpy as np

from geomech.studies.optimisation.local.stroke import Stroke
from geomech.studies.optimisation.loops import DENSE, Loops, waves

MARGIN = 0.5  # of the first loop's distance from singular shapes
NEARLY = 0.95  # of that distance: allows for roundoff
# Of the sweep of the first harmonic: a loop that goes back less is nearly one stroke.
SLIGHTLY = 0.05
SIZES = 0.7 ** np.arange(12)  # relative sizes of a loop, tried one after the other


class Constraints:
    """Constraints inherited from the first loop of a search.

    singularity: of the system, or None. first: the loop to begin with, made smaller
    where it meets singular shapes. stroke: whether it is one stroke. away: how near to
    0 the singularity may come."""

    def __init__(self, loops, singularity, first: np.ndarray):
        self.loops = loops
        self.singularity = singularity
        self.away = 0.0
        self.first = self._clear(first, first)
        self.stroke = False
        if isinstance(loops, Loops):
            self.stroke = Stroke.is_one(loops, self.first, SLIGHTLY)
        if singularity is not None:
            self.away = MARGIN * float(np.abs(self._distance(self.first)).min())

    def feasible(self, p: np.ndarray) -> np.ndarray:
        """Return the loop if it satisfies the constraints, else a similar one that
        does, else the first.

        Smaller higher harmonics are tried, then smaller loops about the centre of the
        first."""
        if self.stroke and not Stroke.is_one(self.loops, p):
            rounder = (np.concatenate([p[:3], size * p[3:]]) for size in SIZES)
            p = next((q for q in rounder if Stroke.is_one(self.loops, q)), self.first)
        return self._clear(p, self.first)

    def _clear(self, p: np.ndarray, first: np.ndarray) -> np.ndarray:
        """Return the loop, made smaller until it meets no singular shape."""
        if not self.meets_singular(p):
            return p
        smaller = (np.concatenate([first[:1], size * p[1:]]) for size in SIZES)
        return next((q for q in smaller if not self.meets_singular(q)), first)

    def _distance(self, p: np.ndarray) -> np.ndarray:
        """Return the singularity at DENSE phases of the loop."""
        return self.singularity(waves(DENSE, self.loops.harmonics) @ p)

    def meets_singular(self, p: np.ndarray, share: float = 1.0) -> bool:
        """Return whether the loop meets singular shapes, or comes nearer to them than
        this share of the common distance."""
        if self.singularity is None:
            return False
        distance = self._distance(p)
        if np.ptp(np.sign(distance)) > 0:
            return True
        return bool(np.abs(distance).min() < share * self.away)
