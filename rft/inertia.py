"""Mass of a body that marches through a gait: its momentum, and how that enters the balance of forces.

In the body frame the momentum p of a body that keeps it over the ground changes by -ad*_xi p; the medium changes it too:
dp/dt + ad*_xi p = force. Time derivatives are backward differences of order 2 (order 1 at the first step).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.bodies.base import Motion

UNIT_MASS = np.array([1.0, 1.0, 1 / 3])[:, None, None]  # <a>, <u> and <s u> of an element from its (a, m, w)


class Inertia(NamedTuple):
    """What mass adds to a balance of forces, in its units: weight (rate (M xi + shape) - past) + turning ad*_xi, B samples.

    M: (3, 3, B) and shape: (3, B), momentum of the body per unit mass, from its velocity and from its change of shape, all
    over the scale. rate: 1/rad, of the time step. past: (3, B), what earlier momenta contribute. weight: (B,), inertia
    over the balance's unit. turning: (B,), that times the scale, for the frame's own motion.
    """

    M: np.ndarray
    shape: np.ndarray
    rate: float
    past: np.ndarray
    weight: np.ndarray
    turning: np.ndarray

    def __call__(self, xi: np.ndarray, index) -> np.ndarray:
        """(3, 4, B): the term and its derivatives with respect to xi (3, B), for the samples ``index``."""
        M, shape, past, weight, turning = (x[..., index] for x in (self.M, self.shape, *self[3:]))
        momentum = np.concatenate([(np.einsum("ijb,jb->ib", M, xi) + shape)[:, None], M], 1)
        out = weight * self.rate * momentum + turning * _coadjoint(xi[:, None], momentum)
        out[:, 0] -= weight * past
        for k, unit in enumerate(np.eye(3)[:, :, None]):
            out[:, k + 1] += turning * _coadjoint(unit, momentum[:, 0])
        return out


def _coadjoint(xi, p):
    """Rate at which momentum p (3, ...) seems to change in a frame that moves with xi, for a body that keeps it."""
    x, y, turn = xi
    return np.stack([-turn * p[1], turn * p[0], x * p[1] - y * p[0]])


class Mass:
    """A uniform body's mass through a march, step by step. inertia: (B,) or a number, mass x length x (rad/s)^2 over its
    axial drag. dt: rad."""

    def __init__(self, inertia, dt: float):
        self.inertia, self.dt = inertia, dt
        self.momenta: list[np.ndarray] = []
        self.flows: list[np.ndarray] = []
        self.shapes: list[tuple] = []  # motion and heading at the same steps, for a kick

    def term(self, motion: Motion, scale: np.ndarray, unit: float, linear: bool) -> Inertia:
        """For the balance of this step, whose loads are over ``unit`` and, in a linear medium, over the scale."""
        rate, past = _difference(self.momenta, self.dt)
        weight = self.inertia * unit * (np.ones_like(scale) if linear else scale)
        return Inertia(*_momentum(motion), rate, past / scale, weight, weight * scale)

    def moved(self, motion: Motion, xi: np.ndarray, scale: np.ndarray, heading: np.ndarray):
        """Note a step that ended with velocity scale x xi, the frame heading so. Returns what moved each element of the
        mass, as `rft.work` takes it: (force (n, B), complex in the body frame; moment about its centre (n, B))."""
        n = np.count_nonzero(motion.half)
        M, shape = _momentum(motion)
        turn = np.exp(1j * heading)
        flow = _over_ground(motion, (motion.v + motion.carried(xi)) * scale, turn)
        change = np.zeros_like(flow)
        if self.flows:
            rate, past = _difference(self.flows, self.dt)
            change = rate * flow - past
        self.momenta = [*self.momenta[-1:], scale * (np.einsum("ijb,jb->ib", M, xi) + shape)]
        self.flows = [*self.flows[-1:], flow]
        self.shapes = [*self.shapes[-1:], (motion, turn)]
        self.M, self.xi = M, scale * xi
        mass = self.inertia * 2 * motion.half[:n]
        return mass * change[0] * turn.conj(), mass * motion.half[:n] / 3 * change[1].real

    def kick(self, change: np.ndarray) -> None:
        """Let the body have been faster by so much, (3, B), in the body frame, at the last step, and have coasted there."""
        more = np.einsum("ijb,jb->ib", self.M, change)
        before = more + self.dt * (_coadjoint(self.xi, more) + _coadjoint(change, self.momenta[-1] + more))
        self.momenta = [p + kick for p, kick in zip(self.momenta, (before, more))]
        self.flows = [f + _over_ground(s[0], s[0].carried(change), s[1]) for f, s in zip(self.flows, self.shapes)]


def _over_ground(motion: Motion, v: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """(2, n, B), complex: velocities of the centres on the ground and turning of the elements, from (a, m, w) as (3, n, B)."""
    n = np.count_nonzero(motion.half)
    return np.stack([((v[0] + 1j * v[1]) * (motion.c + 1j * motion.s))[:n] * turn, v[2, :n] + 0j])


def _difference(before: list, dt: float):
    """(rate, past): the derivative at a step is rate x the value there - past, from the values at one or two before."""
    if len(before) < 2:
        return 1 / dt, before[-1] / dt
    return 1.5 / dt, (2 * before[-1] - 0.5 * before[-2]) / dt


def _momentum(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """(3, 3, B) and (3, B): momentum of a uniform body of unit mass from its velocity, and from its change of shape."""
    mass = motion._replace(weight=2 * motion.half)
    units = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, motion.c.shape[1]))
    M = np.stack([mass.total(UNIT_MASS * motion.carried(unit)) for unit in units], 1)
    return M, mass.total(UNIT_MASS * motion.v)
