"""A surface that slopes: gravity pulls the body along it, and the ground is the weaker the nearer it is to sliding itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rft.media.base import check_ranges, require
from rft.media.catalogue import GRAVITY
from rft.vertical.effects.base import GroundEffect

REPOSE = math.radians(30.0)  # assumed


@dataclass(frozen=True)
class Slope(GroundEffect):
    """The surface rises towards +x; x runs along it, z away from it, depth along z.

    angle (rad): by which it rises; it falls if negative. repose (rad): the angle of repose, of which a slope slides by
    itself; as steep a one, or a steeper, is refused. mass (kg): of the body; gravity adds the force -mass g sin(angle) along
    the slope at the body's origin, besides that of the grains, of which alone the power is told.

    Strength times cos(angle) - sin|angle| / tan(repose) = sin(repose - |angle|) / sin(repose): grains |z| deep can take a
    shear of rho g |z| cos(angle) tan(repose), their own weight along the slope takes rho g |z| sin|angle| of it, and what is
    left resists the body, in the measure of level ground. That this holds for all directions of motion alike is assumed.
    """

    angle: float
    repose: float = REPOSE
    mass: float = 0.0

    kind = "slope"
    limit = "angle = 0"
    cost = "one multiplication an element"
    angles = ("angle", "repose")

    def __post_init__(self):
        check_ranges(self, angle=(-math.pi / 2, math.pi / 2), repose=(0.01, 1.5), mass=(0, 1e6))
        steep, most = math.degrees(self.angle), math.degrees(self.repose)
        told = (
            f"a slope of {steep:.3g} degrees slides by itself: it must be below the angle of repose, {most:.3g} degrees"
        )
        require(abs(self.angle) < self.repose, told)

    def share(self, x) -> float:
        return math.cos(self.angle) - math.sin(abs(self.angle)) / math.tan(self.repose)

    def weight(self) -> tuple[float, float]:
        return -self.mass * GRAVITY * math.sin(self.angle), 0.0

    @property
    def assumes(self) -> str:
        repose = f"an angle of repose of {math.degrees(REPOSE):.0f} degrees and " if self.repose == REPOSE else ""
        return f"{repose}that strength is lost for all directions of motion alike"
