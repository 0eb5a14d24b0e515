"""Measured gaits: from the log of an experiment to the connection near its mean gait,
one stage a file."""

from geomech.studies.measured.fit import Fitted, fit_log
from geomech.studies.measured.log import Log, read

__all__ = ["Fitted", "Log", "fit_log", "read"]


def __dir__() -> list[str]:
    return __all__
