"""Fig. 11(c): the x row of the local connection of the three-link swimmer, with a
circle gait."""

from __future__ import annotations

from figures import main, style
from geomech import plots
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables


def compute(scene: str = "three-link-glass", **numerics) -> dict:
    """Return the connection on its grid, and the gait."""
    loaded = load(scene).with_numerics(**numerics)
    return {"connection": SceneTables(loaded).fitted, "gait": loaded.gait}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(4.2, 3.4)
    ax = plots.vector_field(numbers["connection"], 0, ax=axes[0, 0])
    plots.draw_gait(numbers["gait"], ax, color=style.VERMILION)
    return fig


if __name__ == "__main__":
    main("fig11c", compute, draw)
