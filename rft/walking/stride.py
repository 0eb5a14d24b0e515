"""Walking: stride after stride from rest, and the stride that repeats itself.

From stride to stride five numbers tell all that is to come: height, pitch and the three rates of the body at the start. The
map from these to the next is near its fixed point affine, and the last few strides tell it along the ways they went, so the
limit cycle is found without waiting for what dies out slowly (`rft.limit_cycle`).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from rft.limit_cycle import HeavyApproach
from rft.walking.planar import Robots, State
from rft.walking.robot import Robot, Tripod

PERIODIC = 1e-3  # of the speed of the legs' ends, what a stride's start may differ from the last one's, to be repeated
SETTLED = 1e-3  # of a leg's reach: what the progress of a stride may yet change, in all, at the limit
FEW_STRIDES = 4  # the same from one that is near
MOST_STRIDES = 10  # on the way to the limit cycle
LATE = 4  # strides whose mean counts where there is no limit cycle
STUCK = 0.02  # of a leg's reach; progress in a cycle below which a robot is stuck, assumed
FARTHEST_KICK = 0.2  # of a leg's reach, and of the speed of its end: kicks beyond are not taken


class Walk(NamedTuple):
    """How one robot walks. t (T,), s; pose, twist (T, 3); work, loss (T,), J, of the motors and into the ground, and energy
    (T,), J, of the body: work = loss + change of energy. speed: m/s, mean of the limit cycle, or till the robot's end. status:
    "walking", "stuck", "sunk", "flipped" or "airborne". cycles: computed in all. periodic: whether the limit cycle was
    found. drift: m/s, what the speed may still change. limit: its state there, None where there is none. unsolved: steps,
    of all computed, that were taken unsolved (`State`). more: of three dimensions, y (m), roll and yaw (rad), (T,), and
    "states" (T, nq), MuJoCo's positions.
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
    more: Mapping[str, np.ndarray] | None = None


class Strides:
    """Strides of B robots whose clocks have their kinks at the same phases. steps: of a cycle, about."""

    def __init__(self, robots: Robots, makers: list[Robot], gaits: list[Tripod], steps: int):
        self.robots, self.period = robots, makers[0].period
        self.frequency = np.array([g.frequency for g in gaits])
        self.reach = np.abs(robots.legs.points).max((1, 2)) + np.zeros(len(robots))
        self.fast = 2 * np.pi * self.frequency * self.reach
        self.scale = np.stack([self.reach, np.ones(len(robots)), self.fast, self.fast, self.fast / self.reach])
        height = np.array([r.height for r in makers])
        self.top = height / 2
        self.out_of_reach = self.reach + np.hypot(np.abs(robots.hip_x), np.abs(robots.hip_z)).max(1) + height
        kinks = _whole(gaits[0].kinks)
        self.segments = [(a, b, max(1, round(steps * (b - a)))) for a, b in pairwise(kinks)]

    def run(self, state: State, stride: int, which: np.ndarray):
        """The next stride of these samples: states after each step, (phases (S,), [State])."""
        robots, f, rows, phases = self.robots.take(which), self.frequency[which], [], []
        ended = self.ended(state, which)
        for begin, end, steps in self.segments:
            begin, end = begin + stride * self.period, end + stride * self.period
            for k in range(steps):
                phase, dt = begin + (end - begin) * k / steps, (end - begin) / steps
                going = np.flatnonzero(ended == "")
                some = robots if len(going) == len(which) else robots.take(going)
                if going.size:
                    here = np.full(len(going), phase)
                    state = state.put(going, some.step(state.take(going), here, (begin + end) / 2, dt / f[going]))
                ended = self.ended(state, which)
                rows.append(state)
                phases.append(phase + dt)
        return np.array(phases), rows

    def ended(self, state: State, which) -> np.ndarray:
        """(B,): how, or "" for those that go on."""
        z, pitch = state.pose[:, 1], np.abs(state.pose[:, 2])
        how = np.where(z + self.top[which] < 0.0, "sunk", np.where(z > self.out_of_reach[which], "airborne", ""))
        return np.where(pitch > np.pi / 2, "flipped", how)


