"""A surface that slopes: gravity pulls the body along it, and weakens the ground for what moves downhill."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rft.media.base import check_ranges, require
from rft.media.catalogue import GRAVITY
from rft.vertical.effects.base import GroundEffect

# Of the paper's one datum: along a surface tilted by 20 degrees a plate that moves downhill has 50 % less drag (Sec. IV B).
REPOSE = math.atan(math.sin(math.radians(20.0)) / (math.cos(math.radians(20.0)) - 0.5))  # rad, 37.9 degrees


@dataclass(frozen=True)
class Slope(GroundEffect):
    """The surface rises towards +x; x runs along it, z away from it, depth along z.

    angle (rad): by which it rises; it falls if negative. repose (rad): the angle at which the ground slides by itself; as
    steep a slope, or a steeper one, is refused. The default, 37.9 degrees, is the one with which a plate that moves straight
    downhill at 20 degrees has half its drag on level ground, as measured (paper Sec. IV B); 30 degrees, as of many heaps,
    would leave it a third. mass (kg): of the body; gravity adds the force
    -mass g sin(angle) along the slope at the body's origin, besides that of the grains, of which alone the power is told.

    Strength times cos(angle) - d sin|angle| / tan(repose), where d, 0 to 1, is the downhill part of the unit velocity of the
    face, 0 of one that moves straight in, across or uphill. Straight downhill that is sin(repose - |angle|) / sin(repose):
    grains |z| deep can take a shear of rho g |z| cos(angle) tan(repose), and their own weight along the slope takes
    rho g |z| sin|angle| of it. One direction at one angle has been measured: that strength falls in proportion to d, that
    nothing is gained uphill, and that forces along and across a face weaken alike, is assumed. Liao and Qian
    (arXiv:2603.06928, 2026) find the resistance to penetration nearly unchanged by a slope and that to shear much less.
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

    def share(self, x, ahead=0.0) -> np.ndarray:
        return math.cos(self.angle) - np.maximum(-math.sin(self.angle) * ahead, 0.0) / math.tan(self.repose)

    def weight(self) -> tuple[float, float]:
        return -self.mass * GRAVITY * math.sin(self.angle), 0.0

    @property
    def assumes(self) -> str:
        told = f"an angle of repose of {math.degrees(REPOSE):.1f} degrees, from half the drag downhill at 20, and "
        return f"{told if self.repose == REPOSE else ''}that only what moves downhill meets weaker ground"
