"""Gaits: closed curves in shape space."""

from geomech.gaits.base import Gait
from geomech.gaits.centreline import Centreline
from geomech.gaits.fourier import Butterfly, Circle, Ellipse, Fourier
from geomech.gaits.points import Points
from geomech.gaits.waves import Sine, Wave

KINDS = {
    "circle": Circle,
    "ellipse": Ellipse,
    "butterfly": Butterfly,
    "fourier": Fourier,
    "points": Points,
    "sine": Sine,
    "wave": Wave,
    "centreline": Centreline,
}

__all__ = ["KINDS", "Butterfly", "Centreline", "Circle", "Ellipse", "Fourier", "Gait", "Points", "Sine", "Wave"]
