"""Mass of the body: the balance of forces becomes an equation of motion.

In the body frame the momentum p of a body that keeps it over the ground changes by -ad*_xi p; the medium changes it too:
dp/dt + ad*_xi p = force. So does that of each element. Time derivatives are backward differences of order 2 (order 1
after the first step).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rft.bodies.base import Kinematics
from rft.contact import SIDE, Model, PerSample
from rft.effects.base import Process, Site
from rft.media.base import check_ranges, require
from rft.premise import Premise

UNIT_MASS = np.array([1.0, 1.0, 1 / 3])[:, None, None]  # <v_t>, <v_n> and <s v_n> of an element from v_t, v_n, spin


@dataclass(frozen=True)
class BodyInertia(Process):
    """A body of uniform mass along its length: d(momentum)/dt = force of the medium, and likewise for the moment.

    mass (kg): of the body. frequency (1/s): cycles per second, alphadot being per radian of phase. length (m): of the body.
    drag (N): of the medium on the whole straight body along itself, 2 k rho g r |z| L by Eq. 2; in a viscous medium at one
    body length per radian of phase.

    Only mass x length x (2 pi frequency)^2 / drag matters.
    """

    mass: float
    frequency: float
    length: float
    drag: float

    kind = "body-inertia"
    breaks = Premise.QUASI_STATIC | Premise.RATE_INDEPENDENT
    limit = "mass = 0"
    cost = "a step at a time in place of all phases at once; a dozen operations a sample"
    batched = ("mass", "frequency", "length", "drag")

    def __post_init__(self):
        check_ranges(self, mass=(0, 1e9), frequency=(0, 1e4), length=(1e-9, 1e6), drag=(1e-12, 1e12))
        require(self.inertia <= 1e6, f"inertia is {self.inertia:.3g} times the axial drag: beyond 1e6 no gait settles")

    @property
    def inertia(self) -> Any:
        """mass x length x (2 pi frequency)^2 / drag, no unit."""
        return self.mass * self.length * (2 * np.pi * self.frequency) ** 2 / self.drag

    def begin(self, site: Site) -> tuple:
        """Momenta (3, n, B) of the elements, per unit mass, in the body frame, after the last two steps; none so far."""
        return ()

    def at(self, state: tuple, site: Site) -> Momentum:
        motion = site.motions[SIDE]
        mass = _uniform(motion)
        units = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, motion.c.shape[1]))
        M = np.stack([mass.wrench(UNIT_MASS * motion.carried(unit)) for unit in units], 1)
        rate, past = _difference(state, site.dt)
        return Momentum(self.inertia, M, mass.wrench(UNIT_MASS * motion.v), rate, past, past.sum(1))

    def after(self, state: tuple, site: Site, v) -> tuple:
        return *state[-1:], _uniform(site.motions[SIDE]).wrenches(UNIT_MASS * v[SIDE])

    def kicked(self, state: tuple, site: Site, xi, change) -> tuple:
        """It has coasted with this change of velocity."""
        motion, dt = site.motions[SIDE], site.dt
        more = _uniform(motion).wrenches(UNIT_MASS * motion.carried(change))
        xi, change = xi[:, None], change[:, None]
        before = more + dt * (_coadjoint(xi, more) + _coadjoint(change, state[-1] + more))
        return tuple(p + kick for p, kick in zip(state, (before, more)))


@dataclass(frozen=True)
class Momentum(PerSample):
    """The term inertia x unit x (rate p - past + ad*_xi p), p = M xi + shape, at one step.

    M: (3, 3, B) and shape: (3, B), momentum of the body per unit mass from its velocity and from its change of shape. rate:
    1/rad, of the time step. pasts: (3, n, B), what earlier momenta of the elements contribute, past (3, B) their sum.
    """

    inertia: np.ndarray | float
    M: np.ndarray
    shape: np.ndarray
    rate: float
    pasts: np.ndarray
    past: np.ndarray
    unit: float = 1.0

    def apply(self, model: Model) -> Model:
        return model.pulled(self.having(unit=model.unit))

    @property
    def size(self) -> Any:
        return self.rate * self.inertia * self.unit

    @property
    def numbers(self) -> list:
        """For compiled code (`rft.backend`): M, shape, past, rate and strength, each a number or (B,)."""
        return [*self.M.reshape(9, -1), *self.shape, *self.past, self.rate, self.inertia * self.unit]

    def __call__(self, xi: np.ndarray) -> np.ndarray:
        momentum = np.concatenate([(np.einsum("ijb,jb->ib", self.M, xi) + self.shape)[:, None], self.M], 1)
        out = self.rate * momentum + _coadjoint(xi[:, None], momentum)
        out[:, 0] -= self.past
        for k, unit in enumerate(np.eye(3)[:, :, None]):
            out[:, k + 1] += _coadjoint(unit, momentum[:, 0])
        return self.inertia * self.unit * out

    def on_elements(self, xi: np.ndarray, motion: Kinematics, v: np.ndarray) -> np.ndarray:
        momenta = _uniform(motion).wrenches(UNIT_MASS * v)
        change = self.rate * momenta - self.pasts + _coadjoint(xi[:, None], momenta)
        return self.inertia * self.unit * change


def _uniform(motion: Kinematics) -> Kinematics:
    """The elements, each counting as its length."""
    return motion._replace(weight=2 * motion.half)


def _coadjoint(xi, p):
    """Rate at which momentum p (3, ...) seems to change in a frame that moves with xi, for a body that keeps it."""
    x, y, turn = xi
    return np.stack([-turn * p[1], turn * p[0], x * p[1] - y * p[0]])


def _difference(before: tuple, dt: float):
    """(rate, past): the derivative at a step is rate x the value there - past, from the values at one or two before."""
    if len(before) < 2:
        return 1 / dt, before[-1] / dt
    return 1.5 / dt, (2 * before[-1] - 0.5 * before[-2]) / dt
