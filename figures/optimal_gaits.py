"""Optimal gaits of the three-link swimmer in a viscous fluid and in loose glass: for displacement, and for efficiency.

Sand's optima are larger and bring more. Two things differ. Drag in sand does not grow with speed: a link that creeps holds
as firmly as one that sweeps, so that wide strokes pay, in which one end sweeps while the rest is an anchor, and a fast
sweep costs no more work than a slow one. With drag like |v|^p and the fluid's ratio of drag across to drag along, 2, the
stroke for displacement reaches 1.9 rad and 0.10 BL at p = 1, and the limit of 2.5 rad and 0.23 BL at p = 0.3 and 0.37 BL at
p = 0; that for efficiency 1.44 rad, and the limit at both. And at small slip sand's drag across is 1 + C / tan gamma0 =
8.3 times that along. That alone adds to what a stroke brings and draws the loop in: a fluid of that ratio has 0.40 BL at 1.76
rad.

In the fluid the stroke for displacement follows the zero line of the CCF, and that for efficiency cuts the far ends off,
where little area is left for much path. In sand the CCF is that of a least-squares connection, which is not all.
"""

from __future__ import annotations

import numpy as np

from figures import main
from geomech.optimise import optimise
from geomech.output import plots
from geomech.output.plots.optimum import PHASES, along
from geomech.scene import load

SCENES = {"viscous fluid, ratio 2": "three-link-viscous", "loose 0.3 mm glass": "three-link-glass"}
AIMS = {"displacement": "black", "efficiency": "#009E73"}


def compute(harmonics: int = 5, **numerics) -> dict:
    """By medium: the optimum for each of AIMS, and "ccf", the CCF along the displacement on its grid."""
    out = {}
    for medium, name in SCENES.items():
        scene = load(name).with_numerics(**numerics)
        out[medium] = {aim: optimise(scene, aim, harmonics=harmonics) for aim in AIMS}
        out[medium]["ccf"] = along(out[medium]["displacement"])
    return out


def table(numbers: dict) -> str:
    """A line for each optimum."""
    lines = [f"{'':24s}{'aim':14s}{'BL a cycle':>11s}{'path length':>12s}{'BL a unit':>10s}{'reach (rad)':>12s}"]
    for medium, found in numbers.items():
        for aim in AIMS:
            best = found[aim].best
            net = float(np.hypot(*best.displacement[:2]))
            lines.append(
                f"{medium:24s}{aim:14s}{net:11.4f}{best.length:12.4f}{net / best.length:10.4f}{reach(best.gait):12.2f}"
            )
    return "\n".join(lines)


def reach(gait) -> float:
    """The largest joint angle, rad."""
    return float(np.abs(gait.cycle(PHASES)[0]).max())


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.0, 3.3, len(numbers))
    for ax, (medium, found) in zip(axes[0], numbers.items()):
        plots.ccf_map(found["ccf"], ax=ax)
        ax.set_title(medium)
        ax.collections[0].colorbar.set_label(rf"CCF ({found['ccf'].unit}/rad$^2$)")
        for aim, colour in AIMS.items():
            best = found[aim].best
            net = float(np.hypot(*best.displacement[:2]))
            ax.plot(
                *best.gait.shape(np.linspace(0, 2 * np.pi, PHASES)).T, color=colour, lw=1.6,
                label=f"{aim}: {net:.3f} BL, path {best.length:.2f}",
            )  # fmt: skip
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22))
    fig.suptitle("CCF along the displacement, minimum-perturbation frame", fontsize=9)
    return fig


if __name__ == "__main__":
    main("optimal_gaits", compute, draw, table)
