"""Optimal gaits of the three-link swimmer in a viscous fluid and in loose glass: for
displacement, and for efficiency.

Sand's optima are larger and bring more. Two things differ. Drag in sand does not grow
with speed: a link that creeps holds as firmly as one that sweeps, so that wide strokes
pay, in which one end sweeps while the rest is an anchor, and a fast sweep costs no more
work than a slow one. With drag like |v|^p and the fluid's ratio of drag across to drag
along, 2, the stroke for displacement reaches 1.9 rad and 0.10 BL at p = 1, and the
limit of 2.5 rad and 0.23 BL at p = 0.3 and 0.37 BL at p = 0; that for efficiency 1.44
rad, and the limit at both. And at small slip sand's drag across is 1 + C / tan gamma0 =
8.3 times that along. That alone adds to what a stroke brings and draws the loop in: a
fluid of that ratio has 0.40 BL at 1.76 rad.

In the fluid the stroke for displacement follows the zero line of the CCF, and that for
efficiency cuts the far ends off, where little area is left for much path. In sand the
CCF is that of a least-squares connection, which is not all.
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
    out = {}
    for medium, name in SCENES.items():
        scene = load(name).with_numerics(**numerics)
        out[medium] = {
            objective: optimise(scene, objective, harmonics=harmonics, starts=starts)
            for objective in OBJECTIVES
        }
        out[medium]["ccf"] = out[medium]["displacement"].gained
    return out


def table(numbers: dict) -> str:
    """Return a line for each optimum."""
    heads = (
        "medium",
        "objective",
        "BL a cycle",
        "path length",
        "BL a unit",
        "reach (rad)",
    )
    best = {
        (medium, objective): found[objective].best
        for medium, found in numbers.items()
        for objective in OBJECTIVES
    }
    rows = [
        (
            *names,
            f"{net(x):.4f}",
            f"{x.length:.4f}",
            f"{net(x) / x.length:.4f}",
            f"{reach(x.gait):.2f}",
        )
        for names, x in best.items()
    ]
    return style.table(heads, rows)


def net(best) -> float:
    """Return the net distance of a gait in a cycle, body lengths."""
    return float(np.hypot(*best.displacement[:2]))


def reach(gait) -> float:
    """Return the largest joint angle, rad."""
    return float(np.abs(gait.cycle(PHASES)[0]).max())


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.0, 3.3, len(numbers))
    for ax, (medium, found) in zip(axes[0], numbers.items()):
        plots.ccf_map(*found["ccf"], ax=ax)
        ax.set_title(medium)
        for objective, (colour, dashes) in OBJECTIVES.items():
            best = found[objective].best
            loop = best.gait.shape(np.linspace(0, 2 * np.pi, PHASES))
            label = f"{objective}: {net(best):.3f} BL, path {best.length:.2f}"
            ax.plot(*loop.T, color=colour, ls=dashes, lw=1.6, label=label)
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22))
    fig.suptitle("CCF in the minimum-perturbation frame", fontsize=9)
    return fig


if __name__ == "__main__":
    main("optimal_gaits", compute, draw, table)
