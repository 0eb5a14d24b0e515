"""Effects beyond the plain force law, one a file; only those that a scene lists are
computed.

A new file in this folder is found by itself (`rft.core.registry.load_all`); imports
here are the public names. `rft.effects.skin` is a short example, `rft.effects.base`
tells what an effect may define."""

from rft.core.registry import load_all
from rft.effects.base import (
    EFFECTS,
    ENGINES,
    Effect,
    Site,
    batched_effect,
    broken_premises,
    engine,
    stepwise_effects,
)
from rft.effects.body_inertia import BodyInertia
from rft.effects.depth import DepthProfile
from rft.effects.disturbed import DisturbedGround
from rft.effects.end_caps import EndCaps
from rft.effects.grain_inertia import GrainInertia
from rft.effects.skin import SkinFriction
from rft.effects.slope import Slope
from rft.effects.springs import Springs
from rft.effects.towed import TowedSled
from rft.effects.transient import Transient

load_all(__name__, __path__)

__all__ = [
    "EFFECTS",
    "ENGINES",
    "BodyInertia",
    "DepthProfile",
    "DisturbedGround",
    "Effect",
    "EndCaps",
    "GrainInertia",
    "Site",
    "SkinFriction",
    "Slope",
    "Springs",
    "TowedSled",
    "Transient",
    "batched_effect",
    "broken_premises",
    "engine",
    "stepwise_effects",
]


def __dir__() -> list[str]:
    return __all__
