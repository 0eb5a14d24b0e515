"""Fig. 11(c): the x row of the local connection of the three-link swimmer, with a circle gait."""

from __future__ import annotations

import numpy as np

from figures import main
from geomech.output import plots
from geomech.scene import load
from geomech.study.bench import Study


def compute(scene: str = "three-link-glass", **numerics) -> dict:
    """The connection on its grid, and the rms misfit of the linear fit over the rms velocity, per component (3,)."""
    loaded = load(scene).with_numerics(**numerics)
    fitted = Study(loaded).fitted
    misfit = np.sqrt((fitted.residual**2).mean((1, 2)) / (fitted.speed**2).mean((1, 2)))
    return {"connection": fitted, "misfit": misfit, "gait": loaded.gait}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(4.2, 3.4)
    ax = plots.vector_field(numbers["connection"], 0, ax=axes[0, 0])
    plots.draw_gait(numbers["gait"], ax, color="#D55E00")
    return fig


if __name__ == "__main__":
    main("fig11c", compute, draw)
