"""The ground under plates and triangles: its strength and rounding, the lead of faces, and effects, one file each."""

from rft.ground.aeration import Aeration
from rft.ground.base import (
    GROUND_EFFECTS,
    Ground,
    GroundEffect,
    checked_effects,
    ground_of,
    inverse_speed,
    strength_at,
    weight,
)
from rft.ground.disturbed import DisturbedGround
from rft.ground.grain_inertia import GrainInertia
from rft.ground.slope import Slope
from rft.registry import load_all

load_all(__name__, __path__)

__all__ = [
    "GROUND_EFFECTS", "Aeration", "DisturbedGround", "GrainInertia", "Ground", "GroundEffect", "Slope", "checked_effects",
    "ground_of", "inverse_speed", "strength_at", "weight",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
