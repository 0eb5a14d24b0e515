"""Ground that earlier intrusions disturbed is weaker near their places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers, real_array
from rft.core.premise import Premise
from rft.core.refusal import require
from rft.terradynamics.ground.base import GROUND_EFFECTS, Ground, GroundEffect

MOST_PLACES = 1000


@GROUND_EFFECTS.register
@dataclass(frozen=True)
class DisturbedGround(GroundEffect):
    """Ground near earlier intrusions, whose strength at all depths is
    1 - weakening x disturbance times that of fresh ground.

    The disturbance is 1 up to half a ``radius`` along the ground from any of the
    ``places``, and falls linearly to 0 at one and a half.

    places (m): x of earlier intrusions.

    Experiments show that disturbed grains bear less (paper Sec. IV B). The form of the
    disturbance and its numbers are assumed, as is that disturbances neither add up nor
    heal. The motion itself disturbs nothing; only the given places count.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.ground import DisturbedGround, ground_of, strength_at
    >>> ground = ground_of([DisturbedGround(places=(0.0,), radius=0.02, weakening=0.4)])
    >>> strength_at(ground, np.array([0.0, 0.1]), np.array([1.0, 1.0]))
    array([0.6, 1. ])
    """

    places: tuple[float, ...]
    radius: Annotated[
        float,
        Number(
            1e-6,
            1e3,
            "m",
            "approximate distance along the ground to which intrusions disturb it",
        ),
    ]
    weakening: Annotated[
        float, Number(0, 1, "-", "share of the strength lost in fully disturbed ground")
    ]

    kind = "disturbed-ground"
    breaks = Premise.SE2_SYMMETRIC
    limit = "weakening = 0"
    cost = "six operations per element and place"

    def __post_init__(self):
        places = real_array("places", self.places)
        is_list = places.ndim == 1 and 1 <= places.size <= MOST_PLACES
        require(
            is_list and bool((np.abs(places) <= 1e3).all()),
            f"places must be 1 to {MOST_PLACES} numbers in m, each within 1000 m",
            value=self.places,
        )
        object.__setattr__(self, "places", tuple(places.tolist()))
        check_numbers(self)

    def apply(self, ground: Ground) -> Ground:
        row = np.array([self.radius, self.weakening, *self.places])
        rows = [*ground.disturbed, row]
        size = max(map(len, rows))
        # Places at infinity, which disturb nothing, fill up the shorter rows.
        padded = [np.append(row, np.full(size - len(row), np.inf)) for row in rows]
        return ground._replace(disturbed=np.array(padded))

    @property
    def assumes(self) -> str:
        return "its form and numbers, and no disturbance by the motion itself"

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, DisturbedGround]:
        return {"disturbed-ground": cls(places=(0.0, -0.1), radius=0.05, weakening=x)}
