"""What the medium does to a moving body, element by element: forces, power, internal moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.balance import checked_input
from rft.bodies.base import Body, Motion, halves
from rft.bodies.pieces import PIECES
from rft.effects.base import Effect, pieced
from rft.loads import Known
from rft.media.base import Medium, real_array, require
from rft.newton import Balance


class Work(NamedTuple):
    """power: (...), rate of work against the medium, >= 0, in units of (the whole body's axial drag) x (length / time).
    moment: (..., n - 1), internal moment at the points between the n elements that holds against the medium, and moves
    the mass where the body has any, in axial drag x body length: positive where the body works to bend to the left
    (counter-clockwise, tail to head), as muscles on its left side do; moment . d(bend)/dt x length sums to the power, with
    mass in the mean over a cycle that repeats. slip: (...), mean over the body of the angle between an element's
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
    pieces: int = PIECES,
) -> Work:
    """Power and internal moments for body velocities xi (..., 3) that `body_velocity` gave for the same arguments."""
    alpha, alphadot = checked_input(body, alpha, alphadot, regularisation, 1.0)
    batch, xi = alpha.shape[:-1], real_array("xi", xi)
    require(xi.shape == (*batch, 3), f"xi must have shape {(*batch, 3)} for these alpha and alphadot, got {xi.shape}")
    balance = Balance(medium, pieced(body, effects, pieces), loads, regularisation, 1.0, effects)
    alpha, alphadot = (x.reshape(-1, body.joints).T for x in (alpha, alphadot))
    xi = xi.reshape(-1, 3).T / np.array([[body.length], [body.length], [1.0]])
    speed = np.sqrt((alphadot**2).sum(0))
    scale = np.where(speed > 0, speed, 1.0)
    motion = balance.body.motion(alpha, alphadot / scale)
    done = done_by(balance, body, motion, xi / scale, scale)
    return Work(done.power.reshape(batch) * body.length, *(x.reshape((*batch, *x.shape[1:])) for x in done[1:]))


def done_by(balance: Balance, body: Body, motion: Motion, xi, scale, mass=None) -> Work:
    """`Work` of B samples from body velocities xi (3, B), in body lengths; they and the motion are over scale (B,), as the
    balance was solved: a linear law is proportional to it, a dry one does not know. Moments are those between the
    elements of ``body``, of which the balance's may be pieces. mass: (force, moment), (n, B) each, that moves every element:
    a complex force in the body frame and a moment about the element's centre, over the axial drag."""
    v = motion.v + motion.carried(xi)
    f = balance.load(*v, np.full_like(scale, balance.regularisation), Known(scale))[:, 0] * motion.weight
    if balance.linear:
        f = f * scale
    n = np.count_nonzero(motion.half)
    slip = np.average(np.arctan2(np.abs(v[1, :n]), np.abs(v[0, :n])), 0, motion.half[:n, 0])
    ends, wanted = (np.cumsum(2 * h) for h in (motion.half[:n, 0], halves(body)))
    points = np.searchsorted(ends, wanted[:-1] - 1e-9 * wanted[0])
    return Work(scale * (f * v).sum((0, 1)), _moments(motion, f, n, mass, balance.unit)[:, points], slip)


def _moments(motion, f, n: int, mass=None, unit: float = 1.0) -> np.ndarray:
    """(B, n - 1) from drags f (3, n or n + 2, B) that oppose the motion, the two end caps' last if there are any.

    The medium pushes with -f. At a point between two elements the body must hold the tail's side, and pushes the head's
    side with the opposite: with the moment of -f on the tail's side about that point.
    """
    along, half = motion.c + 1j * motion.s, motion.half
    place = motion.place
    force = (f[0] + 1j * f[1]) * along
    torque = half * f[2]
    if mass is not None:
        force[:n] += unit * mass[0]
        torque[:n] += unit * mass[1]
    torque = torque + (place.conj() * force).imag
    if len(along) > n:  # the tail's cap belongs to the first element's side of every point, the head's to none
        force[0] += force[n]
        torque[0] += torque[n]
    points = place[: n - 1] + half[: n - 1] * along[: n - 1]
    tail_force, tail_torque = np.cumsum(force[: n - 1], 0), np.cumsum(torque[: n - 1], 0)
    return ((points.conj() * tail_force).imag - tail_torque).T
