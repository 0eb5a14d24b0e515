"""Velocities and connections in another frame on the body.

A second frame sits at h(alpha) in the first: g_2 = g_1 h. Then xi_2 = Ad_h^-1 xi_1 +
h^-1 dh/dt."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.mathematics.geometry.connection import Velocity
from rft.core.checks import unmasked
from rft.formulas import se2


def frame_velocity(h, hdot) -> np.ndarray:
    """Return h^-1 dh/dt (..., 3): the second frame's velocity relative to the first, in
    the second. h, hdot: (..., 3)."""
    h = unmasked("h", h)
    hdot = unmasked("hdot", hdot)
    x, y = se2.rotated(-h[..., 2], hdot[..., 0], hdot[..., 1])
    return np.stack([x, y, hdot[..., 2]], -1)


def change_velocity(xi, h, hdot) -> np.ndarray:
    """Return the body velocity (..., 3) of the frame g h from that of the frame g."""
    adjoint = se2.adjoint(se2.inverse(h))
    transported = np.einsum("...ij,...j->...i", adjoint, unmasked("xi", xi))
    return transported + frame_velocity(h, hdot)


def change_connection(A, h, dh) -> np.ndarray:
    """Return the connection (..., 3, d) of the frame g h.

    A: (..., 3, d). h: (..., 3). dh: d h / d alpha (..., 3, d)."""
    joints = range(np.shape(A)[-1])
    columns = [change_velocity(A[..., k], h, dh[..., k]) for k in joints]
    return np.stack(columns, -1)


def in_frame(velocity: Velocity, frame: Callable) -> Velocity:
    """Return the velocity of another frame.

    frame(alpha, alphadot) -> (h, hdot): the frame's pose in the first, and its rate."""

    def velocity_there(alpha, alphadot):
        h, hdot = frame(alpha, alphadot)
        return change_velocity(velocity(alpha, alphadot), h, hdot)

    return velocity_there
