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
    and z from the body's centre of mass to the hip. pose, twist: (x, z, pitch) and
    rates."""
    cos = np.cos(pose[2])
    sin = np.sin(pose[2])
    pitch_rate = twist[2]
    r_x = cos * hip_x + sin * hip_z
    r_z = cos * hip_z - sin * hip_x
    v_x = twist[0] + pitch_rate * r_z
    v_z = twist[1] - pitch_rate * r_x
    total = pose[2] + angle
    return (
        Motion(
            pose[0] + r_x,
            pose[1] + r_z,
            np.cos(total),
            np.sin(total),
            v_x,
            v_z,
            pitch_rate + rate,
        ),
        r_x,
        r_z,
    )


@formula
def body_load(f, g, r_x, r_z, rate):
    """Return the `BodyLoad` of the force ``f`` on a part that moves by ``g`` and
    rotates at a rate about its hip."""
    power = f.x * g.v_x + f.z * g.v_z + f.moment * g.rate
    return BodyLoad(
        f.x, f.z, f.moment + r_z * f.x - r_x * f.z, -rate * f.moment, -power
    )


class Outlines(NamedTuple):
    """Outlines of B robots, of equally many elements, all closed or none; a single one
    where all robots share it. points: (B or 1, N + 1, 2), m. elements: (B or 1, N)."""

    points: np.ndarray
    elements: Element
    closed: bool

    @classmethod
    def from_list(cls, outlines: list[Outline]) -> Outlines:
        """Return the outlines of B robots as arrays."""
        first = outlines[0]
        distinct = [first] if all(o is first for o in outlines) else outlines
        return cls(
            np.stack([o.points for o in distinct]),
            Element(*map(np.stack, zip(*map(elements, distinct)))),
            first.closed,
        )

    def lowest(self, angle) -> np.ndarray:
        """Return the height (B,), m, of the lowest point over the origin, of outlines
        rotated by angles (B,)."""
        x = self.points[..., 0]
        z = self.points[..., 1]
        return (np.cos(angle)[:, None] * z - np.sin(angle)[:, None] * x).min(-1)


class Elements:
    """Elements of B robots with equally many legs and elements. hips: (2, B, legs), x
    and z from the centre of mass, m.

    A part is one side of all elements of a leg, or of the belly, P in all. leg, side,
    closed: (P,), the number of its leg, that of the belly after all legs; its side; 1
    for a closed outline, 0 for a sheet."""

    def __init__(
        self,
        legs: Outlines,
        belly: Outlines | None,
        hips: np.ndarray,
        stress: PlateStress,
    ):
        count = hips.shape[2]
        self.law = record(stress)
        parts = [
            (k, legs, side)
            for side in sides(legs.closed, stress.tension)
            for k in range(count)
        ]
        parts += (
            [(count, belly, side) for side in sides(belly.closed, stress.tension)]
            if belly
            else []
        )
        leg, outlines, side = zip(*parts)
        self.leg = np.array(leg)
        self.outlines = outlines
        self.side = np.array(side)
        self.closed = np.array([float(x.closed) for x in outlines])
        self.hips = np.concatenate([hips, np.zeros_like(hips[..., :1])], 2)[
            ..., self.leg
        ]
        self.span = np.hypot(*self.hips).max(-1) + 2 * max(
            np.abs(x.points).max() for x in outlines
        )
        size = max(len(x.points) for x in outlines)

        def joined(*fields):
            return np.concatenate(
                [np.broadcast_to(x, (size, x.shape[1])) for x in fields], 1
            )

        self.elements = Element(*map(joined, *(x.elements for x in outlines)))
        self.part = np.repeat(
            np.arange(len(parts)), [x.elements.area.shape[1] for x in outlines]
        )

    def load(self, ground: Ground, index, pose, twist, angle, rate) -> BodyLoad:
        """Return the load (C, B) on the robots ``index`` (B,).

        pose, twist: (x, z, pitch) and rates, triples of (C, B); the C motions of a
        robot hardly differ. angle, rate: (B, legs), of the legs, rad and rad/s. ground:
        that of these robots, (B,)."""
        zero = np.zeros((len(index), 1))
        angle, rate = (np.concatenate([x, zero], 1)[:, self.leg] for x in (angle, rate))
        pose, twist = (tuple(x[..., None] for x in y) for y in (pose, twist))
        g, r_x, r_z = part_motion(pose, twist, *self.hips[:, index], angle, rate)
        motions = np.empty((len(g), *r_x.shape))
        for row, x in zip(motions, g):
            row[:] = x
        force = Force(*self._part_forces(ground, index, motions))
        return BodyLoad(*(x.sum(-1) for x in body_load(force, g, r_x, r_z, rate)))

    @cached_property
    def table(self) -> tuple[np.ndarray, np.ndarray]:
        """Elements in rows of eight (R, 9, 8), and the first and last row (B, P, 2) of
        every part."""
        from rft.terradynamics.plates.compiled import rows_of_eight

        tables = []
        blocks = {}
        first = 0
        for outline in self.outlines:
            if id(outline) not in blocks:
                tables.append(rows_of_eight(outline.elements))
                robots, length = tables[-1].shape[:2]
                begin = first + length * np.broadcast_to(
                    np.arange(robots), len(self.span)
                )
                blocks[id(outline)] = np.stack([begin, begin + length], -1)
                first = first + robots * length
        rows = np.concatenate([x.reshape(-1, *x.shape[2:]) for x in tables])
        return rows, np.stack([blocks[id(outline)] for outline in self.outlines], 1)

    def _part_forces(self, ground: Ground, index, motions) -> np.ndarray:
        """Return force (x, z), N, and moment about its hip, N m, on every part
        (3, C, B, P), at motions (7, C, B, P)."""
        out = np.zeros((3, *motions.shape[1:]))
        rotation = np.abs(np.diff(motions[2:4], axis=1)).sum((0, 1))
        margin = (
            np.ptp(motions[1], axis=0) + self.span[index, None] * rotation
        )  # of heights between the C motions
        own = self.elements
        per_robot = len(self.elements.area) > 1
        z, cos, sin = motions[1:4, 0][..., self.part]
        x1, z1, x2, z2 = (x[index] if per_robot else x for x in own[:4])
        lowest = z + np.minimum(cos * z1 - sin * x1, cos * z2 - sin * x2)
        robot, element = np.nonzero(lowest <= margin[:, self.part])
        if not robot.size:
            return out
        part = self.part[element]
        e = Element(*(x[index[robot] if per_robot else 0, element] for x in own))
        g = Motion(*motions[:, :, robot, part])
        side = self.side[part]
        sine = ground.grazing_sine
        element_ground = Ground(
            ground.strength[robot], ground.flux[robot], ground.rounding[robot],
            self.closed[part] * (sine[robot] if np.ndim(sine) else sine), ground.downhill_loss, ground.disturbed,
        )  # fmt: skip
        force = np.array(
            load(self.law, element_ground, e, g, side, bool(side.any()), True)
        )
        column = robot * motions.shape[3] + part
        begins = np.flatnonzero(np.diff(column, prepend=-1))
        out.reshape(*out.shape[:2], -1)[..., column[begins]] = np.add.reduceat(
            force, begins, axis=-1
        )
        return out
