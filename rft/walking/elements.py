"""Legs and belly of many robots as straight elements, of which those that reach into the ground are summed.

Legs and belly are parts that turn about a hip. Their contact with the ground is that of `rft.plates.contact`; by
NumPy the elements of all robots that reach into it stand in one row, so that a sum costs what they have in the ground,
not what they are."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rft.ground import Ground
from rft.plates.contact import Element, Force, Motion, elements, load, record, sides
from rft.plates.outline import Outline
from rft.plates.stress import PlateStress
from rft.vectors import formula


class Sums(NamedTuple):
    """Force (x, z), N, and moment, N m, on bodies about their centres of mass; power of the motors and into the ground,
    W."""

    f_x: np.ndarray
    f_z: np.ndarray
    moment: np.ndarray
    motors: np.ndarray
    into: np.ndarray


@formula
def part_motion(pose, twist, hip_x, hip_z, angle, rate):
    """Return the motion of a part that turns at a rate about a hip of a body, and x and z from the body's centre of
    mass to the hip. pose, twist: (x, z, pitch) and rates."""
    cos, sin, spin = np.cos(pose[2]), np.sin(pose[2]), twist[2]
    r_x, r_z = cos * hip_x + sin * hip_z, cos * hip_z - sin * hip_x
    turn = pose[2] + angle
    at = Motion(
        pose[0] + r_x, pose[1] + r_z, np.cos(turn), np.sin(turn), twist[0] + spin * r_z, twist[1] - spin * r_x, spin + rate
    )  # fmt: skip
    return at, r_x, r_z


@formula
def on_body(f, at, r_x, r_z, rate):
    """Return what a part with a force on it adds to `Sums`."""
    power = f.x * at.v_x + f.z * at.v_z + f.moment * at.rate
    return Sums(f.x, f.z, f.moment + r_z * f.x - r_x * f.z, -rate * f.moment, -power)


class Outlines(NamedTuple):
    """Outlines of equally many elements, all closed or none, of B robots, or one that is the same for all. points: (B or
    1, N + 1, 2). elements: (B or 1, N)."""

    points: np.ndarray
    elements: Element
    closed: bool

    @classmethod
    def of(cls, outlines: list[Outline]) -> Outlines:
        first = outlines[0]
        some = [first] if all(o is first for o in outlines) else outlines
        return cls(np.stack([o.points for o in some]), Element(*map(np.stack, zip(*map(elements, some)))), first.closed)

    def lowest(self, angle) -> np.ndarray:
        """(B,): height of the lowest point over the origin, turned by angles (B,)."""
        x, z = self.points[..., 0], self.points[..., 1]
        return (np.cos(angle)[:, None] * z - np.sin(angle)[:, None] * x).min(-1)


class Elements:
    """Of B robots with as many legs and elements. hips: (2, B, legs), x and z from the centre of mass, m.

    A part is one side of the elements of a leg, or of the belly: leg: (P,), which one, the belly as the last."""

    def __init__(self, legs: Outlines, belly: Outlines | None, hips: np.ndarray, stress: PlateStress):
        count, self.law = hips.shape[2], record(stress)
        some = [(k, legs, side) for side in sides(legs.closed, stress.tension) for k in range(count)]
        some += [(count, belly, side) for side in sides(belly.closed, stress.tension)] if belly else []
        self.leg, outlines, self.side = np.array([k for k, *_ in some]), *([x[j] for x in some] for j in (1, 2))
        self.outlines, self.side = outlines, np.array(self.side)
        self.closed = np.array([float(x.closed) for x in outlines])
        self.hips = np.concatenate([hips, np.zeros_like(hips[..., :1])], 2)[..., self.leg]
        self.span = np.hypot(*self.hips).max(-1) + 2 * max(np.abs(x.points).max() for x in outlines)
        size = max(len(x.points) for x in outlines)
        joined = lambda *of: np.concatenate([np.broadcast_to(x, (size, x.shape[1])) for x in of], 1)
        self.elements = Element(*map(joined, *(x.elements for x in outlines)))
        self.part = np.repeat(np.arange(len(some)), [x.elements.area.shape[1] for x in outlines])

    def sums(self, ground: Ground, rows, pose, twist, angle, rate) -> Sums:
        """For robots ``rows``, (B,), at poses and twists (x, z, pitch), triples of (C, B), that hardly differ, whose
        legs are at angles (B, legs), rad, and turn at rates (B, legs), rad/s: (C, B). ground: of these robots, (B,)."""
        still = np.zeros((len(rows), 1))
        angle, rate = (np.concatenate([x, still], 1)[:, self.leg] for x in (angle, rate))
        pose, twist = (tuple(x[..., None] for x in y) for y in (pose, twist))
        at, r_x, r_z = part_motion(pose, twist, *self.hips[:, rows], angle, rate)
        motions = np.empty((len(at), *r_x.shape))
        for row, x in zip(motions, at):
            row[:] = x
        force = Force(*self._summed(ground, rows, motions))
        return Sums(*(x.sum(-1) for x in on_body(force, at, r_x, r_z, rate)))

    @cached_property
    def table(self) -> tuple[np.ndarray, np.ndarray]:
        """The elements in rows of eight (R, 9, 8), and the first and last row (B, P, 2) of every part."""
        from rft.plates.compiled import rows_of_eight

        tables, begins, first = [], {}, 0
        for one in self.outlines:
            if id(one) not in begins:
                tables.append(rows_of_eight(one.elements))
                robots, length = tables[-1].shape[:2]
                begin = first + length * np.broadcast_to(np.arange(robots), len(self.span))
                begins[id(one)], first = np.stack([begin, begin + length], -1), first + robots * length
        blocks = np.stack([begins[id(one)] for one in self.outlines], 1)
        return np.concatenate([x.reshape(-1, *x.shape[2:]) for x in tables]), blocks

    def _summed(self, ground: Ground, rows, motions) -> np.ndarray:
        """(3, C, B, P): force (x, z) and moment about its hip on every part, at motions (7, C, B, P)."""
        out = np.zeros((3, *motions.shape[1:]))
        turns = np.abs(np.diff(motions[2:4], axis=1)).sum((0, 1))
        room = np.ptp(motions[1], axis=0) + self.span[rows, None] * turns
        own, more = self.elements, len(self.elements.area) > 1
        z, cos, sin = motions[1:4, 0][..., self.part]
        x1, z1, x2, z2 = (x[rows] if more else x for x in own[:4])
        sample, element = np.nonzero(z + np.minimum(cos * z1 - sin * x1, cos * z2 - sin * x2) <= room[:, self.part])
        if not sample.size:
            return out
        part = self.part[element]
        e = Element(*(x[rows[sample] if more else 0, element] for x in own))
        at, side, sine = Motion(*motions[:, :, sample, part]), self.side[part], ground.grazing_sine
        under = Ground(
            ground.strength[sample], ground.flux[sample], ground.rounding[sample],
            self.closed[part] * (sine[sample] if np.ndim(sine) else sine), ground.downhill_loss, ground.disturbed,
        )  # fmt: skip
        force = np.array(load(self.law, under, e, at, side, bool(side.any()), True))
        place = sample * motions.shape[3] + part
        begins = np.flatnonzero(np.diff(place, prepend=-1))
        out.reshape(*out.shape[:2], -1)[..., place[begins]] = np.add.reduceat(force, begins, axis=-1)
        return out
