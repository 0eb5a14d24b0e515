"""Newton's equations of light-legged robots on grains in the vertical plane, many
robots at once.

The state is the body's pose (x, z, pitch) and its rates; the legs have no mass and
rotate by the clock. `rft.terradynamics.walking.planar.march` steps in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.formulas.newton import plus, times
from rft.formulas.vectors import formula
from rft.laws.incline import gravity_on_incline
from rft.terradynamics.ground import Ground
from rft.terradynamics.plates.stress import PlateStress
from rft.terradynamics.walking.planar.elements import Elements, Outlines
from rft.terradynamics.walking.robot import (
    Robot,
    Tripod,
    leg_angle,
    leg_rate,
    walking_rounding,
)

# Which rate is changed in each of four residuals; none in the first.
IS_CHANGED = np.eye(4)[1:, :, None]
NUDGE = 1e-3  # change of a rate for differences, over the rounding


class State(NamedTuple):
    """State of B robots. pose, twist: (..., B, 3) as (x, z, pitch) and their rates.
    work, loss: (..., B), J, of the motors and in the ground since the start. unsolved:
    (..., B), number of steps that were accepted unsolved, since Newton's method failed
    even at the shortest length. defect: (..., B), m/s, sum of the residuals of these
    steps. residual: (..., B), m/s, the largest of all steps."""

    pose: np.ndarray
    twist: np.ndarray
    work: np.ndarray
    loss: np.ndarray
    unsolved: np.ndarray
    defect: np.ndarray
    residual: np.ndarray

    @classmethod
    def at_rest(cls, pose: np.ndarray) -> State:
        """Return the state at rest in a pose."""
        return cls(pose, np.zeros_like(pose), *np.zeros((5, *pose.shape[:-1])))

    def to_array(self) -> np.ndarray:
        """Return the state as one array (..., B, 11)."""
        return np.concatenate(
            [self.pose, self.twist, *(x[..., None] for x in self[2:])], -1
        )

    @classmethod
    def from_array(cls, numbers: np.ndarray) -> State:
        """Return the state that `to_array` has put into an array (..., B, 11)."""
        return cls(
            numbers[..., :3], numbers[..., 3:6], *np.moveaxis(numbers[..., 6:], -1, 0)
        )

    def take(self, index) -> State:
        """Return the states at an index of the first axis."""
        return State(*(x[index] for x in self))

    def put(self, index, other: State) -> State:
        """Return a copy with the states at an index of the first axis from
        ``other``."""
        new = State(*(x.copy() for x in self))
        for x, y in zip(new, other):
            x[index] = y
        return new


class Robots:
    """B robots of equally many legs and elements on one kind of ground.

    x is along the surface, z along its normal. ground: (B,), with one rounding for all,
    which is reduced for slow legs. slopes: angles by which the surfaces rise along x,
    rad, (B,); all level by default. gravity: (B, 2), m/s^2, along x and z. masses:
    (B, 3), mass, mass and moment of inertia: those of x, z and pitch. frequency:
    (B, 1), Hz. hips: (2, B, K), x and z from the centre of mass, m. leg_phases: (K,),
    cycles. reach: (B,), m, of the legs from their hips."""

    def __init__(
        self,
        robots: list[Robot],
        gaits: list[Tripod],
        stress: PlateStress,
        ground: Ground,
        elements: int,
        slopes: Sequence[float] | None = None,
    ):
        if slopes is None:
            slopes = [0.0] * len(robots)
        self.gravity = np.array([gravity_on_incline(angle) for angle in slopes])
        self.masses = _columns(robots, ("mass", "mass", "inertia"))
        self.frequency, *self.clock = _columns(
            gaits, ("frequency", "duty", "sweep", "middle")
        ).T[..., None]

        # The legs at a hip share the cycle, and alternate from hip to hip.
        n_hips = len(robots[0].hips)
        count = len(robots[0].hip_phases)
        offsets = np.arange(n_hips)[:, None] + np.arange(count)
        self.leg_phases = offsets.ravel() % count / count
        hip_x = np.array([np.repeat(r.hips, count) for r in robots])
        hip_z = np.zeros_like(hip_x) + _columns(robots, ("hip_height",))
        self.hips = np.stack([hip_x, hip_z])

        self.legs = Outlines.from_list(_outlines(robots, "leg", elements))
        belly = _outlines(robots, "belly", elements)
        self.belly = None if belly[0] is None else Outlines.from_list(belly)
        self.elements = Elements(self.legs, self.belly, self.hips, stress)
        self.reach = np.abs(self.legs.points).max((1, 2)) + np.zeros(len(robots))
        self.ground = ground._replace(
            rounding=walking_rounding(ground.rounding, self.frequency[:, 0], self.reach)
        )

    def __len__(self) -> int:
        return len(self.masses)

    def ground_under(self, index, width=1.0) -> Ground:
        """Return the ground of these robots (B,), with the rounding times a width and
        the grazing sine times its root."""
        ground = self.ground
        return ground._replace(
            strength=ground.strength[index],
            flux=ground.flux[index],
            downhill_loss=ground.downhill_loss[index],
            rounding=ground.rounding[index] * width,
            grazing_sine=ground.grazing_sine * np.sqrt(width),
        )

    def energy(self, state: State, index=slice(None)) -> np.ndarray:
        """Return the kinetic and potential energy (..., B), J, of these robots."""
        mass = self.masses[index, 0]
        inertia = self.masses[index, 2]
        # A robot that keeps its pitch has an infinite inertia.
        inertia = np.where(np.isfinite(inertia), inertia, 0.0)
        v_x, v_z, rate = np.moveaxis(state.twist, -1, 0)
        x, z, _ = np.moveaxis(state.pose, -1, 0)
        along, normal = self.gravity[index].T
        return (
            mass * (v_x**2 + v_z**2) / 2
            + inertia * rate**2 / 2
            - mass * (along * x + normal * z)
        )

    def start(self) -> State:
        """Return the state at rest at phase 0: level, with the lowest point of legs and
        body on the surface."""
        angles = self.leg_motion(np.zeros(len(self)), 0.0)[0]
        heights = [
            z + self.legs.lowest_height(angle)
            for z, angle in zip(self.hips[1].T, angles.T)
        ]
        if self.belly:
            level = np.zeros(len(self))
            heights.append(self.belly.lowest_height(level) + level)
        pose = np.zeros((len(self), 3))
        pose[:, 1] = -np.min(heights, axis=0)
        return State.at_rest(pose)

    def leg_motion(
        self, phase, rate_phase, index=slice(None)
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return angles (..., B, K), rad, and rates (..., B, K), rad/s, of the legs of
        these robots at phases (..., B), by the rates of the clock at ``rate_phase``,
        (..., B) or a number."""
        rate_phase = np.asarray(rate_phase)[..., None] + self.leg_phases
        clock = [x[index] for x in self.clock]
        angle = leg_angle(
            np.asarray(phase)[..., None] + self.leg_phases, rate_phase, *clock
        )
        rate = self.frequency[index] * leg_rate(rate_phase, *clock[:2])
        # Where one rate phase stands for all, the sum has the shape of the angles.
        return angle, rate + 0.0 * angle

    def accelerations(
        self, pose, twist, angle, rate, index=None, ground: Ground | None = None
    ):
        """Return accelerations (C, B, 3) of these robots, and power of the motors and
        into the ground, W, (C, B).

        pose, twist: (C, B, 3); the C motions of a robot hardly differ. angle, rate:
        (B, K), of the legs, rad and rad/s."""
        index = np.arange(len(self)) if index is None else index
        pose = tuple(np.moveaxis(pose, -1, 0))
        twist = tuple(np.moveaxis(twist, -1, 0))
        ground = ground or self.ground_under(index)
        load = self.elements.load(ground, index, pose, twist, angle, rate)
        a = accelerations(load, *self._inertias(index))
        return np.stack(a, -1), load.motor_power, load.ground_power

    def _inertias(self, index) -> tuple:
        """Return masses and moments of inertia (B,), and gravity, a pair of (B,)."""
        return (
            self.masses[index, 0],
            self.masses[index, 2],
            tuple(self.gravity[index].T),
        )

    def residual(
        self, index, base, start, v, angle, rate, k, ground: Ground, shares=None
    ):
        """Return the residual of v = start + k a(base + k v, v) of these robots,
        triples of (B,), its slopes by differences, three columns, and power of the
        motors and into the ground, W, (B,). shares: as of `Elements.load`."""
        nudge = difference_steps(ground.rounding, self.reach[index])
        trial = tuple(x + IS_CHANGED[j] * y for j, (x, y) in enumerate(zip(v, nudge)))
        pose = plus(base, times(k, trial))
        load = self.elements.load(ground, index, pose, trial, angle, rate, shares)
        residual = stage_residual(load, trial, start, k, *self._inertias(index))
        slopes = []
        for j, y in enumerate(nudge):
            slopes.append(tuple((x[j + 1] - x[0]) / y for x in residual))
        power = (load.motor_power[0], load.ground_power[0])
        return tuple(x[0] for x in residual), tuple(slopes), power


