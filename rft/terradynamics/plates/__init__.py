"""The vertical plane (terradynamics): stress maps, outlines, motions, and the force of
the grains on moving outlines."""

from rft.terradynamics.plates.catalogue import VERTICAL, VerticalEntry
from rft.terradynamics.plates.contact import Part
from rft.terradynamics.plates.loads import Loads, loads, parts
from rft.terradynamics.plates.measured import PlateDrags
from rft.terradynamics.plates.motions import (
    MOTIONS,
    Drag,
    Motion,
    Path,
    Penetrate,
    Rotate,
    Trajectory,
)
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.plates.shapes import (
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
from rft.terradynamics.plates.stress import PlateStress, StressMap
from rft.terradynamics.plates.survey import Survey, survey

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
