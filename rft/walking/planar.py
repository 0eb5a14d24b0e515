"""Newton's equations of light-legged robots on grains in the vertical plane, many robots at once.

The state is the body's pose (x, z, pitch) and its rates; the legs have no mass and turn as the clock says.
`rft.walking.march` takes the steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.balance.newton import plus, times
from rft.ground import Ground
from rft.laws.catalogue import GRAVITY
from rft.plates.stress import PlateStress
from rft.vectors import formula
from rft.walking.elements import Elements, Outlines
from rft.walking.robot import Robot, Tripod, leg_angle, leg_rate, rounded

FIRST = np.eye(4)[1:, :, None]  # of four residuals the first is as it is, in the others one rate is changed
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
    """B robots of equally many legs and elements on the same kind of ground; ``at``: (K,) phases of the legs. ground:
    (B,), one rounding for all, of which slow legs take less."""

    def __init__(self, robots: list[Robot], gaits: list[Tripod], stress: PlateStress, ground: Ground, elements: int):
        column = lambda of, names: np.array([[getattr(x, name) for name in names] for x in of], float)
        self.weighed = column(robots, ("mass", "mass", "inertia"))
        self.frequency, *self.clock = column(gaits, ("frequency", "duty", "sweep", "middle")).T[..., None]
        first, count = robots[0], len(robots[0].apart)
        self.at = np.array([(k + j) % count / count for k in range(len(first.hips)) for j in range(count)])
        hip_x = np.array([np.repeat(r.hips, count) for r in robots])
        self.hips = np.stack([hip_x, np.zeros_like(hip_x) + column(robots, ("hip_height",))])
        self.legs, belly = Outlines.of(_each(robots, "leg", elements)), _each(robots, "belly", elements)
        self.belly = None if belly[0] is None else Outlines.of(belly)
        self.elements = Elements(self.legs, self.belly, self.hips, stress)
        self.reach = np.abs(self.legs.points).max((1, 2)) + np.zeros(len(robots))
        self.ground = ground._replace(rounding=rounded(ground.rounding, self.frequency[:, 0], self.reach))

    def __len__(self) -> int:
        return len(self.weighed)

    def ground_under(self, which, width=1.0) -> Ground:
        """The ground of these robots, (B,), its rounding times a width, and its grazing angle by the root of that."""
        g = self.ground
        wide = {"rounding": g.rounding[which] * width, "grazing_sine": g.grazing_sine * np.sqrt(width)}
        return g._replace(strength=g.strength[which], flux=g.flux[which], **wide)

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
        pose, twist = (tuple(np.moveaxis(x, -1, 0)) for x in (pose, twist))
        found = self.elements.sums(ground or self.ground_under(which), which, pose, twist, angle, rate)
        a = accelerations(found, self.weighed[which, 0], self.weighed[which, 2])
        return np.stack(a, -1), found.motors, found.into

    def residual(self, which, base, start, v, angle, rate, k, ground: Ground):
        """Of the rates v = start + k a(base + k v, v), triples of (B,), of these robots: (what they are off by, its slopes
        by differences, three columns, power of the motors and into the ground, (B,))."""
        nudge = nudges(ground.rounding, self.reach[which])
        tried = tuple(x + FIRST[j] * y for j, (x, y) in enumerate(zip(v, nudge)))
        pose = plus(base, times(k, tried))
        found = self.elements.sums(ground, which, pose, tried, angle, rate)
        off = imbalance(found, tried, start, k, self.weighed[which, 0], self.weighed[which, 2])
        slopes = tuple(tuple((x[j + 1] - x[0]) / y for x in off) for j, y in enumerate(nudge))
        return tuple(x[0] for x in off), slopes, (found.motors[0], found.into[0])


@formula
def accelerations(sums, mass, inertia):
    """Return those of a body, (x, z, pitch)."""
    return sums.f_x / mass, sums.f_z / mass - GRAVITY, sums.moment / inertia


@formula
def imbalance(sums, v, start, k, mass, inertia):
    """Return v - start - k a."""
    x, z, pitch = accelerations(sums, mass, inertia)
    return v[0] - start[0] - k * x, v[1] - start[1] - k * z, v[2] - start[2] - k * pitch


@formula
def nudges(rounding, reach):
    """Return by how much the rates are changed for differences."""
    nudge = NUDGE * rounding
    return nudge, nudge, nudge / reach


def _each(robots: list[Robot], what: str, elements: int) -> list:
    """Outlines, the same object for robots alike."""
    made: dict = {}
    keys = [repr(r) for r in robots]
    for r, key in zip(robots, keys):
        if key not in made:
            made[key] = getattr(r, what)(elements)
    return [made[key] for key in keys]
