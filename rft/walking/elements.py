"""Legs and belly of many robots as one list of straight elements, of which those that reach into the ground are summed.

An element belongs to a part, a leg or the belly, that turns about its hip. The sum is that of `rft.vertical.loads`:
midpoints of what is below the surface and, of the faces of closed outlines, leads. Elements of all robots stand in one
row, so that a sum costs what they have in the ground, not what they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.vertical.loads import Parts, _below
from rft.walking.ground import Ground, Outlines

SIDES = {"keep": (0,), "cut": (1, -1)}  # of sheets: both at once, or one by one where it matters which leads


class Sums(NamedTuple):
    """(C, B): force (x, z), N, and moment, N m, on bodies about their centres of mass; power of the motors and into the
    ground, W."""

    f_x: np.ndarray
    f_z: np.ndarray
    moment: np.ndarray
    motors: np.ndarray
    into: np.ndarray


class Elements:
    """Of B robots with as many legs and elements. hips: (2, B, legs), x and z from the centre of mass, m.

    part: (E,), to which leg an element belongs, or to the belly as the last. side: (E,), 1 and -1 for faces along and
    against its normal, 0 for that which leads. numbers: (9, B or 1, E), in the part's frame: x of both ends and of the
    normals there, z of the same, and area.
    """

    def __init__(self, legs: Outlines, belly: Outlines | None, hips: np.ndarray, tension: str):
        count, sides = hips.shape[2], lambda outlines: (1,) if outlines.closed else SIDES[tension]
        some = [(k, legs, side) for k in range(count) for side in sides(legs)]
        some += [(count, belly, side) for side in sides(belly)] if belly else []
        size = max(len(outlines.points) for _, outlines, _ in some)
        numbers = [np.broadcast_to(x, (9, size, x.shape[2])) for x in (_numbers(o) for _, o, _ in some)]
        self.numbers = np.concatenate(numbers, 2)
        each = lambda values: np.repeat(values, [x.shape[2] for x in numbers])
        self.part, self.side = each([k for k, _, _ in some]), each([side for _, _, side in some])
        self.closed = each([o.closed for _, o, _ in some])
        self.hips = np.concatenate([hips, np.zeros_like(hips[..., :1])], 2) if belly else hips
        self.span = np.hypot(*self.hips).max(-1) + 2 * np.abs(self.numbers[[0, 1, 4, 5]]).max()

    def sums(self, ground: Ground, rows, pose, twist, angle, rate) -> Sums:
        """For robots ``rows``, (B,), at poses and twists (C, B, 3) that hardly differ, whose legs are at angles (B,
        legs), rad, and turn at rates (B, legs), rad/s. ground: of these robots."""
        parts = self._parts(self.hips[:, rows], pose, twist, angle, rate)
        own = self.numbers[:, rows] if self.numbers.shape[1] > 1 else self.numbers
        room = np.ptp(pose[..., 1], axis=0) + self.span[rows] * np.ptp(pose[..., 2], axis=0)
        cos, sin, z = (x[0][:, self.part] for x in (parts[0], parts[1], parts[4]))
        low = np.minimum(cos * own[4] - sin * own[0], cos * own[5] - sin * own[1])
        sample, element = np.nonzero(z + low <= room[:, None])
        if not sample.size:
            return Sums(*np.zeros((5, *pose.shape[:2])))
        place = element + sample * own.shape[2] if own.shape[1] > 1 else element
        own = np.take(own.reshape(len(own), -1), place, axis=1)[:, None]
        here = np.take(parts.reshape(*parts.shape[:2], -1), sample * parts.shape[3] + self.part[element], axis=2)
        each = self._each(ground.take(sample, self.closed[element]), own, here, self.side[element])
        return Sums(*_by_sample(each, sample, pose.shape[1]))

    def _parts(self, hips, pose, twist, angle, rate):
        """(9, C, B, parts): cos and sin of a part's angle, its hip from the centre of mass and over the surface, the hip's
        velocity, the part's spin, and what of it is the motor's."""
        if angle.shape[1] < hips.shape[2]:
            angle, rate = (np.concatenate([x, np.zeros_like(x[:, :1])], 1) for x in (angle, rate))
        turn, spin = pose[..., 2:], twist[..., 2:]
        cos, sin = np.cos(turn), np.sin(turn)
        out = np.empty((9, *pose.shape[:2], hips.shape[2]))
        out[0], out[1] = np.cos(turn + angle), np.sin(turn + angle)
        out[2], out[3] = cos * hips[0] + sin * hips[1], cos * hips[1] - sin * hips[0]
        out[4] = pose[..., 1:2] + out[3]
        out[5], out[6] = twist[..., :1] + spin * out[3], twist[..., 1:2] - spin * out[2]
        out[7], out[8] = spin + rate, rate
        return out

    def _each(self, ground: Ground, numbers, parts, side):
        """(5, C, n): what every element adds to `Sums`."""
        cos, sin, r_x, r_z, height, v_x, v_z, spin, rate = parts
        ends = np.empty((6, 2, *cos.shape))  # arm, velocity and normal, each as x and z, at both ends
        x, z = numbers[:4], numbers[4:8]
        turned_x, turned_z = cos * x + sin * z, cos * z - sin * x
        ends[0], ends[1], ends[4], ends[5] = turned_x[:2], turned_z[:2], turned_x[2:], turned_z[2:]
        ends[2], ends[3] = v_x + spin * ends[1], v_z - spin * ends[0]
        across = side * (ends[4] * ends[2] + ends[5] * ends[3]) + (side == 0)
        first, last = _below(*np.stack([height + ends[1], -across], 1))
        first, last = np.maximum(*first), np.minimum(*last)
        part, middle = np.maximum(last - first, 0.0), (first + last) / 2
        a_x, a_z, v_x, v_z, n_x, n_z = ends[:, 0] + middle * (ends[:, 1] - ends[:, 0])
        speed, size = np.sqrt(v_x * v_x + v_z * v_z), np.sqrt(n_x * n_x + n_z * n_z)
        still = speed == 0.0
        per, size = 1.0 / np.where(still, 1.0, speed), np.where(side < 0, -size, size)
        depth = np.where((part > 0.0) & ~still, -(height + a_z), 0.0)
        n, v, area = (n_x / size, n_z / size), (v_x * per, v_z * per), numbers[8] * part
        t_x, t_z = ground.on(Parts(a_x, (a_x, a_z), depth, area, n, v, speed))
        f_x, f_z = area * t_x, area * t_z
        out = np.empty((5, *f_x.shape))
        hip = a_z * f_x - a_x * f_z
        out[0], out[1], out[2] = f_x, f_z, hip + r_z * f_x - r_x * f_z
        out[3], out[4] = -rate * hip, -(f_x * v_x + f_z * v_z)
        return out


def _numbers(outlines: Outlines) -> np.ndarray:
    """(9, B or 1, E)."""
    p, area = outlines.points, outlines.width * outlines.lengths
    n = outlines.normals[:, :, None].repeat(2, 2) if outlines.bends is None else outlines.bends
    size = max(len(p), len(area))
    columns = [of[..., k] for k in (0, 1) for of in (p[:, :-1], p[:, 1:], n[:, :, 0], n[:, :, 1])]
    return np.stack([np.broadcast_to(x, (size, area.shape[1])) for x in (*columns, area)])


def _by_sample(values, sample, count: int) -> np.ndarray:
    """(5, C, count): sums of values (5, C, n) of samples (n,) in order."""
    begins = np.flatnonzero(np.diff(sample, prepend=-1))
    out = np.zeros((*values.shape[:2], count))
    out[..., sample[begins]] = np.add.reduceat(values, begins, axis=-1)
    return out
