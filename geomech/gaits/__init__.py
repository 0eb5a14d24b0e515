"""Gaits: closed curves in shape space."""

from geomech.gaits.centreline import Centreline
from geomech.gaits.fourier import Butterfly, Circle, Ellipse, Fourier
from geomech.gaits.points import Points
from geomech.gaits.waves import Sine, Wave
from geomech.geometry.gait import Gait

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
