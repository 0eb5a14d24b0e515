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
    moment: (..., n - 1), internal moment at the points between the n elements that holds against the medium, in axial
    drag x length: positive where the body works to bend to the left (counter-clockwise, tail to head), as muscles on its
    left side do; moment . d(bend)/dt sums to the power. slip: (...), mean over the body of the angle between an element's
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
    # At velocities over |alphadot|, as the balance is solved; a viscous law is proportional to them, a dry one does not know.
    scale = np.where(speed > 0, speed, 1.0)
    f = load(*(v / scale), np.full_like(scale, regularisation), scale)[:, 0] * motion.weight
    if medium.dry == ():
        f = f * scale
    power = (f * v).sum((0, 1)) * body.length
    n = inner.motion(alpha, alphadot).half.shape[0]
    slip = np.average(np.arctan2(np.abs(v[1, :n]), np.abs(v[0, :n])), 0, motion.half[:n, 0])
    return Work(power.reshape(batch), _moments(motion, f, n).reshape(*batch, -1), slip.reshape(batch))


def _moments(motion, f, n: int) -> np.ndarray:
    """(B, n - 1) from drags f (3, n or n + 2, B) that oppose the motion, the two end caps' last if there are any.

    The medium pushes with -f. At a point between two elements the body must hold the tail's side, and pushes the head's
    side with the opposite: with the moment of -f on the tail's side about that point.
    """
    along, half = motion.c + 1j * motion.s, motion.half
    place = (motion.r_t + 1j * motion.r_n) * along / 1j  # the lever is i place conj(along)
    force = (f[0] + 1j * f[1]) * along
    torque = (place.conj() * force).imag + half * f[2]
    if len(along) > n:  # the tail's cap belongs to the first element's side of every point, the head's to none
        force[0] += force[n]
        torque[0] += torque[n]
    points = place[: n - 1] + half[: n - 1] * along[: n - 1]
    tail_force, tail_torque = np.cumsum(force[: n - 1], 0), np.cumsum(torque[: n - 1], 0)
    return ((points.conj() * tail_force).imag - tail_torque).T
