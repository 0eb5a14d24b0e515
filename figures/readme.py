"""Picture of the README: Fig. 11(d) and (e) side by side."""

from __future__ import annotations

from figures import main
from figures.paper import fig11d_ccf, fig11e_displacement
from geomech import plots


def compute() -> dict:
    """Return the numbers of both figures."""
    return {"map": fig11d_ccf.compute(), "tables": fig11e_displacement.compute()}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(10.8, 3.0, 3, width_ratios=[1.15, 1.0, 1.0])
    ccf = numbers["map"]
    plots.ccf_map(ccf["ccf"], 0, ccf["gaits"], ax=axes[0, 0], error=ccf["error"])
    fig11e_displacement.draw_gaits(axes[0, 1:], numbers["tables"]["tables"])
    plots.shared_legend(fig, "outside right center")
    return fig


if __name__ == "__main__":
    main("readme", compute, draw)
