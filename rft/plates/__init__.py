"""The vertical plane (terradynamics): stress maps, outlines, motions, and the force of the grains on moving outlines."""

from rft.plates.catalogue import VERTICAL, VerticalEntry
from rft.plates.contact import Part
from rft.plates.loads import Loads, loads, parts
from rft.plates.measured import PlateDrags
from rft.plates.motions import (
    MOTIONS,
    Drag,
    Motion,
    Path,
    Penetrate,
    Rotate,
    Trajectory,
)
from rft.plates.outline import Outline
from rft.plates.shapes import (
    SHAPES,
    CLeg,
    FlatLeg,
    HalfCylinder,
    Plate,
    Polygon,
    RoundRod,
    Shape,
    Spline,
    SquareRod,
    Wheel,
)
from rft.plates.stress import PlateStress, StressMap
from rft.plates.survey import Survey, survey

__all__ = [
    "MOTIONS",
    "SHAPES",
    "VERTICAL",
    "CLeg",
    "Drag",
    "FlatLeg",
    "HalfCylinder",
    "Loads",
    "Motion",
    "Outline",
    "Part",
    "Path",
    "Penetrate",
    "Plate",
    "PlateDrags",
    "PlateStress",
    "Polygon",
    "Rotate",
    "RoundRod",
    "Shape",
    "Spline",
    "SquareRod",
    "StressMap",
    "Survey",
    "Trajectory",
    "VerticalEntry",
    "Wheel",
    "loads",
    "parts",
    "survey",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__
