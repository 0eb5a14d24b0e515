"""Gaits: closed curves in shape space."""

from geomech.gaits.base import Gait
from geomech.gaits.fourier import Butterfly, Circle, Ellipse, Fourier
from geomech.gaits.points import Points

KINDS = {"circle": Circle, "ellipse": Ellipse, "butterfly": Butterfly, "fourier": Fourier, "points": Points}

__all__ = ["KINDS", "Butterfly", "Circle", "Ellipse", "Fourier", "Gait", "Points"]