@formula
def accelerations(load, mass, inertia, gravity):
    """Return the accelerations (x, z, pitch) of a body under a `BodyLoad` and
    gravity (x, z)."""
    return (
        load.f_x / mass + gravity[0],
        load.f_z / mass + gravity[1],
        load.moment / inertia,
    )


@formula
def stage_residual(load, v, start, k, mass, inertia, gravity):
    """Return v - start - k a, a triple, m/s and rad/s."""
    x, z, pitch = accelerations(load, mass, inertia, gravity)
    return v[0] - start[0] - k * x, v[1] - start[1] - k * z, v[2] - start[2] - k * pitch


@formula
def difference_steps(rounding, reach):
    """Return the changes of the rates (x, z, pitch) for differences."""
    nudge = NUDGE * rounding
    return nudge, nudge, nudge / reach


def _columns(objects: list, names: tuple[str, ...]) -> np.ndarray:
    """Return attributes of objects, an array with a row for each object."""
    return np.array([[getattr(x, name) for name in names] for x in objects], float)


def _outlines(robots: list[Robot], method: str, elements: int) -> list:
    """Return the outlines of robots by one of their methods, the same object for equal
    robots."""
    outlines: dict = {}
    keys = [repr(robot) for robot in robots]
    for robot, key in zip(robots, keys):
        if key not in outlines:
            outlines[key] = getattr(robot, method)(elements)
    return [outlines[key] for key in keys]
