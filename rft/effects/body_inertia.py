"""Mass of the body: the balance of forces becomes an equation of motion.

Over the ground, about a point of it, d(momentum)/dt = force; so for each element. Time derivatives are backward
differences of order 2 (order 1 after the first step). What was is seen from where the frame is foreseen to be, so that an
equation is linear in the body velocity but for drag, and where drag is monotone has one solution whatever the mass, spin and
step; without drag momentum stays what it was to the last digit.
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
from rft.se2 import rotated

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
        """Momenta (3, n, B) of the elements, per unit mass, over the ground, at the last two steps; none so far."""
        return ()

    def at(self, state: tuple, site: Site) -> Momentum:
        motion = site.motions[SIDE]
        mass = _uniform(motion)
        units = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, motion.c.shape[1]))
        M = np.stack([mass.wrench(UNIT_MASS * motion.carried(unit)) for unit in units], 1)
        rate, pasts = _difference(state, site.dt)
        held = rate * mass.wrench(UNIT_MASS * motion.v) - _from_frame(site.pose, pasts.sum(1))
        return Momentum(self.inertia, rate * M, held, rate, pasts, site.pose)

    def after(self, state: tuple, site: Site, v) -> tuple:
        return *state[-1:], _over_ground(site.pose, _uniform(site.motions[SIDE]).wrenches(UNIT_MASS * v[SIDE]))

    def kicked(self, state: tuple, site: Site, change, drag) -> tuple:
        """It has coasted with this change of velocity, which the drag has lessened since the step before."""
        motion = site.motions[SIDE]
        now = _uniform(motion).wrenches(UNIT_MASS * motion.carried(change))
        lost = site.dt / (self.inertia + site.dt) * drag  # over inertia, where that is much
        before = now + motion.half / motion.half.sum(0) * lost[:, None]
        return tuple(p + _over_ground(site.pose, more) for p, more in zip(state, (before, now)))


@dataclass(frozen=True)
class Momentum(PerSample):
    """The term inertia x unit x (M xi + held) at one step.

    The backward difference is rate (1/rad) x momenta - pasts, (3, n, B), what earlier ones contribute, over the ground; pose:
    (3, B), from which they are seen. M: (3, 3, B), rate x the mass matrix, and held: (3, B), the difference with the frame
    held, both per unit mass.
    """

    inertia: np.ndarray | float
    M: np.ndarray
    held: np.ndarray
    rate: float
    pasts: np.ndarray
    pose: np.ndarray
    unit: float = 1.0

    def apply(self, model: Model) -> Model:
        return model.pulled(self.having(unit=model.unit))

    @property
    def size(self) -> Any:
        return self.rate * self.inertia * self.unit

    @property
    def numbers(self) -> list:
        """For compiled code (`rft.backend`): M, held and strength, each a number or (B,)."""
        return [*self.M.reshape(9, -1), *self.held, self.inertia * self.unit]

    def __call__(self, xi: np.ndarray) -> np.ndarray:
        force = np.einsum("ijb,jb->ib", self.M, xi) + self.held
        return self.inertia * self.unit * np.concatenate([force[:, None], self.M], 1)

    def on_elements(self, xi: np.ndarray, motion: Kinematics, v: np.ndarray) -> np.ndarray:
        change = self.rate * _uniform(motion).wrenches(UNIT_MASS * v) - _from_frame(self.pose, self.pasts)
        return self.inertia * self.unit * change


def _uniform(motion: Kinematics) -> Kinematics:
    """The elements, each counting as its length."""
    return motion._replace(weight=2 * motion.half)


def _over_ground(pose: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Momenta p (3, ..., B) in a frame at pose (3, B), about its origin, as those over the ground, about that of the ground."""
    x, y, heading = pose
    p_x, p_y = rotated(heading, p[0], p[1])
    return np.stack([p_x, p_y, p[2] + x * p_y - y * p_x])


def _from_frame(pose: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The other way."""
    x, y, heading = pose
    return np.stack([*rotated(-heading, p[0], p[1]), p[2] - x * p[1] + y * p[0]])


def _difference(before: tuple, dt: float):
    """(rate, past): the derivative at a step is rate x the value there - past, from the values at one or two before."""
    if len(before) < 2:
        return 1 / dt, before[-1] / dt
    return 1.5 / dt, (2 * before[-1] - 0.5 * before[-2]) / dt
