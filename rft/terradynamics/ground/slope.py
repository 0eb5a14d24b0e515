"""A sloping surface: gravity pulls the body along it, and the ground is weaker under
faces that move downhill."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers
from rft.core.metres import GRAVITY
from rft.core.refusal import require
from rft.laws.catalogue import REPOSE
from rft.terradynamics.ground.base import GROUND_EFFECTS, Ground, GroundEffect


@GROUND_EFFECTS.register
@dataclass(frozen=True)
class Slope(GroundEffect):
    """A surface that rises towards +x; x is along it, z and depths are normal to it.

    With the default angle of repose, 37.9 degrees, a plate that moves straight downhill
    on a slope of 20 degrees has half its drag on level ground, as measured (paper Sec.
    IV B). With 30 degrees, the angle of many heaps, it would have a third. Gravity adds
    the force -mass g sin(angle) along the slope at the body's origin. Powers are those
    of the grains alone.

    The strength is cos(angle) - d sin|angle| / tan(repose) times that of level ground.
    Here d, 0 to 1, is the downhill component of the face's unit velocity, 0 for a face
    that moves straight in, across or uphill. Straight downhill the factor is
    sin(repose - |angle|) / sin(repose): grains |z| deep can take a shear of
    rho g |z| cos(angle) tan(repose), of which their own weight along the slope takes
    rho g |z| sin|angle|.

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
    mass: Annotated[float, Number(0, 1e6, "kg", "mass of the body")] = 0.0

    kind = "slope"
    limit = "angle = 0"
    cost = "one multiplication per element"

    def __post_init__(self):
        check_numbers(self)
        angle = math.degrees(self.angle)
        repose = math.degrees(self.repose)
        require(
            abs(self.angle) < self.repose,
            f"a slope of {angle:.3g} degrees slides by itself: "
            f"it must be below the angle of repose, {repose:.3g} degrees",
        )

    def apply(self, ground: Ground) -> Ground:
        loss = -math.tan(self.angle) / math.tan(self.repose)
        return ground._replace(
            strength=ground.strength * math.cos(self.angle), downhill_loss=loss
        )

    def weight(self) -> tuple[float, float]:
        return -self.mass * GRAVITY * math.sin(self.angle), 0.0

    @property
    def assumes(self) -> str:
        downhill_only = "weaker ground only where a face moves downhill"
        if self.repose != REPOSE:
            return downhill_only
        repose = math.degrees(REPOSE)
        return (
            f"an angle of repose of {repose:.1f} degrees, from half the drag downhill "
            f"at 20 degrees, and {downhill_only}"
        )

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Slope]:
        return {"slope": cls(angle=x, repose=0.6)}
