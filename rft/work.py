"""What the medium does to a moving body, element by element: forces, power, internal moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.bodies.base import Body
from rft.effects.base import Effect
from rft.loads import element_load
from rft.media.base import Medium


class Work(NamedTuple):
    """power: (...), rate of work against the medium, >= 0, in units of (the whole body's axial drag) x (length / time).
    moment: (..., n - 1), internal moment at the points between the n elements, what the head's side of each exerts on
    the tail's side through it, in axial drag x length. slip: (...), mean over the body of the angle between an element's
    direction and the velocity of its centre, 0 to pi/2 rad."""

    power: np.ndarray
    moment: np.ndarray
    slip: np.ndarray


def work(
    medium: Medium,
    body: Body,
    alpha,
    alphadot,
    xi,
    *,
    loads: str = "exact",
    regularisation: float = 1e-6,
    effects: Sequence[Effect] = (),
) -> Work:
    """Power and internal moments for body velocities xi (..., 3) that `body_velocity` gave for the same arguments."""
    alpha, alphadot = np.broadcast_arrays(np.asarray(alpha, float), np.asarray(alphadot, float))
    batch, inner = alpha.shape[:-1], body
    load = element_load(medium, loads)
    for effect in effects:
        load, body = effect.load(load, medium), effect.body(body)
    alpha, alphadot = (x.reshape(-1, body.joints).T for x in (alpha, alphadot))
    xi = np.asarray(xi, float).reshape(-1, 3).T / np.array([[body.length], [body.length], [1.0]])
    motion = body.motion(alpha, alphadot)
    speed = np.sqrt((alphadot**2).sum(0))
    v = motion.v + motion.carried(xi)
    f = load(*v, regularisation * np.where(speed > 0, speed, 1.0))[:, 0] * motion.weight
    power = (f * v).sum((0, 1)) * body.length
    n = inner.motion(alpha, alphadot).half.shape[0]
    slip = np.average(np.arctan2(np.abs(v[1, :n]), np.abs(v[0, :n])), 0, motion.half[:n, 0])
    return Work(power.reshape(batch), _moments(motion, f, n).reshape(*batch, -1), slip.reshape(batch))


def _moments(motion, f, n: int) -> np.ndarray:
    """(B, n - 1): the moment of the medium's force on the tail's side about each point between two elements, which the
    head's side must hold against. The medium pushes with -f; so the moment exerted is that of +f."""
    c, s, half = motion.c, motion.s, motion.half
    place = (motion.r_t + 1j * motion.r_n) * (c + 1j * s) / 1j  # lever = i place conj(along)
    force = (f[0] + 1j * f[1]) * (c + 1j * s)
    spin = half * f[2]
    if len(c) > n:  # end caps: the tail's counts with the first element, the head's with the last
        order = [n, *range(n), n + 1]
        place, force, spin = place[order], force[order], np.concatenate([0 * spin[:1], spin[:n], 0 * spin[:1]])
        first = 1
    else:
        first = 0
    joints = place[first : first + n - 1] + half[: n - 1] * (c + 1j * s)[: n - 1]
    torque = (place.conj() * force).imag + spin
    until = slice(first, first + n - 1)
    total_force, total_torque = np.cumsum(force, 0)[until], np.cumsum(torque, 0)[until]
    return (total_torque - (joints.conj() * total_force).imag).T
