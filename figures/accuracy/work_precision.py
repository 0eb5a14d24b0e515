"""Work and precision: error against time for every tier and setting of the built-in
scene."""

from __future__ import annotations

import geomech
from figures import main
from geomech.core.variables import Result


def compute(scene: str = "three-link-glass", runs: int = 2) -> Result:
    """Return errors and times of every setting (`geomech accuracy`)."""
    return geomech.accuracy(scene, runs=runs)


def draw(numbers: Result):
    return numbers.plot()


if __name__ == "__main__":
    main("work_precision", compute, draw)
