"""How far time stepping is from its limit cycle, and how a heavy body gets there sooner.

From cycle to cycle the displacement changes by less and less; what is left is the sum of all changes to come, not the
last of them. Without mass the last few give their ratio. Where the ground remembers in cells, changes at last come and go
at random: these take turns in sign, and do not add up. A heavy body forgets over many cycles, but only what its three
velocities at the start of a cycle are: the map from these to those at the next start is affine near its fixed point, and
the last few cycles tell it along the ways they went (Anderson's mixing, for which nothing but the velocities is touched:
what the ground remembers follows by itself).
"""

from __future__ import annotations

import numpy as np

DEEPEST = 6  # cycles the limit is found from; a velocity has three numbers, but the map bends
SINGULAR = 1e-6  # of the largest singular value, below which two cycles went the same way
UNKNOWN = 0.5  # ratio of the first change of displacement to the next, assumed
SLOWEST = 0.95  # ratio of a change to that before, where they hardly shrink
RATIOS = 3  # of late, whose mean counts
ASTRAY = 5.0  # times the least change of velocity so far: a kick that led away from the limit
FAILURES = 10  # after so many of these a sample goes round and round without


class Approach:
    """Cycle after cycle of B samples."""

    def __init__(self, samples: int):
        self.moved, self.change, self.drift = None, None, np.full(samples, np.inf)
        self.ratios: list[np.ndarray] = []

    def after(self, start, end, moved: np.ndarray) -> np.ndarray:
        """(B,): how much displacement changes from the cycle before and in all to come, its largest component, after a cycle
        that moved so, (3, B). start, end: (3, B), body velocities at the ends of the cycle."""
        last, self.moved = self.moved, moved
        if last is None:
            return self.drift
        before, self.change = self.change, moved - last
        if before is not None:
            ratio = self.change / np.where(before == 0, 1.0, before)
            self.ratios = [*self.ratios[1 - RATIOS :], np.clip(ratio, -1.0, 1.0)]
        ratio = np.clip(np.mean(self.ratios, axis=0), 0.0, SLOWEST) if self.ratios else UNKNOWN
        return np.max(np.abs(self.change) / (1 - ratio), axis=0)


class HeavyApproach(Approach):
    """The same with mass: from the last cycles' first velocities, their changes and displacements. A kick after which
    velocities change more than in the calmest cycle so far is taken back, to the end of that."""

    def __init__(self, samples: int):
        super().__init__(samples)
        self.cycles: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self.step, self.failures = np.zeros((3, samples)), np.zeros(samples, int)
        self.calmest = tuple(np.full((3, samples), x) for x in (0.0, np.inf, 0.0))  # start, change and displacement
        self.astray = np.zeros(samples, bool)

    def after(self, start, end, moved) -> np.ndarray:
        last, self.moved = self.moved, moved
        if start is None:  # the first cycle starts from rest
            return self.drift
        now = start, end - start, moved
        size, least = (np.abs(change).max(0) for change in (now[1], self.calmest[1]))
        self.astray = (size > ASTRAY * least) & (self.step != 0).any(0)
        self.failures += self.astray
        self.calmest = tuple(np.where(size < least, x, y) for x, y in zip(now, self.calmest))
        old = [*self.cycles[1 - DEEPEST :], now]
        self.cycles = [tuple(np.where(self.astray, x, y) for x, y in zip(self.calmest, cycle)) for cycle in old]
        if len(self.cycles) < 2:
            return self.drift
        starts, changes, moves = (np.diff(np.stack(x), axis=0) for x in zip(*self.cycles))
        mix = _mix(changes, self.cycles[-1][1])
        ahead = ((starts + changes) * mix[:, None]).sum(0)
        self.step = np.where(self.astray, self.calmest[0] + self.calmest[1] - end, ahead)
        to_come = (moves * mix[:, None]).sum(0)
        return np.maximum(np.abs(to_come), np.abs(moved - last)).max(0)

    def kick(self, which: np.ndarray) -> np.ndarray:
        """(3, B): change of velocity that leads the samples ``which`` to the limit, as far as is known."""
        self.step = np.where(which & (self.astray | (self.failures < FAILURES)), self.step, 0.0)
        return self.step


def _mix(changes: np.ndarray, last: np.ndarray) -> np.ndarray:
    """(k, B): how much of the differences (k, 3, B) takes the last change (3, B) nearest to nothing."""
    size = np.sqrt((changes**2).sum(1))
    size = np.where(size > 0, size, 1.0)
    matrix = np.moveaxis(changes / size[:, None], (0, 1, 2), (2, 1, 0))
    return -np.einsum("bki,ib->kb", np.linalg.pinv(matrix, SINGULAR), last) / size
