"""Momentum of a body of uniform mass along its length: over the ground, d(momentum)/dt = force, and so for each
element.

Time derivatives are backward differences of order 2 (order 1 after the first step). Earlier momenta are seen from where
the frame is foreseen to be, so that an equation is linear in the body velocity but for drag; without drag momentum
stays what it was to the last digit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.balance.newton import Inertia, carried, to_frame
from rft.bodies.base import Elements
from rft.se2 import rotated


class Momenta(NamedTuple):
    """Rate of change of momentum at one step, rate (1/rad) x momenta - (gone_x, gone_y, gone_t), times strength.

    rate: (1, 1). gone_x, gone_y, gone_t: (n, B), what earlier steps contribute, by element, seen from the frame.
    strength: (1, 1) or (1, B), mass x length x (2 pi frequency)^2 in the law's unit of force."""

    rate: np.ndarray
    gone_x: np.ndarray
    gone_y: np.ndarray
    gone_t: np.ndarray
    strength: np.ndarray


def momenta(e: Elements, v) -> np.ndarray:
    """Return momentum and its moment on the frame, (3, n, B), of elements with velocities (v_t, v_n, v_w) that count as
    their lengths."""
    return np.stack([2 * e.half * x for x in to_frame(e, v[0], v[1], v[2] / 3)])


def inertia(e: Elements, m: Momenta) -> Inertia:
    """Return the rate of change of momentum on the frame as strength (M xi + held)."""
    zero, one = np.zeros_like(e.c), np.ones_like(e.c)
    units = (one, zero, zero), (zero, one, zero), (zero, zero, one)
    M = m.rate * np.stack([momenta(e, carried(e, *unit)).sum(1) for unit in units], 1)
    gone = np.stack([m.gone_x.sum(0), m.gone_y.sum(0), m.gone_t.sum(0)])
    held = m.rate * momenta(e, (e.v_t, e.v_n, e.v_w)).sum(1) - gone
    return Inertia(*M.reshape(9, 1, -1), *held[:, None], m.strength)


def on_elements(e: Elements, m: Momenta, v) -> np.ndarray:
    """Return the rate of change of momentum of each element at velocities (v_t, v_n, v_w), (3, n, B)."""
    return m.strength * (m.rate * momenta(e, v) - np.stack([m.gone_x, m.gone_y, m.gone_t]))


def over_ground(pose: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return momenta over the ground, about its origin, from momenta p (3, ..., B) in a frame at a pose (3, B), about
    its origin."""
    x, y, theta = pose
    p_x, p_y = rotated(theta, p[0], p[1])
    return np.stack([p_x, p_y, p[2] + x * p_y - y * p_x])


def from_frame(pose: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return momenta in a frame at a pose from momenta over the ground, (3, ..., B); the inverse of `over_ground`."""
    x, y, theta = pose
    return np.stack([*rotated(-theta, p[0], p[1]), p[2] - x * p[1] + y * p[0]])
