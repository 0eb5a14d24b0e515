"""Displacement of a gait by three tiers, each nearer to the truth and dearer than the one before.

area    exp of the CCF's integral over the area enclosed; winding numbers count, so figure-eights cancel
path    the fitted connection integrated along the gait
direct  the velocity itself at every phase, integrated along the gait

All give the net pose (..., 3) over a cycle from phase t = 0, in the frame at the start.
"""

from __future__ import annotations

import numpy as np

from geomech import se2
from geomech.connection import SAMPLES_TOGETHER, Connection, Velocity, evaluate
from geomech.field import Field
from geomech.gaits.base import Gait, checked_gait
from geomech.problem import number, real_array
from geomech.simulate import displacement


def area(ccf: Field, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """exp of the CCF integral (joints 1 and 2), for amplitudes (..., ) or the gait's own. ValueError off the grid.

    By Green's theorem the integral is that of P d(alpha_2) along the gait, dP/d(alpha_1) = CCF. Order 3 in the gait's
    size in a generic frame, 4 where A vanishes at its centre.
    """
    checked_gait(gait)
    if ccf.joints != 2 or gait.joints != 2:
        raise ValueError(f"the area tier needs two joints, got a field of {ccf.joints} and a gait of {gait.joints}")
    alpha, alphadot = gait.cycle(phases, amplitudes)
    P = ccf.antiderivative(0)(ccf.inside(alpha))
    return se2.exp((P * alphadot[..., 1:]).mean(-2) * 2 * np.pi)


def path(connection: Connection | Velocity, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """The fitted connection integrated along the gait, for amplitudes (...,) or the gait's own."""
    velocity = connection.velocity if isinstance(connection, Connection) else connection
    return direct(velocity, gait, amplitudes, phases)


def direct(velocity: Velocity, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """The velocity integrated along the gait, for amplitudes (...,) or the gait's own, many phases in one batch."""
    checked_gait(gait)
    amplitudes = real_array("amplitudes", gait.amplitude if amplitudes is None else amplitudes)
    flat = amplitudes.reshape(-1)
    number("phases", phases, 1, 1e9, whole=True)
    step = max(1, SAMPLES_TOGETHER // int(phases))
    poses = [_cycle(velocity, gait, flat[k : k + step], phases) for k in range(0, flat.size, step)]
    return np.concatenate(poses).reshape(*amplitudes.shape, 3) if poses else np.zeros((*amplitudes.shape, 3))


def _cycle(velocity: Velocity, gait: Gait, amplitudes, phases: int) -> np.ndarray:
    return displacement(evaluate(velocity, *gait.cycle(phases, amplitudes)))
