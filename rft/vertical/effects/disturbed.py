"""Ground that something went through before: weaker near there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.media.base import check_ranges, real_array, require, shown
from rft.premise import Premise
from rft.vertical.effects.base import GroundEffect

MOST_PLACES = 1000


@dataclass(frozen=True)
class DisturbedGround(GroundEffect):
    """Strength times 1 - weakening x disturbance, at all depths; disturbance is 1 up to half a ``radius`` along the
    ground from any of the ``places`` of earlier intrusions, and falls linearly to 0 at one and a half.

    places (m): x of earlier intrusions. radius (m): along the ground, how far they disturb it, about. weakening (-): 0 to 1,
    the share of strength lost in wholly disturbed ground.

    That grains bear less where something went
    before is by experiment (paper Sec. IV B); the form and every number are assumed, as is that disturbances do not add up
    or heal. The motion itself does not disturb: places are given.
    """

    places: tuple[float, ...]
    radius: float
    weakening: float

    kind = "disturbed-ground"
    breaks = Premise.SE2_SYMMETRIC
    limit = "weakening = 0"
    cost = "six operations an element and place"

    def __post_init__(self):
        places = real_array("places", self.places)
        good = places.ndim == 1 and 1 <= places.size <= MOST_PLACES and bool((np.abs(places) <= 1e3).all())
        require(good, f"places must be 1 to {MOST_PLACES} numbers in m, within 1000, got {shown(self.places)}")
        object.__setattr__(self, "places", tuple(places.tolist()))
        check_ranges(self, radius=(1e-6, 1e3), weakening=(0, 1))

    def share(self, x, ahead=0.0) -> np.ndarray:
        disturbance = np.zeros(np.shape(x))
        for place in self.places:
            disturbance = np.maximum(disturbance, np.clip(1.5 - np.abs(x - place) / self.radius, 0.0, 1.0))
        return 1.0 - self.weakening * disturbance

    @property
    def assumes(self) -> str:
        return "its form and numbers, and that the motion itself disturbs nothing"