def _whole(kinks: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(sorted({*kinks, *(0.5 + k for k in kinks)}))


def section(state: State) -> np.ndarray:
    """(5, B): what tells all that is to come."""
    return np.concatenate([state.pose[:, 1:], state.twist], 1).T


def from_rest(strides: Strides, durations: np.ndarray):
    """Per sample (t, [states as rows (T, 8)], strides, whether the rest repeats the last): until a stride repeats itself, a
    robot is at its end, or the duration is over."""
    count, state = len(strides.robots), strides.robots.placed()
    told = [[np.concatenate([[0.0], _row(state, k)])[None]] for k in range(count)]
    most = np.ceil(durations * strides.frequency / strides.period - 1e-9).astype(int)
    done, how, going = np.zeros(count, int), np.full(count, "", "U10"), np.arange(count)
    for stride in range(most.max()):
        start = section(state)[:, going]
        phases, rows = strides.run(state.take(going), stride, going)
        state = state.put(going, rows[-1])
        for j, k in enumerate(going):
            block = np.array([_row(r, j) for r in rows])
            told[k].append(np.column_stack([phases / strides.frequency[k], block]))
        change = np.abs((section(state)[:, going] - start) / strides.scale[:, going]).max(0)
        done[going] = stride + 1
        how[going] = strides.ended(state.take(going), going)
        how[going] = np.where((how[going] == "") & (change < PERIODIC), "periodic", how[going])
        going = going[(how[going] == "") & (done[going] < most[going])]
        if not going.size:
            break
    return state, told, done, how


def _row(state: State, k: int) -> np.ndarray:
    return np.concatenate([state.pose[k], state.twist[k], [state.work[k], state.loss[k]]])


def limit_cycle(strides: Strides, state: State, most: int = MOST_STRIDES):
    """(state at the start of a stride, progress of a stride (B,), what it may yet change (B,), periodic (B,), strides (B,),
    ends (B,)) at the limit, from some state of each."""
    count = len(strides.robots)
    approach, going = HeavyApproach(count, 5), np.arange(count)
    start, end, moved = np.zeros((5, count)), np.zeros((5, count)), np.zeros((1, count))
    history, done, drift = [], np.zeros(count, int), np.full(count, np.inf)
    for k in range(most):
        before, x = section(state), state.pose[:, 0].copy()
        _, rows = strides.run(state.take(going), k, going)
        state = state.put(going, rows[-1])
        start[:, going], end[:, going] = ((y / strides.scale)[:, going] for y in (before, section(state)))
        moved[0, going] = (state.pose[:, 0] - x)[going]
        history.append(moved[0].copy())
        done[going] += 1
        drift[going] = approach.after(start.copy(), end.copy(), moved.copy())[going]
        ended = strides.ended(state, np.arange(count)) != ""
        going = going[(drift[going] > SETTLED * strides.reach[going]) & ~ended[going]]
        if not going.size or k == most - 1:
            break
        kick = approach.kick(np.isin(np.arange(count), going))
        kick = np.where((np.abs(kick) < FARTHEST_KICK).all(0), kick, 0.0) * strides.scale
        pose, twist = state.pose.copy(), state.twist.copy()
        pose[:, 1:], twist = pose[:, 1:] + kick[:2].T, twist + kick[2:].T
        state = state._replace(pose=pose, twist=twist)
    periodic = drift <= SETTLED * strides.reach
    late = np.array(history[-LATE:])
    progress = np.where(periodic, moved[0], late.mean(0))
    drift = np.where(periodic, drift, np.ptp(late, axis=0))
    return state, progress, drift, periodic, done, strides.ended(state, np.arange(count))
