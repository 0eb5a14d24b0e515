"""The question of accuracy from Python."""

from geomech.app.questions import accuracy

__all__ = ["accuracy"]


def __dir__() -> list[str]:
    return __all__
