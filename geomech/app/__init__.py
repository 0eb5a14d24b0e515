"""Questions of measurements and of accuracy from Python."""

from geomech.app.questions import accuracy, fit_midlines
from geomech.app.results import FittedMidlines

__all__ = ["FittedMidlines", "accuracy", "fit_midlines"]


def __dir__() -> list[str]:
    return __all__
