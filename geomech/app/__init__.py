"""Questions of measurements from Python."""

from geomech.app.questions import fit_midlines
from geomech.app.results import FittedMidlines

__all__ = ["FittedMidlines", "fit_midlines"]


def __dir__() -> list[str]:
    return __all__
