"""Effects beyond the plain force law, one file each. A scene asks for them; none is evaluated unasked."""

from rft.effects.base import PREMISES, Effect
from rft.effects.end_caps import EndCaps
from rft.effects.grain_inertia import GrainInertia
from rft.effects.skin import SkinFriction

KINDS = {"skin-friction": SkinFriction, "end-caps": EndCaps, "grain-inertia": GrainInertia}

__all__ = ["KINDS", "PREMISES", "Effect", "EndCaps", "GrainInertia", "SkinFriction"]
