"""The Python face: a study of a scene that computes, prints itself and draws."""

from geomech.app.questions import accuracy, fit_medium, fit_midlines, optimise, sweep
from geomech.app.results import (
    Displacements,
    FittedMedium,
    FittedMidlines,
    Forces,
    Optimum,
    Swept,
)
from geomech.app.study import Study, study

optimize = optimise

__all__ = [
    "Displacements",
    "FittedMedium",
    "FittedMidlines",
    "Forces",
    "Optimum",
    "Study",
    "Swept",
    "accuracy",
    "fit_medium",
    "fit_midlines",
    "optimise",
    "optimize",
    "study",
    "sweep",
]


def __dir__() -> list[str]:
    return __all__
