"""Newton's equations of light-legged robots on grains in the vertical plane, many robots at once.

The state is the body's pose (x, z, pitch) and its rates; the legs have no mass and turn as the clock says.
`rft.walking.march` takes the steps.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rft.media.catalogue import GRAVITY
from rft.walking.elements import Elements
from rft.walking.ground import Ground, Outlines
from rft.walking.robot import Robot, Tripod, leg_angle, leg_rate, rounded

NUDGE = 1e-3  # of the rates, times the rounding, for differences


class State(NamedTuple):
    """pose, twist: (..., B, 3) as (x, z, pitch) and their rates. work, loss: (..., B), J, of the motors and in the
    ground, so far. unsolved: (..., B), steps so far that Newton's method left unsolved, however short, and that were
    taken as they were.
    defect: (..., B), m/s, what these are off by, in all. residual: (..., B), m/s, the largest that a step is off by."""

    pose: np.ndarray
    twist: np.ndarray
    work: np.ndarray
    loss: np.ndarray
    unsolved: np.ndarray
    defect: np.ndarray
    residual: np.ndarray

    @classmethod
    def still(cls, pose: np.ndarray) -> State:
        """At rest there."""
        return cls(pose, np.zeros_like(pose), *np.zeros((5, *pose.shape[:-1])))

    def packed(self) -> np.ndarray:
        """(..., B, 11)."""
        return np.concatenate([self.pose, self.twist, *(x[..., None] for x in self[2:])], -1)

    @classmethod
    def unpacked(cls, numbers: np.ndarray) -> State:
        return cls(numbers[..., :3], numbers[..., 3:6], *np.moveaxis(numbers[..., 6:], -1, 0))

    def take(self, some) -> State:
        return State(*(x[some] for x in self))

    def put(self, some, other: State) -> State:
        """With these samples as in the other."""
        new = State(*(x.copy() for x in self))
        for x, y in zip(new, other):
            x[some] = y
        return new


class Robots:
    """B robots of equally many legs and elements on the same kind of ground; ``at``: (K,) phases of the legs."""

    def __init__(self, robots: list[Robot], gaits: list[Tripod], ground: Ground, elements: int):
        column = lambda of, names: np.array([[getattr(x, name) for name in names] for x in of], float)
        self.weighed = column(robots, ("mass", "mass", "inertia"))
        self.frequency, *self.clock = column(gaits, ("frequency", "duty", "sweep", "middle")).T[..., None]
        first, count = robots[0], len(robots[0].apart)
        self.at = np.array([(k + j) % count / count for k in range(len(first.hips)) for j in range(count)])
        hip_x = np.array([np.repeat(r.hips, count) for r in robots])
        self.hips = np.stack([hip_x, np.zeros_like(hip_x) + column(robots, ("hip_height",))])
        self.legs, belly = Outlines.of(_each(robots, "leg", elements)), _each(robots, "belly", elements)
        self.belly = None if belly[0] is None else Outlines.of(belly)
        self.elements = Elements(self.legs, self.belly, self.hips, ground.stress.tension)
        self.reach = np.abs(self.legs.points).max((1, 2)) + np.zeros(len(robots))
        self.ground = replace(ground, rounding=rounded(ground.rounding, self.frequency[:, 0], self.reach))
        self.size = np.stack([np.ones_like(self.reach)] * 2 + [self.reach], 1)  # what a rate moves at the hips

    def __len__(self) -> int:
        return len(self.weighed)

    def energy(self, state: State, which=slice(None)) -> np.ndarray:
        """(..., B), J: of motion and height, of these robots."""
        mass, inertia = self.weighed[which, 0], self.weighed[which, 2]
        v_x, v_z, rate = np.moveaxis(state.twist, -1, 0)
        turning = np.where(np.isfinite(inertia), inertia, 0.0) * rate**2
        return mass * (v_x**2 + v_z**2) / 2 + turning / 2 + mass * GRAVITY * state.pose[..., 1]

    def placed(self) -> State:
        """At rest, level, the lowest point of legs and body on the surface at the phase 0."""
        angle = self.turned(np.zeros(len(self)), 0.0)[0]
        low = [z + self.legs.lowest(turn) for z, turn in zip(self.hips[1].T, angle.T)]
        if self.belly:
            low.append(self.belly.lowest(np.zeros(len(self))) + np.zeros(len(self)))
        pose = np.zeros((len(self), 3))
        pose[:, 1] = -np.min(low, axis=0)
        return State.still(pose)

    def turned(self, phase, of, which=slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Angles (..., B, K) and rates (..., B, K), rad/s, of the legs of these robots at phases (..., B), by the rates
        that hold at ``of``, which is as long or a number."""
        of, clock = np.asarray(of)[..., None] + self.at, [x[which] for x in self.clock]
        angle = leg_angle(np.asarray(phase)[..., None] + self.at, of, *clock)
        return angle, self.frequency[which] * leg_rate(of, *clock[:2]) + 0.0 * angle

    def forces(self, pose, twist, angle, rate, which=None, ground: Ground | None = None):
        """Accelerations (C, B, 3) of bodies (C, B, 3) of these robots, at hardly different places, with legs at (B, K) that
        turn at (B, K), and power of the motors and into the ground, (C, B)."""
        which = np.arange(len(self)) if which is None else which
        found = self.elements.sums(ground or self.ground.take(which), which, pose, twist, angle, rate)
        acceleration = np.stack(found[:3], -1) / self.weighed[which]
        acceleration[..., 1] -= GRAVITY
        return acceleration, found.motors, found.into

    def residual(self, which, pose, twist, v, angle, rate, k, ground: Ground):
        """Of the rates v = twist + k a(pose + k v, v), (B, 3), of these robots: (what they are off by (B, 3), its slopes
        (B, 3, 3), by differences, power of the motors and into the ground, (B,))."""
        nudge = NUDGE * (ground.rounding * ground.width)[:, None] / self.size[which]
        tried = np.repeat(v[None], 4, 0)
        tried[[1, 2, 3], :, [0, 1, 2]] += nudge.T
        a, motors, into = self.forces(pose + k * tried, tried, angle, rate, which, ground)
        off = tried - twist - k * a
        return off[0], np.moveaxis((off[1:] - off[0]) / nudge.T[..., None], 0, -1), motors[0], into[0]


def _each(robots: list[Robot], what: str, elements: int) -> list:
    """Outlines, the same object for robots alike."""
    made: dict = {}
    keys = [repr(r) for r in robots]
    for r, key in zip(robots, keys):
        if key not in made:
            made[key] = getattr(r, what)(elements)
    return [made[key] for key in keys]
