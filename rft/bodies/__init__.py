"""Bodies, one a file."""

from rft.bodies.backbone import Backbone, ConstantCurvature, Serpenoid
from rft.bodies.base import BODIES, Body, Elements
from rft.bodies.chain import Chain
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
    "Positions",
    "Serpenoid",
]


def __dir__() -> list[str]:
    return __all__
