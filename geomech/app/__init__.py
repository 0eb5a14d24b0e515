"""Questions of measurements and of accuracy from Python."""

from geomech.app.questions import accuracy, fit_medium, fit_midlines
from geomech.app.results import FittedMedium, FittedMidlines

__all__ = ["FittedMedium", "FittedMidlines", "accuracy", "fit_medium", "fit_midlines"]


def __dir__() -> list[str]:
    return __all__
