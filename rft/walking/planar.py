"""Newton's equations of light-legged robots on grains in the vertical plane, many robots at once.

The state is the body's pose (x, z, pitch) and its rates; the legs have no mass and turn as the clock says. The law knows of
speed its direction alone, so it is stiff wherever something is nearly at rest: explicit steps chatter there, and linearly
implicit ones too, as a step may begin in slip and end in stick. So each stage is solved to its end: SDIRK2 of Alexander,
SIAM J. Numer. Anal. 14, 1006 (1977), of order 2, L-stable and stiffly accurate, by Newton's method on the three rates, with
slopes by differences that are columns of the batch of which the forces come. A step that Newton's method does not solve is
halved. Steps end where the clock's rate jumps.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rft.media.catalogue import GRAVITY
from rft.vertical.loads import _loads
from rft.walking.ground import Ground, Outlines
from rft.walking.robot import Robot, Tripod

ORDER = 2  # of the error in 1/steps
GAMMA = 1.0 - np.sqrt(0.5)  # of SDIRK2
NUDGE = 1e-3  # of the rates, times the rounding, for differences
SOLVED = 1e-3  # m/s, times the rounding: what a stage may be off by
ITERATIONS, HALVINGS = 10, 3  # of Newton's method, and of a step that it does not solve
WIDER = (30.0, 8.0, 3.0, 1.5, 1.0)  # times the rounding, where Newton's method fails at once
LEAST = 0.05  # of a step of Newton's method, below which it is given up
ENOUGH = 0.1  # of the fall of the residual that Newton's method foretells


class State(NamedTuple):
    """pose, twist: (B, 3) as (x, z, pitch) and their rates. work, loss: (B,), J, of the motors and in the ground, so far.
    unsolved: (B,), steps so far that Newton's method left unsolved, however short, and that were taken as they were."""

    pose: np.ndarray
    twist: np.ndarray
    work: np.ndarray
    loss: np.ndarray
    unsolved: np.ndarray

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
        self.ground, self.gaits = ground, gaits
        column = lambda values: np.array(values, float)[:, None]
        self.mass, self.inertia = column([r.mass for r in robots]), column([r.inertia for r in robots])
        first, count = robots[0], len(robots[0].apart)
        self.at = np.array([(k + j) % count / count for k in range(len(first.hips)) for j in range(count)])
        self.hip_x = np.array([np.repeat(r.hips, count) for r in robots])
        self.hip_z = np.repeat(column([r.hip_height for r in robots]), len(self.at), 1)
        self.legs, belly = Outlines.of(_each(robots, "leg", elements)), _each(robots, "belly", elements)
        self.belly = None if belly[0] is None else Outlines.of(belly)
        reach = column([np.abs(leg.points).max() for leg in _each(robots, "leg", elements)])
        self.size = np.concatenate(
            [np.ones_like(reach), np.ones_like(reach), reach], 1
        )  # what a rate moves at the hips

    def take(self, some) -> Robots:
        """These samples of them."""
        new = object.__new__(Robots)
        new.ground, new.gaits, new.at = self.ground.take(some), [self.gaits[k] for k in some], self.at
        for name in ("mass", "inertia", "hip_x", "hip_z", "size"):
            setattr(new, name, getattr(self, name)[some])
        new.legs, new.belly = self.legs.take(some), self.belly and self.belly.take(some)
        return new

    def __len__(self) -> int:
        return len(self.mass)

    def energy(self, state: State) -> np.ndarray:
        """(B,), J: of motion and height."""
        turning = np.where(np.isfinite(self.inertia), self.inertia, 0.0)[:, 0] * state.twist[:, 2] ** 2
        mass, (v_x, v_z, _) = self.mass[:, 0], state.twist.T
        return mass * (v_x**2 + v_z**2) / 2 + turning / 2 + mass * GRAVITY * state.pose[:, 1]

    def placed(self) -> State:
        """At rest, level, the lowest point of legs and body on the surface at the phase 0."""
        angle = self.turned(np.zeros(len(self)), 0.0)[0]
        low = [self.hip_z[:, k] + self.legs.lowest(angle[:, k]) for k in range(len(self.at))]
        if self.belly:
            low.append(self.belly.lowest(np.zeros(len(self))) + np.zeros(len(self)))
        pose = np.zeros((len(self), 3))
        pose[:, 1] = -np.min(low, axis=0)
        return State(pose, np.zeros_like(pose), *np.zeros((3, len(self))))

    def turned(self, phase, of) -> tuple[np.ndarray, np.ndarray]:
        """Angles (B, K) and rates (B, K), rad/s, of the legs at phases (B,), by the rates that hold at ``of``."""
        rates = [g.frequency * g.rate(of + self.at) for g in self.gaits]
        return np.array([g.angle(p + self.at, of + self.at) for g, p in zip(self.gaits, phase)]), np.array(rates)

    def touching(self, state: State, phase) -> np.ndarray:
        """(B,): whether anything is below the surface."""
        angle, rate = self.turned(phase, phase[0])
        return self.forces(state.pose[None], state.twist[None] + 1e-9, angle, rate)[2][0] > 0.0

    def forces(self, pose, twist, angle, rate) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Accelerations (C, B, 3) of bodies (C, B, 3) with legs at (B, K) that turn at (B, K), and power of the motors and
        into the ground, (C, B)."""
        found = [self._of(self.legs, pose, twist, self.hip_x, self.hip_z, angle, rate)]
        if self.belly:
            none = np.zeros((len(self), 1))
            found.append(self._of(self.belly, pose, twist, none, none, none, none))
        wrench, motors, ground = (sum(x) for x in zip(*found))
        acceleration = wrench / np.concatenate([self.mass, self.mass, self.inertia], 1)
        acceleration[..., 1] -= GRAVITY
        return acceleration, motors, ground

    def _of(self, outlines: Outlines, pose, twist, hip_x, hip_z, angle, rate):
        """(wrench on the body (C, B, 3) about its centre of mass, power of the motors, power into the ground (C, B))."""
        cos, sin = np.cos(pose[..., 2:]), np.sin(pose[..., 2:])
        r_x, r_z = cos * hip_x + sin * hip_z, cos * hip_z - sin * hip_x
        v_x, v_z, turn = (
            twist[..., :1] + twist[..., 2:] * r_z,
            twist[..., 1:2] - twist[..., 2:] * r_x,
            twist[..., 2:] + rate,
        )
        place = np.stack([np.zeros_like(r_x), pose[..., 1:2] + r_z, pose[..., 2:] + angle], -1)
        f_x, f_z, moment = self._loads(outlines, place, np.stack([v_x, v_z, turn], -1))
        wrench = np.stack([f_x.sum(-1), f_z.sum(-1), (moment + r_z * f_x - r_x * f_z).sum(-1)], -1)
        into = -(f_x * v_x + f_z * v_z + moment * turn).sum(-1)
        return wrench, -(moment * rate).sum(-1), into

    def _loads(self, outlines: Outlines, place, motion):
        """(3, C, B, K): f_x, f_z and moment about the hip; of those alone that reach into the ground."""
        shape = place.shape[:-1]
        place, motion = place.reshape(-1, 3), motion.reshape(-1, 3)
        sample = np.broadcast_to(np.arange(shape[1])[:, None], shape).ravel()
        there = np.flatnonzero(place[:, 1] + outlines.take(sample).lowest(place[:, 2]) < 0.0)
        out, sample = np.zeros((3, len(place))), sample[there]
        if there.size:
            force, moment = _loads(
                self.ground.take(sample, outlines.closed), outlines.take(sample), place[there], motion[there]
            )
            out[:2, there], out[2, there] = force.T, moment
        return out.reshape(3, *shape)

    def step(self, state: State, phase, of: float, dt, halvings: int = HALVINGS) -> State:
        """From phases (B,) on for dt (B,), s, while the legs turn at the rates that hold at the phase ``of``."""
        h, (angle, rate) = dt[:, None], self.turned(phase, of)
        k = GAMMA * h
        v, motors, ground, solved = self._stage(state.pose, state.twist, state.twist, angle + k * rate, rate, k)
        first, slope = (motors, ground), (v - state.twist) / k
        pose, twist = state.pose + (h - k) * v, state.twist + (h - k) * slope
        v, motors, ground, also = self._stage(pose, twist, v, angle + h * rate, rate, k)
        work, loss = (dt * ((1 - GAMMA) * a + GAMMA * b) for a, b in zip(first, (motors, ground)))
        new = State(pose + k * v, v, state.work + work, state.loss + loss, state.unsolved)
        bad = np.flatnonzero(~(solved & also))
        if not bad.size:
            return new
        if not halvings:
            return new._replace(unsolved=state.unsolved + ~(solved & also))
        few, half, there = self.take(bad), dt[bad] / 2, phase[bad]
        middle = few.step(state.take(bad), there, of, half, halvings - 1)
        later = there + half * np.array([g.frequency for g in few.gaits])
        return new.put(bad, few.step(middle, later, of, half, halvings - 1))

    def _stage(self, pose, twist, guess, angle, rate, k):
        """The rates v = twist + k a(pose + k v, v), (B, 3), power of the motors and into the ground there, and whether they
        are found: at once, or by way of wider roundings."""
        found = self._newton(pose, twist, guess, angle, rate, k)
        bad = np.flatnonzero(~found[3])
        if not bad.size:
            return found
        few, here = self.take(bad), guess[bad]
        parts = [x[bad] for x in (pose, twist, angle, rate, k)]
        plain = few.ground
        for wider in WIDER:
            few.ground = replace(plain, rounding=wider * plain.rounding)
            solved = few._newton(*parts[:2], here, *parts[2:])
            here = solved[0]
        for x, y in zip(found, solved):
            x[bad] = y
        return found

    def _newton(self, pose, twist, guess, angle, rate, k):
        """The same from a guess."""
        found, motors, ground = guess.copy(), np.zeros(len(self)), np.zeros(len(self))
        limit, good = SOLVED * self.ground.rounding[:, 0] + np.zeros(len(self)), np.zeros(len(self), bool)
        left, share, last = np.arange(len(self)), np.ones(len(self)), np.full(len(self), np.inf)
        here, step = found.copy(), np.zeros_like(found)
        for _ in range(ITERATIONS):
            few = self if len(left) == len(self) else self.take(left)
            residual, slopes, m, g = few._residual(
                pose[left], twist[left], here[left], angle[left], rate[left], k[left]
            )
            size = np.abs(residual * few.size).max(-1)
            better = size <= (1.0 - ENOUGH * share[left]) * last[left]
            took = left[better]
            found[took], motors[took], ground[took], last[took] = here[took], m[better], g[better], size[better]
            try:
                step[took] = -np.linalg.solve(slopes[better], residual[better][..., None])[..., 0]
            except np.linalg.LinAlgError:
                break
            share[left] = np.where(better, 1.0, share[left] / 2)
            good[took] = size[better] <= limit[took]
            here[left] = found[left] + share[left, None] * step[left]
            left = left[~good[left] & (share[left] > LEAST)]
            if not left.size:
                break
        return found, motors, ground, good

    def _residual(self, pose, twist, v, angle, rate, k):
        """(residual (B, 3), its slopes (B, 3, 3), powers (B,), (B,)) of a stage."""
        nudge = NUDGE * self.ground.rounding[..., None] * np.eye(3) / self.size[:, None]
        tried = np.concatenate([v[None], v + np.moveaxis(nudge + np.zeros((len(v), 1, 1)), 1, 0)])
        a, motors, ground = self.forces(pose + k * tried, tried, angle, rate)
        off = tried - twist - k * a
        slopes = (off[1:] - off[0]) / np.diagonal(nudge, axis1=1, axis2=2).T[..., None]
        return off[0], np.moveaxis(slopes, 0, -1), motors[0], ground[0]


def _each(robots: list[Robot], what: str, elements: int) -> list:
    """Outlines, the same object for robots alike."""
    made: dict = {}
    keys = [repr(r) for r in robots]
    for r, key in zip(robots, keys):
        if key not in made:
            made[key] = getattr(r, what)(elements)
    return [made[key] for key in keys]
