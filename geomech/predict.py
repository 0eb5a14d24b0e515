"""Displacement of a gait by three tiers, each nearer to the truth and dearer than the one before.

area    exp of the CCF's integral over the area enclosed; winding numbers count, so figure-eights cancel
path    the fitted connection integrated along the gait
direct  the velocity itself at every phase, integrated along the gait

All give the net pose (..., 3) over a cycle from phase t = 0, in the frame at the start.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.connection import SAMPLES_TOGETHER, Connection, Velocity, evaluate
from geomech.errors import number, real_array
from geomech.field import Field
from geomech.gaits.base import Gait, checked_gait
from geomech.reconstruct import displacement
from rft import se2


def area(ccf: Field, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """exp of the CCF integral (joints 1 and 2), for amplitudes (..., ) or the gait's own. ValueError off the grid.

    By Green's theorem the integral is that of P d(alpha_2) along the gait, dP/d(alpha_1) = CCF. Order 3 in the gait's
    size in a generic frame, 4 where A vanishes at its centre.
    """
    checked_gait(gait)
    if ccf.joints != 2 or gait.joints != 2:
        raise ValueError(f"the area tier needs two joints, got a field of {ccf.joints} and a gait of {gait.joints}")
    potential = ccf.antiderivative(0)

    def enclosed(some):
        alpha, alphadot = gait.cycle(phases, some)
        return se2.exp((potential(ccf.inside(alpha)) * alphadot[..., 1:]).mean(-2) * 2 * np.pi)

    return in_groups(enclosed, gait.amplitude if amplitudes is None else amplitudes, SAMPLES_TOGETHER // phases)


def path(connection: Connection | Velocity, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """The fitted connection integrated along the gait, for amplitudes (...,) or the gait's own."""
    velocity = connection.velocity if isinstance(connection, Connection) else connection
    return direct(velocity, gait, amplitudes, phases)


def direct(velocity: Velocity, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """The velocity integrated along the gait, for amplitudes (...,) or the gait's own, many phases in one batch."""
    checked_gait(gait)
    amplitudes = gait.amplitude if amplitudes is None else amplitudes
    number("phases", phases, 1, 1e9, whole=True)
    step = SAMPLES_TOGETHER // int(phases)
    return in_groups(lambda some: _cycle(velocity, gait, some, phases), amplitudes, step)


def _cycle(velocity: Velocity, gait: Gait, amplitudes, phases: int) -> np.ndarray:
    alpha, alphadot = gait.cycle(phases, amplitudes)
    parts = (slice(k, k + SAMPLES_TOGETHER) for k in range(0, phases, SAMPLES_TOGETHER))
    return displacement(np.concatenate([evaluate(velocity, alpha[:, p], alphadot[:, p]) for p in parts], -2))


def in_groups(f: Callable, amplitudes, size: int) -> np.ndarray:
    """f(some) (b, ...) for amplitudes (...,), at most ``size`` (or one) at a time, so that memory is bounded: (..., ...)."""
    amplitudes = real_array("amplitudes", amplitudes)
    flat, size = amplitudes.reshape(-1), max(1, size)
    found = [f(flat[k : k + size]) for k in range(0, flat.size, size)]
    return np.concatenate(found).reshape(*amplitudes.shape, -1) if found else np.zeros((*amplitudes.shape, 3))
