"""Systems whose last shape variables have periods, with displacements known in closed
form or by integrals of one variable."""

from dataclasses import dataclass

import numpy as np

from geomech.mathematics.geometry.traits import Traits

TURN = 2 * np.pi


@dataclass(frozen=True)
class Slider:
    """x' = (1 + k alpha^2) tau' + cos(tau) alpha', without a turn.

    For alpha = a sin t and tau = t, x = 2 pi + pi k a^2 + pi a."""

    k: float = 0.5
    rolling: float = 1.0
    joints = 2
    length = 1.0
    kind = "slider"
    traits = Traits(linear=True, periods=(None, TURN))

    def velocity(self, alpha, alphadot):
        q, tau = np.moveaxis(alpha, -1, 0)
        dq, dtau = np.moveaxis(alphadot, -1, 0)
        x = self.rolling * (1 + self.k * q**2) * dtau + np.cos(tau) * dq
        return np.stack([x, 0 * x, 0 * x], -1)

    def distance(self, a):
        return self.rolling * (TURN + np.pi * self.k * a**2) + np.pi * a


@dataclass(frozen=True)
class Unicycle:
    """A wheel that rolls by tau and is turned by alpha: x' = tau', theta' = (1 + k
    alpha) alpha'.

    Along any gait theta = alpha + k alpha^2 / 2 from its start, and x and y are
    integrals of cos(theta) tau' and sin(theta) tau'."""

    k: float = 0.6
    joints = 2
    length = 1.0
    kind = "unicycle"
    traits = Traits(linear=True, periods=(None, TURN))

    def velocity(self, alpha, alphadot):
        q = alpha[..., 0]
        dq, dtau = np.moveaxis(alphadot, -1, 0)
        return np.stack([dtau, 0 * dtau, (1 + self.k * q) * dq], -1)

    def pose(self, gait, amplitudes, phases=4096):
        """Net poses (B, 3), by the trapezoidal rule, which is exact to roundoff for
        such periodic integrands."""
        alpha, alphadot = gait.cycle(phases, amplitudes)
        q = alpha[..., 0]
        theta = q + self.k * q**2 / 2
        theta = theta - theta[..., :1]
        step = alphadot[..., 1]
        x = TURN * (np.cos(theta) * step).mean(-1)
        y = TURN * (np.sin(theta) * step).mean(-1)
        return np.stack([x, y, 0 * x], -1)


@dataclass(frozen=True)
class Lifted:
    """A body whose contact follows the last variable: A_tau = 0, the rest generic.

    drift: of the loop at rest, A_tau = drift times a function of all variables."""

    drift: float = 0.0
    links: int = 1
    length = 1.0
    kind = "lifted"

    @property
    def joints(self):
        return self.links + 1

    @property
    def traits(self):
        return Traits(linear=True, periods=(*(None,) * self.links, TURN))

    def velocity(self, alpha, alphadot):
        q, tau = alpha[..., :-1], alpha[..., -1]
        dq, dtau = alphadot[..., :-1], self.drift * alphadot[..., -1]
        k = np.arange(self.links)
        phase = tau[..., None] + k
        bend = q.sum(-1)
        x = ((np.sin(phase) + 0.3) * dq).sum(-1)
        y = (np.cos(phase + q) * dq).sum(-1)
        theta = ((0.3 + 0.8 * np.cos(phase) * np.cos(q)) * dq).sum(-1)
        x = x + np.cos(bend) * (1 + 0.3 * np.cos(tau)) * dtau
        y = y + 0.2 * np.sin(tau + bend) * dtau
        theta = theta + (0.1 + np.sin(2 * tau) * bend) * dtau
        return np.stack([x, y, theta], -1)


class Mirrored:
    """Left and right are alike: xi(-alpha, -alphadot) = (xi_x, -xi_y, -xi_theta)."""

    joints = 2
    length = 1.0
    kind = "mirrored"

    def __init__(self, claims=True):
        self.traits = Traits(linear=True, mirror=claims, periods=(None, TURN))
        self.solved = 0

    def velocity(self, alpha, alphadot):
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        self.solved += alpha[..., 0].size
        q, tau = np.moveaxis(alpha, -1, 0)
        dq, dtau = np.moveaxis(alphadot, -1, 0)
        x = np.sin(q + tau) * dq + np.sin(tau) * np.cos(q) * dtau
        y = np.cos(tau) * dq + np.cos(q - tau) * dtau
        theta = (1 + np.sin(q) * np.sin(tau)) * dtau + np.cos(2 * tau) * dq
        return np.stack([x, y, theta], -1)
