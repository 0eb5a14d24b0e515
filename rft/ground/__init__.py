"""The ground under plates and triangles: what it does to faces that lead, and effects on it, one file each."""

from rft.ground.aeration import Aeration
from rft.ground.base import Ground, GroundEffect, checked, ground_of, per_speed, share, weight
from rft.ground.disturbed import DisturbedGround
from rft.ground.grain_inertia import GrainInertia
from rft.ground.slope import Slope

ALL = (GrainInertia, Aeration, Slope, DisturbedGround)
KINDS = {effect.kind: effect for effect in ALL}

__all__ = [
    "KINDS", "Aeration", "DisturbedGround", "GrainInertia", "Ground", "GroundEffect", "Slope", "checked", "ground_of",
    "per_speed", "share", "weight",
]  # fmt: skip
