"""Walking: stride after stride from rest, and what is told of a walk."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from rft.walking.march import march
from rft.walking.planar import GRAVITY, Robots, State
from rft.walking.robot import Robot, Tripod, parts

# What a cycle's start may differ from the last one's, and from all to come, for the cycle to be repeated: of the speed of the
# legs' ends, or of that of a fall for a cycle if that is less.
PERIODIC = 1e-3
SETTLED = 1e-3  # of a leg's reach: what the progress of a cycle may yet change, in all, at the limit
MOST_STRIDES = 10  # on the way to the limit cycle
FEW_STRIDES = 4  # the same from one that is near
LATE = 4  # cycles whose mean counts where there is no limit cycle
LIMPING = 0.5  # of the change from stride to stride, below which is that to the second next
STUCK = 0.02  # of a leg's reach; progress in a cycle below which a robot is stuck, assumed
NEAR = 0.05  # of the limit cycle's progress: what that of a cycle may differ from it by, to count as settled


class Walk(NamedTuple):
    """How one robot walks. t (T,), s; pose, twist (T, 3); work, loss (T,), J, of the motors and into the ground, and energy
    (T,), J, of the body: work = loss + change of energy. speed: m/s, mean of the limit cycle, or till the robot's end.
    status: "walking", "stuck", "sunk", "flipped" or "airborne". cycles: computed in all. periodic: whether the limit
    cycle was found. drift: m/s, what the speed may still change. limit: what is known of that, None of a robot that
    came to an end. unsolved: steps, of all computed, that were taken unsolved. residual: m/s, the largest that any step
    is off by. off: m/s, how far those unsolved move the speed. more: of three dimensions, y (m), roll and yaw (rad),
    (T,), and "states" (T, nq), MuJoCo's positions.

    settled: s from rest after which the progress of every cycle is within `NEAR` of the limit cycle's; inf of a robot that
    does not come to that, nan where there is no limit cycle. aside: m/s, to the left of the heading at a cycle's start, and
    turning: rad/s, to the left, the means over a cycle that the speed is of; 0 in the plane.
    """

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    work: np.ndarray
    loss: np.ndarray
    energy: np.ndarray
    speed: float
    status: str
    cycles: float
    periodic: bool
    drift: float
    limit: Any
    unsolved: int = 0
    residual: float = 0.0
    off: float = 0.0
    more: Mapping[str, np.ndarray] | None = None
    settled: float = np.nan
    aside: float = 0.0
    turning: float = 0.0

    @property
    def unaccounted(self) -> float:
        """Share of the motors' work that is neither loss nor energy: an error of the time steps."""
        left = self.work[-1] - self.loss[-1] - self.energy[-1] + self.energy[0]
        return float(abs(left) / self.work[-1]) if self.work[-1] > 0.0 else 0.0


def advanced(step: Callable, *at) -> Any:
    """Return step(*at), a stride from a state of numbers; another one in its place may store what that gives."""
    return step(*at)


class Strides:
    """Strides of B robots whose clocks have their kinks at the same phases. steps: of a cycle, about. Where two legs at
    a hip are half a cycle apart, a stride is half a cycle: in the plane they are alike. advance: as `advanced`."""

    def __init__(self, robots: Robots, makers: list[Robot], gaits: list[Tripod], steps: int, advance=advanced):
        self.advance = advance
        self.robots, self.period = robots, makers[0].period / len(makers[0].apart)
        self.cycle = round(1 / self.period)  # strides
        self.frequency, self.reach = robots.frequency[:, 0], robots.reach
        self.fast = 2 * np.pi * self.frequency * self.reach
        self.scale = np.stack([self.reach, np.ones(len(robots)), self.fast, self.fast, self.fast / self.reach])
        self.free = np.flatnonzero(np.isfinite(robots.weighed[0])[[1, 2, 0, 1, 2]])  # what is free to change
        height = np.array([r.height for r in makers])
        self.top = height / 2
        self.out_of_reach = self.reach + np.hypot(*np.abs(robots.hips)).max(1) + height
        kinks = gaits[0].kinks if self.cycle == 2 else _whole(gaits[0].kinks)
        spans = [np.linspace(a, b, count + 1) for a, b, count in parts(kinks, steps)]
        self.phases = np.concatenate([[0.0], *(x[1:] for x in spans)])
        self.of = np.concatenate([np.full(len(x) - 1, (x[0] + x[-1]) / 2) for x in spans])

    def run(self, state: State, stride: int, which: np.ndarray) -> tuple[np.ndarray, State]:
        """The next stride of these samples: (phases (S,), states (S, B) after each step); who is at an end stays there."""
        return stride * self.period + self.phases[1:], self.advance(self.states, stride, which, state)

    def states(self, stride: int, which: np.ndarray, state: State) -> State:
        """Return the states after each step of a stride, as in `run`."""
        begin = stride * self.period
        ends = self.top[which], self.out_of_reach[which]
        return march(self.robots, which, state, begin + self.phases, begin + self.of, ends)[0]

    def scaled(self, state: State, which) -> np.ndarray:
        """(n, B): what tells all that is to come, over what is large for these robots."""
        return np.concatenate([state.pose[:, 1:], state.twist], 1).T[self.free] / self.scale[self.free][:, which]

    def with_scaled(self, state: State, numbers: np.ndarray, which) -> State:
        """With these numbers (n, B)."""
        new = np.concatenate([state.pose[:, 1:], state.twist], 1)
        new[:, self.free] = (numbers * self.scale[self.free][:, which]).T
        return state._replace(pose=np.concatenate([state.pose[:, :1], new[:, :2]], 1), twist=new[:, 2:])

    def ended(self, state: State, which) -> np.ndarray:
        """(B,): how, or "" for those that go on."""
        z, pitch = state.pose[:, 1], np.abs(state.pose[:, 2])
        how = np.where(z + self.top[which] < 0.0, "sunk", np.where(z > self.out_of_reach[which], "airborne", ""))
        return np.where(pitch > np.pi / 2, "flipped", how)


