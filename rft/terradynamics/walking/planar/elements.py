"""Legs and belly of many robots as straight elements, and the load of the ground on
them.

Legs and belly are parts that rotate about a hip. Their contact with the ground is that
of `rft.terradynamics.plates.contact`. By NumPy the elements of all robots that reach
into the ground are evaluated as one array, so elements above it cost little."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rft.formulas.vectors import formula
from rft.terradynamics.ground import Ground
from rft.terradynamics.plates.contact import (
    Element,
    Force,
    Motion,
    elements,
    load,
    record,
    sides,
)
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.plates.stress import PlateStress


class BodyLoad(NamedTuple):
    """Force (x, z), N, and moment, N m, on bodies about their centres of mass; power of
    the motors and into the ground, W."""

    f_x: np.ndarray
    f_z: np.ndarray
    moment: np.ndarray
    motor_power: np.ndarray
    ground_power: np.ndarray


@formula
def part_motion(pose, twist, hip_x, hip_z, angle, rate):
    """Return the motion of a part that rotates at a rate about a hip of a body, and x
    and z from the body's centre of mass to the hip.

    pose, twist: of the body, (x, z, pitch) and their rates."""
    cos = np.cos(pose[2])
    sin = np.sin(pose[2])
    pitch_rate = twist[2]
    r_x = cos * hip_x + sin * hip_z
    r_z = cos * hip_z - sin * hip_x
    v_x = twist[0] + pitch_rate * r_z
    v_z = twist[1] - pitch_rate * r_x
    total_angle = pose[2] + angle
    motion = Motion(
        pose[0] + r_x,
        pose[1] + r_z,
        np.cos(total_angle),
        np.sin(total_angle),
        v_x,
        v_z,
        pitch_rate + rate,
    )
    return motion, r_x, r_z


@formula
def body_load(f, g, r_x, r_z, rate):
    """Return the `BodyLoad` of the force ``f`` on a part with the motion ``g`` that
    rotates at a rate about its hip, (r_x, r_z) from the centre of mass."""
    power = f.x * g.v_x + f.z * g.v_z + f.moment * g.rate
    return BodyLoad(
        f.x, f.z, f.moment + r_z * f.x - r_x * f.z, -rate * f.moment, -power
    )


class Outlines(NamedTuple):
    """Outlines of B robots, of equally many elements, all closed or none.

    points: (B or 1, N + 1, 2), m; a single outline stands for all robots that share it.
    elements: (B or 1, N)."""

    points: np.ndarray
    elements: Element
    closed: bool

    @classmethod
    def from_list(cls, outlines: list[Outline]) -> Outlines:
        """Return the outlines of B robots as arrays."""
        first = outlines[0]
        is_shared = all(outline is first for outline in outlines)
        distinct = [first] if is_shared else outlines
        fields = zip(*map(elements, distinct))
        return cls(
            np.stack([outline.points for outline in distinct]),
            Element(*map(np.stack, fields)),
            first.closed,
        )

    def lowest_height(self, angle) -> np.ndarray:
        """Return the height (B,), m, of the lowest point over the origin, of outlines
        rotated by angles (B,)."""
        x = self.points[..., 0]
        z = self.points[..., 1]
        return (np.cos(angle)[:, None] * z - np.sin(angle)[:, None] * x).min(-1)


class Elements:
    """Elements of B robots with equally many legs and elements.

    A part is one side of all elements of a leg or of the belly, P in all. leg: (P,),
    number of its leg, that of the belly after all legs. side: (P,), as in
    `rft.terradynamics.plates.contact.load`. closed: (P,), 1 for a closed outline, 0 for
    a sheet. hips: (2, B, legs), x and z from the centre of mass, m; kept for each part,
    (2, B, P). span: (B,), m, bound of the distance of elements from the centre of
    mass."""

    def __init__(
        self,
        legs: Outlines,
        belly: Outlines | None,
        hips: np.ndarray,
        stress: PlateStress,
    ):
        self.law = record(stress)
        n_legs = hips.shape[2]
        parts = []
        for side in sides(legs.closed, stress.tension):
            parts += [(k, legs, side) for k in range(n_legs)]
        if belly:
            parts += [
                (n_legs, belly, side) for side in sides(belly.closed, stress.tension)
            ]
        leg, outlines, side = zip(*parts)
        self.leg = np.array(leg)
        self.outlines = outlines
        self.side = np.array(side)
        self.closed = np.array([float(x.closed) for x in outlines])

        # The belly rotates about the centre of mass, the last "hip".
        hips = np.concatenate([hips, np.zeros_like(hips[..., :1])], 2)
        self.hips = hips[..., self.leg]
        farthest = max(np.abs(x.points).max() for x in outlines)
        self.span = np.hypot(*self.hips).max(-1) + 2 * farthest

        n_robots = max(len(x.points) for x in outlines)

        def concatenate_parts(*fields):
            rows = [np.broadcast_to(x, (n_robots, x.shape[1])) for x in fields]
            return np.concatenate(rows, 1)

        fields = zip(*(x.elements for x in outlines))
        self.elements = Element(*(concatenate_parts(*field) for field in fields))
        sizes = [x.elements.area.shape[1] for x in outlines]
        self.part = np.repeat(np.arange(len(parts)), sizes)

    def load(
        self, ground: Ground, index, pose, twist, angle, rate, shares=None
    ) -> BodyLoad:
        """Return the load (C, B) on the robots ``index`` (B,).

        pose, twist: (x, z, pitch) and rates, triples of (C, B); the C motions of a
        robot hardly differ. angle, rate: (B, legs), of the legs, rad and rad/s. ground:
        that of these robots, (B,). shares: (B, legs), of the force of undisturbed
        ground on each leg; by default all of it."""
        belly = np.zeros((len(index), 1))
        angle = np.concatenate([angle, belly], 1)[:, self.leg]
        rate = np.concatenate([rate, belly], 1)[:, self.leg]
        pose = tuple(x[..., None] for x in pose)
        twist = tuple(x[..., None] for x in twist)
        g, r_x, r_z = part_motion(pose, twist, *self.hips[:, index], angle, rate)
        motions = np.empty((len(g), *r_x.shape))
        for row, x in zip(motions, g):
            row[:] = x
        force = Force(*self._part_forces(ground, index, motions))
        if shares is not None:
            of_parts = self.shares_of_parts(shares)
            force = Force(*(x * of_parts for x in force))
        return BodyLoad(*(x.sum(-1) for x in body_load(force, g, r_x, r_z, rate)))

    def shares_of_parts(self, shares) -> np.ndarray:
        """Return shares (B, P) of the parts from those of the legs (B, legs); the belly
        has all of the force."""
        belly = np.ones((len(shares), 1))
        return np.concatenate([shares, belly], 1)[:, self.leg]

    @cached_property
    def table(self) -> tuple[np.ndarray, np.ndarray]:
        """Elements in rows of eight (R, 9, 8), and the first and last row (B, P, 2) of
        every part, for compiled code."""
        from rft.terradynamics.plates.compiled import rows_of_eight

        tables: list[np.ndarray] = []
        blocks: dict = {}
        first = 0
        for outline in self.outlines:
            # Legs share their outline, and its rows.
            if id(outline) in blocks:
                continue
            tables.append(rows_of_eight(outline.elements))
            robots, length = tables[-1].shape[:2]
            starts = np.broadcast_to(np.arange(robots), len(self.span))
            begin = first + length * starts
            blocks[id(outline)] = np.stack([begin, begin + length], -1)
            first += robots * length
        rows = np.concatenate([x.reshape(-1, *x.shape[2:]) for x in tables])
        return rows, np.stack([blocks[id(outline)] for outline in self.outlines], 1)

    def _part_forces(self, ground: Ground, index, motions) -> np.ndarray:
        """Return force (x, z), N, and moment about its hip, N m, on every part
        (3, C, B, P), at motions (7, C, B, P)."""
        out = np.zeros((3, *motions.shape[1:]))
        robot, element = self._low_elements(index, motions)
        if not robot.size:
            return out

        # All of them as one array.
        part = self.part[element]
        row = index[robot] if self._has_row_per_robot else 0
        e = Element(*(x[row, element] for x in self.elements))
        g = Motion(*motions[:, :, robot, part])
        side = self.side[part]
        sine = ground.grazing_sine
        if np.ndim(sine):
            sine = sine[robot]
        loss = ground.downhill_loss
        if np.ndim(loss):
            loss = loss[robot]
        element_ground = Ground(
            ground.strength[robot],
            ground.flux[robot],
            ground.rounding[robot],
            self.closed[part] * sine,
            loss,
            ground.disturbed,
        )
        forces = load(self.law, element_ground, e, g, side, bool(side.any()), True)

        # The elements of a part follow each other.
        column = robot * motions.shape[3] + part
        begins = np.flatnonzero(np.diff(column, prepend=-1))
        sums = np.add.reduceat(np.array(forces), begins, axis=-1)
        out.reshape(*out.shape[:2], -1)[..., column[begins]] = sums
        return out

    @property
    def _has_row_per_robot(self) -> bool:
        """Whether elements have a row for each robot, not one for all."""
        return len(self.elements.area) > 1

    def _low_elements(self, index, motions) -> tuple[np.ndarray, np.ndarray]:
        """Return the pairs of a robot's place in ``index`` and an element of it that
        may reach into the ground in one of the C motions."""
        # The first motion decides, with a margin for the others.
        rotation = np.abs(np.diff(motions[2:4], axis=1)).sum((0, 1))
        margin = np.ptp(motions[1], axis=0) + self.span[index, None] * rotation

        z, cos, sin = motions[1:4, 0][..., self.part]
        corners = self.elements[:4]
        if self._has_row_per_robot:
            corners = [x[index] for x in corners]
        x1, z1, x2, z2 = corners
        lowest = z + np.minimum(cos * z1 - sin * x1, cos * z2 - sin * x2)
        return np.nonzero(lowest <= margin[:, self.part])
