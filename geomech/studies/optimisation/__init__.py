"""Search for the gaits of a scene with the largest displacement, efficiency, turning or
speed."""

from geomech.studies.optimisation.optimum import Optimum
from geomech.studies.optimisation.request import Request, build_request
from geomech.studies.optimisation.search import optimise, search

optimize = optimise  # both spellings are in use

__all__ = ["Optimum", "Request", "build_request", "optimise", "optimize", "search"]


def __dir__() -> list[str]:
    return __all__
