"""Momentum of a body of uniform mass along its length: on the ground, d(momentum)/dt =
force, for each element.

Time derivatives are backward differences of order 2 (order 1 in the first step).
Earlier momenta are transformed to the predicted pose of the frame, so that the equation
is linear in the body velocity but for drag; without drag momentum is conserved to the
last digit."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rft.formulas.newton import Inertia, to_element, to_frame
from rft.formulas.se2 import rotated

if TYPE_CHECKING:
    from rft.bodies.base import Elements


class MomentumRate(NamedTuple):
    """Rate of change of momentum at one step: strength (rate x momentum - past),
    momentum linear in velocity.

    rate: (1, 1), 1/rad. past_x, past_y, past_t: (n, B), contributions of earlier steps
    by element, in the frame. strength: (1, 1) or (1, B), mass x length x (2 pi
    frequency)^2 in the law's unit of force."""

    rate: np.ndarray
    past_x: np.ndarray
    past_y: np.ndarray
    past_t: np.ndarray
    strength: np.ndarray


def element_momenta(e: Elements, v) -> np.ndarray:
    """Return momenta and their moments on the frame, (3, n, B), of elements with
    velocities (v_t, v_n, v_w) and with their lengths for masses."""
    return np.stack([2 * e.half * x for x in to_frame(e, v[0], v[1], v[2] / 3)])


def frame_inertia(e: Elements, m: MomentumRate) -> Inertia:
    """Return the rate of change of momentum of all elements on the frame, strength (M
    xi + offset)."""
    zero = np.zeros_like(e.c)
    one = np.ones_like(e.c)
    units = (one, zero, zero), (zero, one, zero), (zero, zero, one)
    M = m.rate * np.stack(
        [element_momenta(e, to_element(e, *unit)).sum(1) for unit in units], 1
    )
    past = np.stack([m.past_x.sum(0), m.past_y.sum(0), m.past_t.sum(0)])
    offset = m.rate * element_momenta(e, (e.v_t, e.v_n, e.v_w)).sum(1) - past
    return Inertia(*M.reshape(9, 1, -1), *offset[:, None], m.strength)


def element_momentum_rates(e: Elements, m: MomentumRate, v) -> np.ndarray:
    """Return the rate of change of momentum of each element on the frame, (3, n, B), at
    velocities (v_t, v_n, v_w)."""
    return m.strength * (
        m.rate * element_momenta(e, v) - np.stack([m.past_x, m.past_y, m.past_t])
    )


def frame_to_ground(pose: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return momenta on the ground, about its origin, from momenta p (3, ..., B) in a
    frame at a pose (3, B), about the frame's origin."""
    x, y, theta = pose
    p_x, p_y = rotated(theta, p[0], p[1])
    return np.stack([p_x, p_y, p[2] + x * p_y - y * p_x])


def ground_to_frame(pose: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return momenta in a frame at a pose from momenta on the ground, (3, ..., B); the
    inverse of `frame_to_ground`."""
    x, y, theta = pose
    return np.stack([*rotated(-theta, p[0], p[1]), p[2] - x * p[1] + y * p[0]])
