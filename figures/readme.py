"""The README's picture: Fig. 11(d) and (e) side by side."""

from __future__ import annotations

from figures import fig11d_ccf, fig11e_displacement, main
from geomech import plots


def compute() -> dict:
    """Return the numbers of both figures."""
    return {"map": fig11d_ccf.compute(), "tables": fig11e_displacement.compute()}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(10.8, 3.7, 3)
    field, study = numbers["map"], numbers["tables"]
    plots.ccf_map(field["ccf"], 0, field["gaits"], ax=axes[0, 0], error=field["error"])
    for ax, (name, table) in zip(axes[0, 1:], study["tables"].items()):
        plots.displacement(table, ax=ax, gait=fig11e_displacement.GAITS[name], errors=False)
    return fig


if __name__ == "__main__":
    main("readme", compute, draw)
