"""Limit cycles by Newton's method, without waiting for transients to decay.

Five numbers determine all further motion: height, pitch and the three rates of the body
at the start of a stride. Newton's method finds the fixed point of the map from stride
to stride. Its slopes are differences, from strides of further copies of the robot whose
starts are changed a little. The slopes also bound the change of progress that is still
to come, and tell whether a robot that is pushed returns. Without a stable fixed point,
the mean over a few cycles takes its place.

Where a robot limps, every second stride repeats: then the map is that of two strides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.terradynamics.walking.planar import State
from rft.terradynamics.walking.stride import (
    FEW_STRIDES,
    LAST_CYCLES,
    MOST_STRIDES,
    SETTLED,
    Strides,
)

FARTHEST = 0.2  # longest step of Newton's method, scaled
NUDGE = 1e-3  # change of a start for differences, scaled
# Slopes are computed afresh after a step longer than `SHORT`, after one that leaves
# more than the share `SLOW` of the residual, and after `FEW_STRIDES` strides.
SHORT = 0.01  # scaled
SLOW = 0.5
# determinant of identity - slopes, below which a push in some direction never decays
NEUTRAL = 1e-9
LARGEST_EIGENVALUE = 1.001  # of a map whose fixed point is stable
PREDICTED = 1000  # cycles, at most, that the slopes of a map predict


class Limit(NamedTuple):
    """Limit cycle of one robot. state: at the start of a stride. period: number of
    strides of the map. slopes: (n, n), of the map, and gains: (n,), m, of its progress,
    both by the scaled numbers of `Strides.scaled`; None where they are unknown."""

    state: State
    period: int
    slopes: np.ndarray | None = None
    gains: np.ndarray | None = None


def predicted_progress(
    strides: Strides, limit: Limit, state: State, k: int, progress: float
) -> np.ndarray:
    """Return the progress (N,), m, of the next strides of robot k from ``state`` (1,),
    by the slopes at its limit, where a stride has ``progress``, m."""
    now, fixed = (strides.scaled(x, np.array([k]))[:, 0] for x in (state, limit.state))
    distance = now - fixed
    moves = []
    for _ in range(PREDICTED * strides.cycle // limit.period):
        moves += [progress + limit.gains @ distance / limit.period] * limit.period
        distance = limit.slopes @ distance
    return np.array(moves)


class LimitCycles(NamedTuple):
    """Limit cycles of B robots. progress: (B,), m, of a stride. drift, unsolved_error:
    (B,), m, changes of the progress that may still come, and that unsolved steps may
    have caused. periodic: (B,), whether the limit cycle was found; else the progress is
    the mean over a few cycles. strides: (B,), computed. ends: (B,), as of
    `Strides.end_status`. limits: one for each robot."""

    progress: np.ndarray
    drift: np.ndarray
    unsolved_error: np.ndarray
    periodic: np.ndarray
    strides: np.ndarray
    ends: np.ndarray
    limits: list[Limit]


def limit_cycles(strides: Strides, limits: list[Limit]) -> LimitCycles:
    """Return the limit cycles of robots from states near them, and from their slopes
    where these are known."""
    search = _Search(strides, limits)
    for _ in range(MOST_STRIDES):
        if (active := np.flatnonzero(search.active)).size:
            search.stride(active)
    return search.result()


class _Search:
    """Newton's method for B robots. start: (n, B), scaled, tried next. unknown: (B,),
    whether slopes must be computed."""

    def __init__(self, strides: Strides, limits: list[Limit]):
        self.strides = strides
        self.limits = limits
        count = len(limits)
        self.state = _concatenated([limit.state for limit in limits])
        self.period = np.array([x.period for x in limits])
        self.start = strides.scaled(self.state, np.arange(count))
        size = len(self.start)
        self.slopes = np.zeros((count, size, size))
        self.gains = np.zeros((count, size))
        self.unknown = np.array([limit.slopes is None for limit in limits])
        for k in np.flatnonzero(~self.unknown):
            self.slopes[k], self.gains[k] = limits[k][2:]
        self.active = np.ones(count, bool)
        self.periodic = np.zeros(count, bool)
        self.computed = np.zeros(count, int)
        self.ends = np.full(count, "", "U10")
        self.last = np.full(count, np.inf)
        self.progress, self.drift, self.unsolved_error = np.zeros((3, count))

    def stride(self, active):
        """Apply the map to the robots ``active``, and to changed copies of those
        without slopes; step to the next start."""
        numbers = len(self.start)
        unknown = active[self.unknown[active]]
        index = np.concatenate([active, np.repeat(unknown, numbers)])
        begin = self.start[:, index]
        begin[:, len(active) :] += np.tile(NUDGE * np.eye(numbers), len(unknown))
        before = self.strides.with_scaled(self.state.take(index), begin, index)
        after = self._mapped(before, index)
        end = self.strides.scaled(after, index)
        moved = after.pose[:, 0] - before.pose[:, 0]

        def differences(x):
            copies = x[..., len(active) :].reshape(*x.shape[:-1], len(unknown), numbers)
            return (copies - x[..., np.searchsorted(active, unknown), None]) / NUDGE

        self.slopes[unknown] = np.moveaxis(differences(end), 0, 1)
        self.gains[unknown] = differences(moved)
        now = after.take(slice(len(active)))
        count = len(active)
        self.progress[active] = moved[:count] / self.period[active]
        self._step(
            active,
            begin[:, :count],
            (end - begin)[:, :count],
            now.defect - before.defect[:count],
        )
        ends = self.strides.end_status(now, active)
        # A later start is Newton's, not one that the robot has come to: its end tells
        # nothing of the robot.
        self.ends[active] = np.where(self.computed[active] == 0, ends, "")
        self.active[active[ends != ""]] = self.periodic[active[ends != ""]] = False
        self.computed[active] += self.period[active]
        self.state = self.state.put(active, now)

    def _mapped(self, state: State, index) -> State:
        """Return the states of robots after the strides of their maps."""
        for k in range(self.period[index].max()):
            rows = np.flatnonzero(self.period[index] > k)
            state = state.put(
                rows, self.strides.run(state.take(rows), 0, index[rows])[1].take(-1)
            )
        return state

    def _step(self, r, begin, residual, defect):
        """Step to the next start of the robots r, from ``begin`` and the residual of
        the map there, (n, B)."""
        matrix = np.eye(len(residual)) - self.slopes[r]
        step = solve(matrix, residual.T)
        response = solve(
            np.moveaxis(matrix, 1, 2), self.gains[r]
        )  # of all later progress to a push
        self.drift[r] = np.abs((self.gains[r] * step).sum(-1)) / self.period[r]
        most = np.abs(response[:, self.strides.free >= 2]).max(-1)
        self.unsolved_error[r] = (
            defect * most / self.strides.leg_speed[r] / self.period[r]
        )
        far = np.abs(step).max(-1)
        size = np.abs(residual).max(0)
        self.start[:, r] = (
            begin
            + (step * np.minimum(1.0, FARTHEST / np.maximum(far, FARTHEST))[:, None]).T
        )
        many = self.computed[r] // self.period[r] % FEW_STRIDES == FEW_STRIDES - 1
        self.unknown[r] = (far > SHORT) | (size > SLOW * self.last[r]) | many
        self.last[r] = size
        # A robot in the air is neutral, for one.
        failed = ~np.isfinite(step).all(-1) | (np.abs(np.linalg.det(matrix)) < NEUTRAL)
        near = ~failed & (np.maximum(far, size) <= SHORT)
        near &= self.drift[r] <= SETTLED * self.strides.reach[r] * self.strides.period
        self.periodic[r] = near & (
            np.abs(np.linalg.eigvals(self.slopes[r])).max(-1) <= LARGEST_EIGENVALUE
        )
        self.active[r] = ~near & ~failed

    def result(self) -> LimitCycles:
        """Return the limit cycles, with means over a few more cycles for robots without
        one."""
        maps = enumerate(zip(self.period, self.slopes, self.gains))
        limits = [
            Limit(self.state.take([k]), int(period), *slopes)
            for k, (period, *slopes) in maps
        ]
        cycles = LimitCycles(
            self.progress,
            self.drift,
            self.unsolved_error,
            self.periodic,
            self.computed,
            self.ends,
            limits,
        )
        rest = np.flatnonzero(~self.periodic & (self.ends == ""))
        return (
            _with_means(self.strides, self.limits, rest, cycles)
            if rest.size
            else cycles
        )


def _with_means(
    strides: Strides, limits: list[Limit], r, cycles: LimitCycles
) -> LimitCycles:
    """Fill in the means over a few cycles of the robots r, from the states of
    ``limits``."""
    first = state = _concatenated([limits[k].state for k in r])
    places = [first.pose[:, 0]]
    count = strides.cycle
    for k in range(LAST_CYCLES * count):
        state = strides.run(state, k, r)[1].take(-1)
        places.append(state.pose[:, 0])
    moved = np.diff(places[::count], axis=0) * strides.period
    cycles.progress[r] = moved.mean(0)
    cycles.drift[r] = np.ptp(moved, axis=0)
    error = (
        (state.defect - first.defect)
        / LAST_CYCLES
        / count
        * strides.period
        / strides.frequency[r]
    )
    cycles.unsolved_error[r] = error
    cycles.strides[r] += LAST_CYCLES * count
    cycles.ends[r] = strides.end_status(state, r)
    for j, k in enumerate(r):
        cycles.limits[k] = Limit(state.take([j]), 1)
    return cycles


def _concatenated(states: list[State]) -> State:
    """Return the states of all robots as one."""
    return State(*(np.concatenate(x) for x in zip(*states)))


def solve(slopes, residual) -> np.ndarray:
    """Return the solutions (B, n) of linear equations, 0 for singular ones."""
    try:
        return np.linalg.solve(slopes, residual[..., None])[..., 0]
    except np.linalg.LinAlgError:
        regular = np.linalg.det(slopes) != 0.0
        solution = np.zeros_like(residual)
        solution[regular] = np.linalg.solve(
            slopes[regular], residual[regular][..., None]
        )[..., 0]
        return solution
