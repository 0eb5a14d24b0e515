"""Limit cycles by Newton's method, without waiting for transients to decay.

Five numbers determine all further motion: height, pitch and the three rates of the body
at the start of a stride. Newton's method finds the fixed point of the map from stride
to stride. Its slopes are differences, from strides of further copies of the robot whose
starts are changed a little. The slopes also bound the change of progress that is still
to come, and show whether a robot that is pushed returns. Without a stable fixed point,
the mean over a few cycles takes its place.

Where a robot limps, every second stride repeats: then the map is that of two strides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.terradynamics.walking.planar.equations import State
from rft.terradynamics.walking.planar.stride import (
    AVERAGED_CYCLES,
    MOST_STRIDES,
    REMAINING_CHANGE,
    STRIDES_NEAR_LIMIT,
    Strides,
)

LONGEST_STEP = 0.2  # of Newton's method, scaled
NUDGE = 1e-3  # change of a start for differences, scaled
# Slopes are computed afresh after a step longer than `SHORT_STEP`, after a step that
# leaves more than the share `SLOW_DECREASE` of the residual, and after
# `STRIDES_NEAR_LIMIT` maps.
SHORT_STEP = 0.01  # scaled
SLOW_DECREASE = 0.5
# Determinant of identity - slopes, below which a push in some direction never decays.
SMALLEST_DETERMINANT = 1e-9
LARGEST_EIGENVALUE = 1.001  # of a map whose fixed point is stable
PREDICTED_CYCLES = 1000  # that the slopes of a map predict, at most


class Limit(NamedTuple):
    """Limit cycle of one robot.

    state: at the start of a stride. period: number of strides of the map. slopes:
    (n, n), of the map, and gains: (n,), m, of its progress, both by the scaled numbers
    of `Strides.scaled_state`; None where they are unknown."""

    state: State
    period: int
    slopes: np.ndarray | None = None
    gains: np.ndarray | None = None


def predicted_progress(
    strides: Strides, limit: Limit, state: State, k: int, progress: float
) -> np.ndarray:
    """Return the progress (N,), m, of the next strides of robot k from ``state`` (1,),
    by the slopes at its limit, where a stride has ``progress``, m."""
    robot = np.array([k])
    start = strides.scaled_state(state, robot)[:, 0]
    fixed_point = strides.scaled_state(limit.state, robot)[:, 0]
    distance = start - fixed_point
    moves = []
    for _ in range(PREDICTED_CYCLES * strides.cycle // limit.period):
        moves += [progress + limit.gains @ distance / limit.period] * limit.period
        distance = limit.slopes @ distance
    return np.array(moves)


class LimitCycles(NamedTuple):
    """Limit cycles of B robots.

    progress: (B,), m, of a stride. drift, unsolved_error: (B,), m, changes of the
    progress that may still come, and that unsolved steps may have caused. periodic:
    (B,), whether the limit cycle was found; else the progress is the mean over a few
    cycles. strides: (B,), number computed. ends: (B,), as of `Strides.end_status`.
    limits: one for each robot."""

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
        active = np.flatnonzero(search.active)
        if not active.size:
            break
        search.apply_map(active)
    return search.result()


class _Search:
    """Newton's method for the limit cycles of B robots.

    start: (n, B), scaled, of the next strides. needs_slopes: (B,), whether the slopes
    must be computed in them. active: (B,), whether the search goes on. last_size: (B,),
    largest residual of the last map. All others: as of `LimitCycles`."""

    def __init__(self, strides: Strides, limits: list[Limit]):
        count = len(limits)
        self.strides = strides
        self.limits = limits
        self.state = _concatenate([limit.state for limit in limits])
        self.period = np.array([limit.period for limit in limits])
        self.start = strides.scaled_state(self.state, np.arange(count))

        size = len(self.start)
        self.slopes = np.zeros((count, size, size))
        self.gains = np.zeros((count, size))
        self.needs_slopes = np.array([limit.slopes is None for limit in limits])
        for k in np.flatnonzero(~self.needs_slopes):
            self.slopes[k] = limits[k].slopes
            self.gains[k] = limits[k].gains

        self.active = np.ones(count, bool)
        self.periodic = np.zeros(count, bool)
        self.computed = np.zeros(count, int)
        self.ends = np.full(count, "", "U10")
        self.last_size = np.full(count, np.inf)
        self.progress = np.zeros(count)
        self.drift = np.zeros(count)
        self.unsolved_error = np.zeros(count)

    def apply_map(self, active):
        """Apply the map to the robots ``active``, and to changed copies of those
        without slopes; step to the next start."""
        count = len(active)
        size = len(self.start)
        new = active[self.needs_slopes[active]]

        # All robots run together: those that are active, then ``size`` copies of each
        # new one, with one number changed in each.
        index = np.concatenate([active, np.repeat(new, size)])
        begin = self.start[:, index]
        begin[:, count:] += np.tile(NUDGE * np.eye(size), len(new))
        before = self.strides.with_scaled_state(self.state.take(index), begin, index)
        after = self._after_map(before, index)
        end = self.strides.scaled_state(after, index)
        moved = after.pose[:, 0] - before.pose[:, 0]

        def differences(x):
            copies = x[..., count:].reshape(*x.shape[:-1], len(new), size)
            return (copies - x[..., np.searchsorted(active, new), None]) / NUDGE

        self.slopes[new] = np.moveaxis(differences(end), 0, 1)
        self.gains[new] = differences(moved)

        state = after.take(slice(count))
        self.progress[active] = moved[:count] / self.period[active]
        self._step(
            active,
            begin[:, :count],
            (end - begin)[:, :count],
            state.defect - before.defect[:count],
        )
        self._note_ends(active, self.strides.end_status(state, active))
        self.computed[active] += self.period[active]
        self.state = self.state.put(active, state)

    def _after_map(self, state: State, index) -> State:
        """Return the states of robots after the strides of their maps."""
        for k in range(self.period[index].max()):
            rows = np.flatnonzero(self.period[index] > k)
            _, states = self.strides.run(state.take(rows), 0, index[rows])
            state = state.put(rows, states.take(-1))
        return state

    def _note_ends(self, active, ends):
        """Note the ends (B,) of the active robots, whose search is over."""
        # A later start is Newton's, not one that the robot has come to: its end says
        # nothing about the robot.
        is_first = self.computed[active] == 0
        self.ends[active] = np.where(is_first, ends, "")
        ended = active[ends != ""]
        self.active[ended] = False
        self.periodic[ended] = False

    def _step(self, r, begin, residual, defect):
        """Step to the next start of the robots r, from ``begin`` and the residual of
        the map there, (n, B). defect: m/s, (B,), of the steps of the map."""
        matrix = np.eye(len(residual)) - self.slopes[r]
        step = solve_regular(matrix, residual.T)
        length = np.abs(step).max(-1)
        size = np.abs(residual).max(0)
        shares = np.minimum(1.0, LONGEST_STEP / np.maximum(length, LONGEST_STEP))
        self.start[:, r] = begin + (step * shares[:, None]).T
        self.drift[r] = np.abs((self.gains[r] * step).sum(-1)) / self.period[r]
        self.unsolved_error[r] = self._unsolved_error(r, matrix, defect)

        maps = self.computed[r] // self.period[r]
        is_old = maps % STRIDES_NEAR_LIMIT == STRIDES_NEAR_LIMIT - 1
        is_slow = size > SLOW_DECREASE * self.last_size[r]
        self.needs_slopes[r] = (length > SHORT_STEP) | is_slow | is_old
        self.last_size[r] = size

        # A robot in the air, for example, has no regular matrix.
        determinant = np.abs(np.linalg.det(matrix))
        has_failed = ~np.isfinite(step).all(-1) | (determinant < SMALLEST_DETERMINANT)
        is_near = ~has_failed & (np.maximum(length, size) <= SHORT_STEP)
        largest_drift = REMAINING_CHANGE * self.strides.reach[r] * self.strides.period
        is_near &= self.drift[r] <= largest_drift
        eigenvalue = np.abs(np.linalg.eigvals(self.slopes[r])).max(-1)
        self.periodic[r] = is_near & (eigenvalue <= LARGEST_EIGENVALUE)
        self.active[r] = ~is_near & ~has_failed

    def _unsolved_error(self, r, matrix, defect):
        """Return the change of progress, (B,), m, that defects (B,), m/s, of unsolved
        steps may have caused."""
        # Of all later progress to a push at the start.
        response = solve_regular(np.moveaxis(matrix, 1, 2), self.gains[r])
        is_rate = self.strides.free >= 2
        largest = np.abs(response[:, is_rate]).max(-1)
        return defect * largest / self.strides.leg_speed[r] / self.period[r]

    def result(self) -> LimitCycles:
        """Return the limit cycles, with means over a few more cycles for robots without
        one."""
        limits = []
        for k, period in enumerate(self.period):
            state = self.state.take([k])
            limits.append(Limit(state, int(period), self.slopes[k], self.gains[k]))
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
        if rest.size:
            return _with_means(self.strides, self.limits, rest, cycles)
        return cycles


def _with_means(
    strides: Strides, limits: list[Limit], r, cycles: LimitCycles
) -> LimitCycles:
    """Fill in the means over a few cycles of the robots r, from the states of
    ``limits``."""
    n_strides = AVERAGED_CYCLES * strides.cycle
    first = _concatenate([limits[k].state for k in r])
    state = first
    places = [first.pose[:, 0]]
    for k in range(n_strides):
        _, states = strides.run(state, k, r)
        state = states.take(-1)
        places.append(state.pose[:, 0])
    moved = np.diff(places[:: strides.cycle], axis=0) * strides.period

    cycles.progress[r] = moved.mean(0)
    cycles.drift[r] = np.ptp(moved, axis=0)
    cycles.unsolved_error[r] = (
        (state.defect - first.defect)
        / AVERAGED_CYCLES
        / strides.cycle
        * strides.period
        / strides.frequency[r]
    )
    cycles.strides[r] += n_strides
    cycles.ends[r] = strides.end_status(state, r)
    for j, k in enumerate(r):
        cycles.limits[k] = Limit(state.take([j]), 1)
    return cycles


def _concatenate(states: list[State]) -> State:
    """Return the states of all robots as one."""
    return State(*(np.concatenate(x) for x in zip(*states)))


def solve_regular(matrix, right_side) -> np.ndarray:
    """Return the solutions (B, n) of linear equations, 0 for singular ones."""
    try:
        return np.linalg.solve(matrix, right_side[..., None])[..., 0]
    except np.linalg.LinAlgError:
        regular = np.linalg.det(matrix) != 0.0
        solution = np.zeros_like(right_side)
        solution[regular] = np.linalg.solve(
            matrix[regular], right_side[regular][..., None]
        )[..., 0]
        return solution
