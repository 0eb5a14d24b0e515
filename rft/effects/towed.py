"""A sled towed by the tail: friction of its own, on a point behind the last link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.bodies.base import Kinematics
from rft.contact import Averages, Contact, Model
from rft.effects.base import Effect
from rft.media.base import check_ranges, power_of, require
from rft.media.coulomb import Coulomb


@dataclass(frozen=True)
class TowedSled(Effect):
    """Coulomb friction, alike in all directions, at the end of a stiff bar that goes on from the tail in its direction.

    pull (-): the sled's friction over the medium's drag on the whole straight body along itself. distance (body lengths): of
    the sled behind the tail.

    It lies on the surface, so that the body's depth does not matter to it. Dry media only,
    for beside drag that grows with speed friction would depend on the unit of time.
    """

    pull: float
    distance: float = 0.0

    kind = "towed-sled"
    odd = True
    limit = "pull = 0"
    cost = "one point load"
    batched = ("pull",)

    def __post_init__(self):
        check_ranges(self, pull=(0, 1000), distance=(0, 10))

    def apply(self, model: Model) -> Model:
        medium = model.medium
        name = type(medium).__name__
        require(power_of(medium) == 0, f"a towed sled takes a medium without viscous drag, dry as itself, got {name}")
        sled = Contact(Averages(Coulomb()), self.behind, stations=(0.0,), buried=False, factors=(self,))
        return model.touching("sled", sled)

    def behind(self, motion: Kinematics) -> Kinematics:
        """The sled's point, of a body whose `Kinematics` is given."""
        return motion.points([0], -(motion.half[:1] + self.distance), np.ones((1, 1)))

    @property
    def numbers(self) -> tuple:
        """For compiled code (`rft.backend`)."""
        return self.pull, self.pull, self.pull

    def __call__(self, v_t, v_n, spin) -> tuple[float, float]:
        return self.pull, self.pull
