"""Optimal gaits: the strokes of the three-link swimmer in a viscous fluid and in loose
glass beads that are best for displacement and for efficiency.

The optima in sand are larger and yield more, for two reasons. First, drag in sand does
not grow with speed: a link that moves slowly holds as firmly as one that sweeps. Wide
strokes therefore pay, in which one end sweeps while the rest is an anchor, and a fast
sweep costs no more work than a slow one. If drag is proportional to |v|^p, with the
fluid's ratio 2 of drag across to drag along, the stroke for displacement reaches 1.9
rad and 0.10 BL at p = 1. It reaches the limit of 2.5 rad at smaller p, with 0.23 BL at
p = 0.3 and 0.37 BL at p = 0. The stroke for efficiency reaches 1.44 rad at p = 1 and
the limit at the other values. Second, at small slip the drag of sand across is 1 + C /
tan gamma0 = 8.3 times the drag along. This ratio alone increases the displacement of a
stroke and shrinks the loop: a fluid with the same ratio has 0.40 BL at 1.76 rad.

In the fluid the stroke for displacement follows the zero line of the CCF. The stroke
for efficiency cuts off the far ends, which add little area for much path. In sand the
CCF is computed from a least-squares connection, which does not give all of the
displacement.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from geomech.studies.optimisation import optimise
from geomech.studies.optimisation.limiting import PHASES

SCENES = {
    "viscous fluid, ratio 2": "three-link-viscous",
    "loose 0.3 mm glass": "three-link-glass",
}
OBJECTIVES = {"displacement": (style.BLACK, "-"), "efficiency": (style.GREEN, "--")}


def compute(harmonics: int = 5, starts: int | None = None, **numerics) -> dict:
    """Return, by medium, the optimum for each of OBJECTIVES, and "ccf", the CCF whose
    area they gain."""
    numbers: dict = {}
    for medium, name in SCENES.items():
        scene = load(name).with_numerics(**numerics)
        optima = {}
        for objective in OBJECTIVES:
            optima[objective] = optimise(
                scene, objective, harmonics=harmonics, starts=starts
            )
        numbers[medium] = {**optima, "ccf": optima["displacement"].gained}
    return numbers


def table(numbers: dict) -> str:
    """Return a line for each optimum."""
    heads = (
        "medium",
        "objective",
        "BL per cycle",
        "path length",
        "BL a unit",
        "reach (rad)",
    )
    rows = []
    for medium, optima in numbers.items():
        for objective in OBJECTIVES:
            best = optima[objective].best
            distance = net_distance(best)
            row = (
                medium,
                objective,
                f"{distance:.4f}",
                f"{best.length:.4f}",
                f"{distance / best.length:.4f}",
                f"{reach(best.gait):.2f}",
            )
            rows.append(row)
    return style.table(heads, rows)


def net_distance(best) -> float:
    """Return the net distance of a gait in a cycle, body lengths."""
    return float(np.hypot(*best.displacement[:2]))


def reach(gait) -> float:
    """Return the largest joint angle, rad."""
    return float(np.abs(gait.cycle(PHASES)[0]).max())


@plots.styled
def draw(numbers: dict):
    """Draw the optima over the CCF, a panel for each medium."""
    fig, axes = plots.figure(7.0, 3.3, len(numbers))
    for ax, (medium, optima) in zip(axes[0], numbers.items()):
        plots.ccf_map(*optima["ccf"], ax=ax)
        ax.set_title(medium)
        for objective, (colour, dashes) in OBJECTIVES.items():
            best = optima[objective].best
            loop = best.gait.shape(np.linspace(0, 2 * np.pi, PHASES))
            distance = f"{net_distance(best):.3f} BL"
            label = f"{objective}: {distance}, path {best.length:.2f}"
            ax.plot(*loop.T, color=colour, ls=dashes, lw=1.6, label=label)
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22))
    fig.suptitle("CCF in the minimum-perturbation frame", fontsize=9)
    return fig


if __name__ == "__main__":
    main("optimal_gaits", compute, draw, table)
