"""Search for the gaits of a scene with the largest displacement, efficiency, turning or speed."""

from geomech.optimise.optimum import Optimum
from geomech.optimise.request import Request, checked
from geomech.optimise.search import optimise, search

__all__ = ["Optimum", "Request", "checked", "optimise", "search"]
