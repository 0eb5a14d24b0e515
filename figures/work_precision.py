"""The cost of accuracy: error against time for every tier and setting of the built-in scene."""

from __future__ import annotations

from figures import main
from geomech import plots
from geomech.scenes import load
from geomech.studies import accuracy


def compute(scene: str = "three-link-glass", runs: int = 2) -> dict:
    """Return errors and times of every setting, as `accuracy.study` gives them."""
    return accuracy.study(load(scene), runs=runs)


def draw(numbers: dict):
    return plots.work_precision_figure(numbers)


if __name__ == "__main__":
    main("work_precision", compute, draw)
