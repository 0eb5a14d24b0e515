"""The vertical plane (terradynamics): stress maps, outlines, motions, and the force of the grains on what moves."""

from rft.vertical.catalogue import VERTICAL, VerticalEntry
from rft.vertical.loads import Loads, Parts, loads, net, parts
from rft.vertical.measured import PlateDrags
from rft.vertical.motions import MOTIONS, Course, Drag, Motion, Path, Penetrate, Rotate
from rft.vertical.outline import Outline
from rft.vertical.shapes import (
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
from rft.vertical.stress import PlateStress, StressMap
from rft.vertical.survey import Survey, survey

__all__ = [
    "MOTIONS", "SHAPES", "VERTICAL", "CLeg", "Course", "Drag", "FlatLeg", "HalfCylinder", "Loads", "Motion", "Outline", "Parts",
    "Path", "Penetrate", "Plate", "PlateDrags", "PlateStress", "Polygon", "Rotate", "RoundRod", "Shape", "Spline", "SquareRod",
    "StressMap", "Survey", "VerticalEntry", "Wheel", "loads", "net", "parts", "survey",
]  # fmt: skip
