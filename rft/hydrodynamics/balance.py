"""Resistance of a body in a model of the fluid, and the velocity at which no force acts
on it.

With velocities of the sites v = J xi + B alphadot and forces f = M^-1 v on the fluid,
the resistance to (xi, alphadot) is [J B]^T M^-1 [J B], symmetric and positive. No net
force and torque act if

    xi = A alphadot,    A = -(J^T M^-1 J)^-1 J^T M^-1 B."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import Body
from rft.core.checks import unmasked
from rft.hydrodynamics.base import FluidModel, Sites

# Numbers in a batch of mobility matrices, which are computed from some ten arrays of
# this size, 8 MB each: fewer take longer where links are many, and more are no faster.
TOGETHER = 1 << 20


class Resistance(NamedTuple):
    """Resistance of a body at shapes (B, d), in units of 8 pi mu and body lengths.

    rigid: (B, 3, 3), force and torque from xi. coupling: (B, 3, d), force and torque
    from alphadot. shape: (B, d, d), torques of the joints from alphadot."""

    rigid: np.ndarray
    coupling: np.ndarray
    shape: np.ndarray

    @property
    def connection(self) -> np.ndarray:
        """A (B, 3, d): xi = A alphadot of the free body."""
        return -np.linalg.solve(self.rigid, self.coupling)

    @property
    def dissipation(self) -> np.ndarray:
        """M (B, d, d): power of the free body is alphadot^T M alphadot."""
        across = np.swapaxes(self.coupling, -1, -2)
        return self.shape + across @ self.connection


def resistance(model: FluidModel, body: Body, alpha: ArrayLike) -> Resistance:
    """Return the resistance of a chain of links at shapes (B, d).

    body: with ``fractions``, such as `rft.Chain`; its frame is that of xi."""
    alpha = unmasked("alpha", alpha)
    sites = model.sites(body.fractions)
    step = max(1, TOGETHER // (2 * len(sites.link)) ** 2)
    parts = []
    for k in range(0, len(alpha), step):
        parts.append(_batch(model, sites, body, alpha[k : k + step]))
    d = body.joints
    if not parts:
        parts.append(np.zeros((0, 3 + d, 3 + d)))
    R = np.concatenate(parts)
    return Resistance(R[:, :3, :3], R[:, :3, 3:], R[:, 3:, 3:])


def _batch(model: FluidModel, sites: Sites, body: Body, alpha) -> np.ndarray:
    """Return resistance matrices (B, 3 + d, 3 + d)."""
    n, d = alpha.shape
    # One batch for a unit rate of each joint in turn.
    rate = np.repeat(np.eye(d), n, 0)
    all_motion = _kinematics(body, sites, np.tile(alpha, (d, 1)), rate)
    centre, heading, velocity = (x.reshape(d, n, -1) for x in all_motion)
    columns = list(velocity)
    centre = centre[0]
    heading = heading[0]
    one = np.ones_like(centre)
    J = [one, 1j * one, 1j * centre]
    complex_rates = np.stack(J + columns, -1)  # (B, n, 3 + d)
    rates = np.concatenate([complex_rates.real, complex_rates.imag], 1)
    forces = np.linalg.solve(model.mobility(sites, centre, heading), rates)
    R = rates.swapaxes(1, 2) @ forces
    return (R + R.swapaxes(1, 2)) / 2


def _kinematics(body: Body, sites: Sites, alpha, rate) -> tuple:
    """Return centres, headings of the links, and velocities of the sites with the frame
    held, complex (B, n)."""
    links = body.motion(alpha.T, rate.T)
    ones = np.ones_like(sites.ahead[:, None])
    points = links.attached_points(sites.link, sites.ahead[:, None], ones)
    heading = points.c + 1j * points.s
    velocity = (points.v_t + 1j * points.v_n) * heading
    return points.centres.T, heading.T, velocity.T


def axial_drag(model: FluidModel, body: Body) -> float:
    """Return the drag on the whole straight body at unit velocity along itself, in
    units of 8 pi mu and body lengths."""
    straight = resistance(model, body, np.zeros((1, body.joints)))
    # The frame's x axis points along the straight body.
    return float(straight.rigid[0, 0, 0])
