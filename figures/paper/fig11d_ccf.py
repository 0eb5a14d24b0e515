"""Fig. 11(d): the x component of the CCF of the three-link swimmer, with a circle and a
butterfly gait."""

from __future__ import annotations

from figures import main
from geomech import plots
from geomech.mathematics.gaits import Butterfly
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables


def compute(scene: str = "three-link-glass", **numerics) -> dict:
    """Return the CCF on its grid and its error (Fields with values (3, N, N)), and the
    gaits."""
    loaded = load(scene).with_numerics(**numerics)
    study = SceneTables(loaded)
    return {
        "ccf": study.curvature,
        "error": study.curvature_error,
        "gaits": [loaded.gait, Butterfly()],
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(4.2, 3.4)
    error = numbers["error"]
    plots.ccf_map(numbers["ccf"], 0, numbers["gaits"], ax=axes[0, 0], error=error)
    return fig


if __name__ == "__main__":
    main("fig11d", compute, draw)
