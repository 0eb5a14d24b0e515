"""Fig. 12(b), (d) and (f): forward speed of Xplorer against time, mean speed of Xplorer
against the curvature of its legs at 1 to 4 Hz, and mean speed of SandBot against the
flow of air through the grains at 2 to 8 rad/s.

The paper gives the mass and the length of the robots and no other size. The other sizes
are assumed (the built-in scenes say which), and so is the air speed of fluidisation.
Only the trends are claimed, not the numbers; `figures.robots.walking_sensitivity` shows
on which assumptions the numbers depend.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.plots import curves
from geomech.plots.displacement.sweeps import parameters
from geomech.scenes import load
from geomech.studies.displacement.sweep import sweep
from geomech.studies.terradynamics import walking

CURVATURES = np.linspace(-1.0, 1.0, 9).tolist()
FREQUENCIES = [1.0, 2.0, 3.0, 4.0]
RATES = np.array([2.0, 4.0, 6.0, 8.0])  # rad/s
AIR = np.linspace(0.0, 0.24, 9).tolist()  # m/s
SHOWN_TIME = 3.0  # s
PARAMETERS = {"legs": "leg curvature", "flow": "air speed (m/s)"}  # of the sweeps


def compute(
    curvatures=CURVATURES, frequencies=FREQUENCIES, rates=RATES, air=AIR
) -> dict:
    """Return "walk" of the built-in Xplorer, and the sweeps "legs" of Xplorer and
    "flow" of SandBot as `geomech.studies.displacement.sweep.sweep` gives them."""
    xplorer = load("xplorer")
    sandbot = load("sandbot")
    over_legs = {
        "robot.legs.relative_curvature": curvatures,
        "gait.frequency": frequencies,
    }
    over_flow = {
        "effects.aeration.air_speed": air,
        "gait.frequency": (np.asarray(rates) / (2 * np.pi)).tolist(),
    }
    return {
        "walk": walking.run(xplorer),
        "legs": sweep(xplorer, over_legs),
        "flow": sweep(sandbot, over_flow),
    }


@plots.styled
def draw(numbers: dict):
    """Draw the walk of Xplorer and the two sweeps."""
    fig, axes = plots.figure(10.4, 3.1, 3)
    walk_ax, legs_ax, flow_ax = axes[0]
    draw_walk(walk_ax, numbers["walk"].walk)
    draw_sweep(legs_ax, numbers["legs"], "Hz", 1.0)
    draw_sweep(flow_ax, numbers["flow"], "rad/s", 2 * np.pi)
    legs_ax.set(xlabel="leg curvature $R/r$", title="(d) Xplorer")
    flow_ax.set(xlabel="air speed (m/s)", title="(f) SandBot; open: stuck or sunk")
    return fig


def draw_walk(ax, walk) -> None:
    """Draw forward speed against time, and its mean dashed."""
    is_shown = walk.t <= SHOWN_TIME
    ax.plot(walk.t[is_shown], walk.twist[is_shown, 0], color=style.BLACK, lw=0.9)
    ax.axhline(walk.speed, color=style.VERMILION, ls="--", lw=1.0)
    ax.set(xlabel="$t$ (s)", ylabel="forward speed (m/s)", xlim=(0, SHOWN_TIME))
    ax.set_title("(b) Xplorer, 2 Hz; dashed: mean")


def draw_sweep(ax, result, unit: str, per_hertz: float) -> None:
    """Draw mean speed against the first parameter, with a curve for each frequency,
    which the legend gives in a unit of which a hertz has ``per_hertz``."""
    values, frequencies = parameters(result).values()
    names = [f"{per_hertz * f:.3g} {unit}" for f in frequencies]
    curves(ax, list(values), result, names)
    style.draw_zero_line(ax)
    ax.set_ylabel("mean speed (m/s)")


def table(numbers: dict) -> str:
    """Return mean speeds, m/s, and the status of the robots that do not walk."""
    tables = [speed_table(numbers[key], label) for key, label in PARAMETERS.items()]
    return "\n\n".join(tables)


def speed_table(result, label: str) -> str:
    """Return mean speeds by frequency (rows) and the first parameter (columns)."""
    values, frequencies = parameters(result).values()
    speeds = result["speed"].values
    statuses = result["status"].values
    rows = []
    for column, frequency in enumerate(frequencies):
        row = [f"at {frequency:.3g} Hz"]
        for speed, status in zip(speeds[:, column], statuses[:, column]):
            cell = f"{speed:.3f}"
            if status != "walking":
                cell += f" {status}"
            row.append(cell)
        rows.append(row)
    heads = [label, *(f"{x:.3g}" for x in values)]
    return style.table(heads, rows)


if __name__ == "__main__":
    main("fig12", compute, draw, table)
