"""The planar engine: robots that are alike side by side, from rest and at their limit cycle, with the error of the speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rft.media.base import require
from rft.vertical.stress import PlateStress
from rft.walking.engines import Fineness, Walker
from rft.walking.ground import Ground
from rft.walking.planar import Robots, State
from rft.walking.robot import Rhex, Roller
from rft.walking.stride import FEW_STRIDES, MOST_STRIDES, STUCK, Strides, Walk, from_rest, limit_cycle


def refuse(walker: Walker) -> None:
    """ValueError for a walker that this engine does not take."""
    require(isinstance(walker.stress, PlateStress), "a law of three dimensions takes --engine mujoco")
    planar = isinstance(walker.robot, Rhex | Roller)
    require(planar, f"the planar engine knows no {type(walker.robot).__name__} robot: use --engine mujoco")


def walk(walkers: Sequence[Walker], numerics: Fineness, settling: int | None = None) -> list[Walk]:
    """Each walker from rest for the duration, or so many cycles, or to its end; its speed at the limit cycle."""
    found: list = [None] * len(walkers)
    for walker in walkers:
        refuse(walker)
    for members in _alike(walkers, numerics):
        for k, one in zip(members, _walk([walkers[k] for k in members], numerics, settling)):
            found[k] = one
    return found


def _alike(walkers: Sequence[Walker], numerics: Fineness) -> list[list[int]]:
    """Those that go into one batch."""
    groups: dict = {}
    for k, w in enumerate(walkers):
        outlines = [o for o in (w.robot.leg(numerics.elements), w.robot.belly(numerics.elements)) if o is not None]
        shapes = tuple((o.elements, o.closed, o.bends is None) for o in outlines)
        key = repr((type(w.robot), len(w.robot.hips), shapes, replace(w.stress, zeta=1.0), w.gait.kinks))
        groups.setdefault(key, []).append(k)
    return list(groups.values())


def _strides(walkers: Sequence[Walker], numerics: Fineness) -> Strides:
    column = lambda values: np.array(values, float)[:, None]
    strength, flux = column([w.strength for w in walkers]), column([w.flux for w in walkers])
    ground = Ground(replace(walkers[0].stress, zeta=1.0), strength, flux, np.full_like(flux, numerics.rounding))
    robots, gaits = [w.robot for w in walkers], [w.gait for w in walkers]
    return Strides(Robots(robots, gaits, ground, numerics.elements), robots, gaits, numerics.steps)


def _walk(walkers: Sequence[Walker], numerics: Fineness, settling: int | None) -> list[Walk]:
    strides = _strides(walkers, numerics)
    durations = settling / strides.frequency if settling else np.full(len(walkers), numerics.duration)
    state, told, done, how = from_rest(strides, durations)
    paths = [_told(blocks, how[k] == "periodic", durations[k]) for k, blocks in enumerate(told)]
    mean = np.array([rows[-1, 1] / rows[-1, 0] for rows in paths])
    found = Speeds(
        mean, how, np.zeros(len(walkers)), np.zeros(len(walkers), bool), done * strides.period, [None] * len(walkers)
    )
    here = np.flatnonzero(np.isin(how, ("", "periodic")))
    if here.size:
        found = found.put(here, _limits([walkers[k] for k in here], numerics, state.take(here)))
    walks = []
    for k, rows in enumerate(paths):
        states = State(rows[:, 1:4], rows[:, 4:7], rows[:, 7], rows[:, 8], 0.0 * rows[:, 8])
        energy = strides.robots.take([k]).energy(states)
        unsolved = state.unsolved[k] if found.limit[k] is None else found.limit[k].unsolved[0]
        walks.append(Walk(rows[:, 0], *states[:4], energy, *found.of(k), int(unsolved)))
    return walks


class Speeds(NamedTuple):
    """Of (B,) robots, as in `Walk`."""

    speed: np.ndarray
    status: np.ndarray
    drift: np.ndarray
    periodic: np.ndarray
    cycles: np.ndarray
    limit: list

    def of(self, k: int):
        """speed, status, cycles, periodic, drift, limit of one, as they stand in `Walk`."""
        numbers = float(self.cycles[k]), bool(self.periodic[k]), float(self.drift[k])
        return float(self.speed[k]), str(self.status[k]), *numbers, self.limit[k]

    def put(self, some, other: Speeds) -> Speeds:
        """With these as in the other, and the cycles of both."""
        new = Speeds(*(x.copy() for x in self))
        for x, y in zip(new[:4], other[:4]):
            x[some] = y
        new.cycles[some] += other.cycles
        for k, limit in zip(some, other.limit):
            new.limit[k] = limit
        return new


def _limits(walkers: Sequence[Walker], numerics: Fineness, state: State, most: int = MOST_STRIDES) -> Speeds:
    """At the limit cycle, from some state of each."""
    strides = _strides(walkers, numerics)
    limit, progress, change, periodic, count, ends = limit_cycle(strides, state, most)
    per = strides.frequency / strides.period
    stuck = np.abs(progress) < STUCK * strides.period * strides.reach
    status = np.where(ends != "", ends, np.where(stuck, "stuck", "walking"))
    limits = [limit.take([k]) for k in range(len(walkers))]
    return Speeds(progress * per, status, change * per, periodic, count * strides.period, limits)


def _told(blocks, periodic: bool, duration: float) -> np.ndarray:
    """Rows (T, 9): t, pose, twist, work and loss; the last stride, where it repeats itself, till the duration is over."""
    rows = np.concatenate(blocks)
    if periodic:
        last, before = blocks[-1], blocks[-2][-1]
        gain = np.zeros(9)
        gain[[0, 1, 7, 8]] = (last[-1] - before)[[0, 1, 7, 8]]
        more = int(np.ceil((duration - rows[-1, 0]) / gain[0]))
        rows = np.concatenate([rows, *(last + k * gain for k in range(1, more + 1))])
    return rows[rows[:, 0] <= duration + 1e-9]


def again(
    walkers: Sequence[Walker], numerics: Fineness, walks: Sequence[Walk], settling: int | None = None
) -> list[Walk]:
    """The same with other numerics; where there is a limit cycle, from there, and nothing but what is said of that is new."""
    found: list = [None] * len(walkers)
    ended = [k for k, w in enumerate(walks) if w.limit is None]
    for k, one in zip(ended, walk([walkers[k] for k in ended], numerics, settling)):
        found[k] = one
    rest = [k for k, w in enumerate(walks) if w.limit is not None]
    for members in _alike([walkers[k] for k in rest], numerics):
        here = [rest[m] for m in members]
        state = State(*(np.concatenate(x) for x in zip(*(walks[k].limit for k in here))))
        speeds = _limits([walkers[k] for k in here], numerics, state, FEW_STRIDES)
        for j, k in enumerate(here):
            found[k] = Walk(*walks[k][:6], *speeds.of(j), int(speeds.limit[j].unsolved[0]))
    return found
