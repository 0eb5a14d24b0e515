"""The ground under plates and triangles: its strength and rounding, the lead of faces,
and effects on the ground, one file each.

A new file in this folder is found by itself (`rft.core.registry.load_all`); imports
here are the public names. `rft.terradynamics.ground.slope` is a short example."""

from rft.core.registry import load_all
from rft.terradynamics.ground.aeration import Aeration
from rft.terradynamics.ground.base import (
    GROUND_EFFECTS,
    Ground,
    GroundEffect,
    checked_effects,
    ground_of,
    inverse_speed,
    rise_of,
    strength_at,
    weight,
)
from rft.terradynamics.ground.disturbed import DisturbedGround
from rft.terradynamics.ground.grain_inertia import GrainInertia
from rft.terradynamics.ground.slope import Slope

load_all(__name__, __path__)

__all__ = [
    "GROUND_EFFECTS",
    "Aeration",
    "DisturbedGround",
    "GrainInertia",
    "Ground",
    "GroundEffect",
    "Slope",
    "checked_effects",
    "ground_of",
    "inverse_speed",
    "rise_of",
    "strength_at",
    "weight",
]


def __dir__() -> list[str]:
    return __all__
