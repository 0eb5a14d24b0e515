"""Bodies, one a file.

A new file in this folder is found by itself (`rft.core.registry.load_all`); imports
here are the public names. `rft.bodies.chain` is a short example."""

from rft.bodies.backbone import Backbone, ConstantCurvature, Serpenoid
from rft.bodies.base import BODIES, Body, Elements
from rft.bodies.chain import Chain
from rft.bodies.legged import LeggedChain
from rft.bodies.positions import Positions
from rft.core.registry import load_all

load_all(__name__, __path__)

__all__ = [
    "BODIES",
    "Backbone",
    "Body",
    "Chain",
    "ConstantCurvature",
    "Elements",
    "LeggedChain",
    "Positions",
    "Serpenoid",
]


def __dir__() -> list[str]:
    return __all__
