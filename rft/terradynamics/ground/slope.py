"""A sloping surface: gravity pulls the body along it, and the ground is weaker under
faces that move downhill."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers
from rft.laws.catalogue import REPOSE
from rft.laws.incline import (
    assumed_of_incline,
    gravity_on_incline,
    incline_factors,
    require_below_repose,
)
from rft.terradynamics.ground.base import GROUND_EFFECTS, Ground, GroundEffect


@GROUND_EFFECTS.register
@dataclass(frozen=True)
class Slope(GroundEffect):
    """A surface that rises towards +x; x is along it, z and depths are normal to it.

    With the default angle of repose, 37.9 degrees, a plate that moves straight downhill
    on a slope of 20 degrees has half its drag on level ground, as measured (paper Sec.
    IV B). With 30 degrees, the angle of many heaps, it would have a third. Gravity adds
    the force -mass g sin(angle) along the slope at the origin of an intruder. Powers
    are those of the grains alone. Robots that walk have a mass of their own, and
    gravity acts on all of it along the slope and along its normal.

    The strength is cos(angle) - d sin|angle| / tan(repose) times that of level ground
    (`rft.laws.incline`). Here d, 0 to 1, is the downhill component of the face's unit
    velocity, 0 for a face that moves straight in, across or uphill.

    One direction at one angle has been measured. Assumed are a strength that falls in
    proportion to d, no gain uphill, and one factor for forces along and across a face.
    Liao and Qian (arXiv:2603.06928, 2026) find that a slope hardly changes the
    resistance to penetration and much reduces the resistance to shear.

    Examples
    --------
    >>> import math
    >>> from rft.terradynamics.ground import Slope, ground_of, strength_at
    >>> ground = ground_of([Slope(angle=math.radians(20))])
    >>> round(float(strength_at(ground, 0.0, -1.0)), 3)  # straight downhill
    0.5
    """

    angle: Annotated[
        float,
        Number(
            -math.pi / 2,
            math.pi / 2,
            "rad",
            "angle by which the surface rises; negative if it falls",
        ),
    ]
    repose: Annotated[
        float,
        Number(
            0.01,
            1.5,
            "rad",
            "angle of repose, at which the ground slides by itself; must exceed "
            "the slope",
        ),
    ] = REPOSE
    mass: Annotated[
        float, Number(0, 1e6, "kg", "mass of an intruder; robots have their own")
    ] = 0.0

    kind = "slope"
    limit = "angle = 0"
    cost = "one multiplication per element"
    walks = True

    def __post_init__(self):
        check_numbers(self)
        require_below_repose(self.angle, self.repose)

    def apply(self, ground: Ground) -> Ground:
        level_factor, downhill_loss = incline_factors(self.angle, self.repose)
        share = float(downhill_loss / level_factor)
        return ground._replace(
            strength=ground.strength * float(level_factor),
            downhill_loss=-math.copysign(share, self.angle),
        )

    def weight(self) -> tuple[float, float]:
        along, _ = gravity_on_incline(self.angle)
        return self.mass * along, 0.0

    @property
    def rise(self) -> float:
        return self.angle

    @property
    def assumes(self) -> str:
        return assumed_of_incline(self.repose, "a face")

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Slope]:
        return {"slope": cls(angle=x, repose=0.6)}
