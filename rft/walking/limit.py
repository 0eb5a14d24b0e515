"""The stride that repeats itself, found without waiting for what dies out slowly.

Five numbers tell all that is to come: height, pitch and the three rates of the body at the start of a stride. Newton's
method finds those that the map from stride to stride leaves alone; its slopes are differences, strides of robots beside
the first that start a little off. They tell besides what the progress of a stride may yet change, and whether a robot
that is pushed comes back. Where none such is found, the mean over a few cycles stands in for it.

Where a robot limps, no stride is like the last one but every second one is: then the map is that of two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.walking.planar import State
from rft.walking.stride import FEW_STRIDES, LATE, MOST_STRIDES, SETTLED, Strides

FARTHEST = 0.2  # scaled: a longer step of Newton's method is cut
NUDGE = 1e-3  # scaled, for differences
SHORT = 0.01  # scaled: slopes are found anew after a longer step, after one
FALLEN = 0.5  # that left more than this of the distance, and after `FEW_STRIDES`
NEUTRAL = 1e-9  # determinant of identity - slopes: a push in some direction is kept for ever
RETURNS = 1.001  # the largest eigenvalue of a map that leads back
FORETOLD = 1000  # cycles, at most, that the slopes of a map foretell


class Limit(NamedTuple):
    """Of one robot: its state at the start of a stride there, the strides that the map consists of, the map's slopes
    (n, n) and the gains (n,), m, of its progress, by scaled numbers; None where they are not known."""

    state: State
    fold: int
    slopes: np.ndarray | None = None
    gains: np.ndarray | None = None


def foretold(strides: Strides, limit: Limit, state: State, k: int, progress: float) -> np.ndarray:
    """Progress of the strides to come (N,), m, of robot k from ``state`` (1,), by the slopes at its limit, where a stride makes
    ``progress``, m."""
    here, there = (strides.scaled(x, np.array([k]))[:, 0] for x in (state, limit.state))
    off, moves = here - there, []
    for _ in range(FORETOLD * strides.cycle // limit.fold):
        moves += [progress + limit.gains @ off / limit.fold] * limit.fold
        off = limit.slopes @ off
    return np.array(moves)


class Found(NamedTuple):
    """(B,): progress of a stride, m; what that may yet change, and what steps that are not solved may have changed of it;
    whether it is that of a limit cycle; strides that were run; how robots ended, or ""; limits."""

    progress: np.ndarray
    drift: np.ndarray
    off: np.ndarray
    periodic: np.ndarray
    strides: np.ndarray
    ends: np.ndarray
    limits: list[Limit]


def limit_cycle(strides: Strides, limits: list[Limit]) -> Found:
    """From the states of limits, with the slopes that they have, if any."""
    search = _Search(strides, limits)
    for _ in range(MOST_STRIDES):
        if (going := np.flatnonzero(search.going)).size:
            search.stride(going)
    return search.found()


class _Search:
    """Newton's method for B robots. at: (n, B), scaled, the start that is tried. fresh: whose slopes are to be found."""

    def __init__(self, strides: Strides, limits: list[Limit]):
        self.strides, self.limits, count = strides, limits, len(limits)
        self.state = State(*(np.concatenate(x) for x in zip(*(one.state for one in limits))))
        self.fold, self.at = np.array([one.fold for one in limits]), strides.scaled(self.state, np.arange(count))
        self.slopes, self.gains = np.zeros((count, len(self.at), len(self.at))), np.zeros((count, len(self.at)))
        self.fresh = np.array([one.slopes is None for one in limits])
        for k in np.flatnonzero(~self.fresh):
            self.slopes[k], self.gains[k] = limits[k][2:]
        self.going, self.settled = np.ones(count, bool), np.zeros(count, bool)
        self.done, self.ends, self.last = np.zeros(count, int), np.full(count, "", "U10"), np.full(count, np.inf)
        self.progress, self.drift, self.off = np.zeros((3, count))

    def stride(self, going):
        """One map of each of these, and of those beside them."""
        numbers, fresh = len(self.at), going[self.fresh[going]]
        which = np.concatenate([going, np.repeat(fresh, numbers)])
        begin = self.at[:, which]
        begin[:, len(going) :] += np.tile(NUDGE * np.eye(numbers), len(fresh))
        before = self.strides.with_scaled(self.state.take(which), begin, which)
        after = self._mapped(before, which)
        end, moved = self.strides.scaled(after, which), after.pose[:, 0] - before.pose[:, 0]
        own = np.searchsorted(going, fresh)
        more = lambda x: x[..., len(going) :].reshape(*x.shape[:-1], len(fresh), numbers)
        self.slopes[fresh] = np.moveaxis((more(end) - end[:, own, None]) / NUDGE, 0, 1)
        self.gains[fresh] = (more(moved) - moved[own, None]) / NUDGE
        now, count = after.take(slice(len(going))), len(going)
        self.progress[going] = moved[:count] / self.fold[going]
        self._step(going, begin[:, :count], (end - begin)[:, :count], now.defect - before.defect[:count])
        ends = self.strides.ended(now, going)
        self.ends[going] = np.where(self.done[going] == 0, ends, "")  # one that was moved tells of no other
        self.going[going[ends != ""]] = self.settled[going[ends != ""]] = False
        self.done[going] += self.fold[going]
        self.state = self.state.put(going, now)

    def _mapped(self, state: State, which) -> State:
        for k in range(self.fold[which].max()):
            some = np.flatnonzero(self.fold[which] > k)
            state = state.put(some, self.strides.run(state.take(some), 0, which[some])[1].take(-1))
        return state

    def _step(self, r, begin, left, defect):
        """On from ``begin`` (n, B), to which a map came back to within ``left``."""
        matrix = np.eye(len(left)) - self.slopes[r]
        step = solved(matrix, left.T)
        response = solved(np.moveaxis(matrix, 1, 2), self.gains[r])  # of all progress to come to a push
        self.drift[r] = np.abs((self.gains[r] * step).sum(-1)) / self.fold[r]
        self.off[r] = defect * np.abs(response[:, self.strides.free >= 2]).max(-1) / self.strides.fast[r] / self.fold[r]
        far, size = np.abs(step).max(-1), np.abs(left).max(0)
        self.at[:, r] = begin + (step * np.minimum(1.0, FARTHEST / np.maximum(far, FARTHEST))[:, None]).T
        many = self.done[r] // self.fold[r] % FEW_STRIDES == FEW_STRIDES - 1
        self.fresh[r] = (far > SHORT) | (size > FALLEN * self.last[r]) | many
        self.last[r] = size
        lost = ~np.isfinite(step).all(-1) | (np.abs(np.linalg.det(matrix)) < NEUTRAL)  # in the air, to begin with
        near = ~lost & (np.maximum(far, size) <= SHORT)
        near &= self.drift[r] <= SETTLED * self.strides.reach[r] * self.strides.period
        self.settled[r] = near & (np.abs(np.linalg.eigvals(self.slopes[r])).max(-1) <= RETURNS)
        self.going[r] = ~near & ~lost

    def found(self) -> Found:
        """What has come of it; a few cycles more of those that have no limit cycle."""
        limits = [
            Limit(self.state.take([k]), int(f), *x) for k, (f, *x) in enumerate(zip(self.fold, self.slopes, self.gains))
        ]
        found = Found(self.progress, self.drift, self.off, self.settled, self.done, self.ends, limits)
        rest = np.flatnonzero(~self.settled & (self.ends == ""))
        return _late(self.strides, self.limits, rest, found) if rest.size else found


