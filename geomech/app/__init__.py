"""Questions of measurements from Python."""

from geomech.app.questions import fit_medium, fit_midlines
from geomech.app.results import FittedMedium, FittedMidlines

__all__ = ["FittedMedium", "FittedMidlines", "fit_medium", "fit_midlines"]


def __dir__() -> list[str]:
    return __all__
