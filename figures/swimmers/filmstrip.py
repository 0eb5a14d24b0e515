"""Filmstrip of a gait: six shapes of the butterfly gait in loose glass beads, along the
track of the body and on the CCF map."""

from __future__ import annotations

import geomech
from figures import main
from geomech import plots
from geomech.core.variables import Result
from geomech.scenes import load


def compute(scene: str = "butterfly-glass", cycles: int = 1, **numerics) -> Result:
    """Return the motion with the CCF (`geomech.trajectory`)."""
    return geomech.trajectory(load(scene).with_numerics(**numerics), cycles)


def draw(numbers: Result):
    return plots.filmstrip(numbers)


if __name__ == "__main__":
    main("filmstrip", compute, draw)
