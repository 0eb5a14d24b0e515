"""Mass of the body: the balance of forces becomes an equation of motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.effects.base import Effect
from rft.media.base import check_ranges, require
from rft.premise import Premise


@dataclass(frozen=True)
class BodyInertia(Effect):
    """A body of uniform mass along its length: d(momentum)/dt = force of the medium, and likewise for the moment.

    mass: kg. frequency: cycles per second, alphadot being per radian of phase. length: of the body, m. drag: N, of the
    medium on the whole straight body along itself, 2 k rho g r |z| L by Eq. 2; in a viscous medium at one body length
    per radian of phase. Only mass x length x (2 pi frequency)^2 / drag matters.
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
    def inertia(self):
        """mass x length x (2 pi frequency)^2 / drag, no unit."""
        return self.mass * self.length * (2 * np.pi * self.frequency) ** 2 / self.drag
