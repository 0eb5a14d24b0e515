"""The ground under plates and triangles: its strength and rounding, the lead of faces, and effects, one file each."""

from rft.ground.aeration import Aeration
from rft.ground.base import Ground, GroundEffect, checked_effects, ground_of, inverse_speed, strength_at, weight
from rft.ground.disturbed import DisturbedGround
from rft.ground.grain_inertia import GrainInertia
from rft.ground.slope import Slope

ALL = (GrainInertia, Aeration, Slope, DisturbedGround)
KINDS = {effect.kind: effect for effect in ALL}

__all__ = [
    "KINDS", "Aeration", "DisturbedGround", "GrainInertia", "Ground", "GroundEffect", "Slope", "checked_effects",
    "ground_of", "inverse_speed", "strength_at", "weight",
]  # fmt: skip
