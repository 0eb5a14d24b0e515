"""Fig. 12(b), (d) and (f): forward speed of Xplorer against time, its mean speed
against the curvature of its legs at 1 to 4 Hz, and that of SandBot against the air flow
through the grains at 2 to 8 rad/s.

The paper gives mass and length of the robots and no other size: those are assumed (the
built-in scenes say which), and so is the air speed of fluidisation. The trends are
claimed, not the numbers; `figures.robots.walking_sensitivity` shows what these hang on.
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


def compute(
    curvatures=CURVATURES, frequencies=FREQUENCIES, rates=RATES, air=AIR
) -> dict:
    """Return the walk of Xplorer as it is built in, and legs and flow as
    `geomech.studies.displacement.sweep.sweep` gives them."""
    xplorer = load("xplorer")
    sandbot = load("sandbot")
    over = {"robot.legs.relative_curvature": curvatures, "gait.frequency": frequencies}
    flows = {
        "effects.aeration.air_speed": air,
        "gait.frequency": (np.asarray(rates) / (2 * np.pi)).tolist(),
    }
    return {
        "walk": walking.run(xplorer),
        "legs": sweep(xplorer, over),
        "flow": sweep(sandbot, flows),
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(10.4, 3.1, 3)
    walk, (ax, legs, flow) = numbers["walk"].walk, axes[0]
    early = walk.t <= 3.0
    ax.plot(walk.t[early], walk.twist[early, 0], color=style.BLACK, lw=0.9)
    ax.axhline(walk.speed, color=style.VERMILION, ls="--", lw=1.0)
    ax.set(
        xlabel="$t$ (s)",
        ylabel="forward speed (m/s)",
        xlim=(0, 3),
        title="(b) Xplorer, 2 Hz; dashed: mean",
    )
    for ax, name, unit, scale in (
        (legs, "legs", "Hz", 1.0),
        (flow, "flow", "rad/s", 2 * np.pi),
    ):
        values, second = parameters(numbers[name]).values()
        curves(
            ax, list(values), numbers[name], [f"{scale * f:.3g} {unit}" for f in second]
        )
        style.zero_line(ax)
    legs.set(
        xlabel="leg curvature $R/r$", ylabel="mean speed (m/s)", title="(d) Xplorer"
    )
    flow.set(
        xlabel="air speed (m/s)",
        ylabel="mean speed (m/s)",
        title="(f) SandBot; open: stuck or sunk",
    )
    return fig


def table(numbers: dict) -> str:
    """Return mean speeds, m/s, and what became of those that do not walk."""
    tables = []
    for name, of in (("legs", "leg curvature"), ("flow", "air speed (m/s)")):
        values, frequencies = parameters(numbers[name]).values()
        status = numbers[name]["status"].values
        status = np.where(status == "walking", "", status)
        rows = [
            [
                f"at {f:.3g} Hz",
                *(f"{speed:.3f} {kind}".strip() for speed, kind in zip(speeds, kinds)),
            ]
            for f, speeds, kinds in zip(
                frequencies, numbers[name]["speed"].values.T, status.T
            )
        ]
        tables.append(style.table((of, *(f"{x:.3g}" for x in values)), rows))
    return "\n\n".join(tables)


if __name__ == "__main__":
    main("fig12", compute, draw, table)