def cycles_to_settle(moves, limit: float) -> float:
    """Cycles after which the progress of each, moves (N,), is within `NEAR` of the limit, m; inf if the last is not."""
    far = np.flatnonzero(~(np.abs(np.asarray(moves) - limit) <= NEAR * abs(limit)))
    after = far[-1] + 1 if far.size else 0
    return float(after) if after < len(moves) else np.inf


def _whole(kinks: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(sorted({*kinks, *(0.5 + k for k in kinks)}))


def from_rest(strides: Strides, durations: np.ndarray, progress: Callable = lambda done: None):
    """(state (B,), per sample rows (T, 9) of t, pose, twist, work and loss in blocks, strides (B,), "periodic" where
    the rest repeats the last cycle, or how the robot ended, and of how many strides the map to its limit is to
    consist): until a cycle repeats itself, a robot is at its end, or the duration is over. progress: told the fraction done."""
    count, state = len(strides.robots), strides.robots.placed()
    told = [[_rows(np.zeros(1), state.take([[k]]), 0)] for k in range(count)]
    most = np.ceil(durations * strides.frequency / strides.period - 1e-9).astype(int)
    done, how, going = np.zeros(count, int), np.full(count, "", "U10"), np.arange(count)
    starts, fold = [strides.scaled(state, going)] * 5, np.ones(count, int)
    quick = np.where(strides.free[:, None] >= 2, np.maximum(1.0, strides.fast * strides.frequency / GRAVITY), 1.0)
    for stride in range(most.max()):
        phases, states = strides.run(state.take(going), stride, going)
        state = state.put(going, states.take(-1))
        for j, k in enumerate(going):
            told[k].append(_rows(phases / strides.frequency[k], states, j))
        starts = [*starts[1:], strides.scaled(state, np.arange(count))]
        done[going] = stride + 1
        fold[going] = folds(*(x[:, going] for x in starts[-3:]))
        how[going] = strides.ended(state.take(going), going)
        here, last, before = ((x * quick)[:, going] for x in starts[:: -strides.cycle][:3])
        to_come = still_to_come(here - last, last - before, (most - done)[going] / strides.cycle)
        again = (how[going] == "") & (to_come < PERIODIC) & (stride >= strides.cycle)
        how[going] = np.where(again, "periodic", how[going])
        going = going[(how[going] == "") & (done[going] < most[going])]
        progress((stride + 1) / most[going].max(initial=stride + 1))
        if not going.size:
            break
    return state, told, done, how, fold


def still_to_come(change, before, cycles) -> np.ndarray:
    """(B,): what starts of cycles (n, B) may yet change, and the last change at least: the sum of all changes to come if they
    go on to shrink as that from the one before, but not more than if they stay as they are for so many cycles (B,)."""
    now, then = np.abs(change).max(0), np.abs(before).max(0)
    shrinks = now < then
    series = np.where(shrinks, now / np.where(shrinks, 1 - now / np.where(shrinks, then, 1.0), 1.0), np.inf)
    return np.minimum(series, now * np.maximum(1.0, cycles))


def folds(before, last, now) -> np.ndarray:
    """(B,): 2 for those that limp: from the scaled starts of two strides and of the next."""
    one, two = np.abs(now - last).max(0), np.abs(now - before).max(0)
    return np.where((one > PERIODIC) & (two < LIMPING * one), 2, 1)


def _rows(t, states: State, k: int) -> np.ndarray:
    """(T, 9)."""
    return np.column_stack([t, states.pose[:, k], states.twist[:, k], states.work[:, k], states.loss[:, k]])
