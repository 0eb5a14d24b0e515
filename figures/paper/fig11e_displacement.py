"""Fig. 11(e): displacement per cycle of circle and butterfly gaits against amplitude,
by every tier.

The tiers are the CCF of the uniform fit, the CCF adapted to the family of gaits, path
integrals, and the balance of forces.
"""

from __future__ import annotations

import numpy as np

from figures import main
from geomech import plots
from geomech.mathematics.gaits import Butterfly, Circle
from geomech.mathematics.tiers import TIERS
from geomech.scenes import load
from geomech.studies.scene_tables import SceneTables

GAITS = {"circle": Circle(reverse=True), "butterfly": Butterfly()}
AMPLITUDES = {
    "circle": np.linspace(0.125, 2.25, 18),
    "butterfly": np.linspace(0.1, 1.3, 13),
}


def compute(scene: str = "three-link-glass", amplitudes: dict | None = None) -> dict:
    """Return the displacements of each gait, by amplitude and tier."""
    study = SceneTables(load(scene))
    tables = {}
    for name, values in (amplitudes or AMPLITUDES).items():
        tables[name] = study.displacements(values, [*TIERS], GAITS[name])
    return {"tables": tables}


def draw_gaits(axes, tables: dict) -> None:
    """Draw the displacements of each gait on its own axes, without a legend."""
    for ax, (name, table) in zip(axes, tables.items()):
        plots.displacement(table, ax=ax, errors=False, legend=False)
        ax.set_title(name)


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.2, 3.4, len(numbers["tables"]))
    draw_gaits(axes[0], numbers["tables"])
    plots.shared_legend(fig)
    return fig


if __name__ == "__main__":
    main("fig11e", compute, draw)
