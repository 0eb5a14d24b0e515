"""Effects of the vertical plane beyond the plain law of stress, one file each. A scene asks for them."""

from rft.vertical.effects.aeration import Aeration
from rft.vertical.effects.base import Ground, GroundEffect, checked, folded, pressure, strength, weight
from rft.vertical.effects.disturbed import DisturbedGround
from rft.vertical.effects.grain_inertia import GrainInertia
from rft.vertical.effects.slope import Slope

ALL = (GrainInertia, Aeration, Slope, DisturbedGround)
KINDS = {effect.kind: effect for effect in ALL}

__all__ = [
    "KINDS", "Aeration", "DisturbedGround", "GrainInertia", "Ground", "GroundEffect", "Slope", "checked", "folded", "pressure",
    "strength", "weight",
]  # fmt: skip