def _late(strides: Strides, limits: list[Limit], r, found: Found) -> Found:
    """With the means over a few cycles of these robots, from where they were."""
    first = state = State(*(np.concatenate(x) for x in zip(*(limits[k].state for k in r))))
    places, count = [first.pose[:, 0]], strides.cycle
    for k in range(LATE * count):
        state = strides.run(state, k, r)[1].take(-1)
        places.append(state.pose[:, 0])
    moved = np.diff(places[::count], axis=0) * strides.period
    found.progress[r], found.drift[r] = moved.mean(0), np.ptp(moved, axis=0)
    found.off[r] = (state.defect - first.defect) / LATE / count * strides.period / strides.frequency[r]
    found.strides[r] += LATE * count
    found.ends[r] = strides.ended(state, r)
    for k, one in enumerate(r):
        found.limits[one] = Limit(state.take([k]), 1)
    return found


def solved(slopes, residual) -> np.ndarray:
    """(B, n); none where there is no solution."""
    try:
        return np.linalg.solve(slopes, residual[..., None])[..., 0]
    except np.linalg.LinAlgError:
        good = np.linalg.det(slopes) != 0.0
        found = np.zeros_like(residual)
        found[good] = np.linalg.solve(slopes[good], residual[good][..., None])[..., 0]
        return found
