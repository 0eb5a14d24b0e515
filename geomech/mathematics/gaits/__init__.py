"""Gaits: closed curves in shape space, one file each.

A new file in this folder is found by itself (`rft.core.registry.load_all`); imports
here are the public names. `geomech.mathematics.gaits.polygon` is a short example."""

from geomech.mathematics.gaits.centreline import Centreline
from geomech.mathematics.gaits.fourier import Butterfly, Circle, Ellipse, Fourier
from geomech.mathematics.gaits.points import Points
from geomech.mathematics.gaits.polygon import Polygon
from geomech.mathematics.gaits.shchf import Shchf
from geomech.mathematics.gaits.waves import Sine, Wave
from geomech.mathematics.gaits.wound import Wound
from geomech.mathematics.geometry.gait import GAITS, Gait
from rft.core.registry import load_all

load_all(__name__, __path__)
KINDS = GAITS

__all__ = [
    "GAITS",
    "KINDS",
    "Butterfly",
    "Centreline",
    "Circle",
    "Ellipse",
    "Fourier",
    "Gait",
    "Points",
    "Polygon",
    "Shchf",
    "Sine",
    "Wave",
    "Wound",
]


def __dir__() -> list[str]:
    return __all__
