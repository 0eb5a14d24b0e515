"""Fig. 5(c): drag along and across a rod against its attack angle, in dry grains and in
a viscous fluid.

Forces are in units of the axial drag per length, 2 k rho g r |z|. Dots: drag on a rod
in a discrete-element bed of 6 mm grains (the sample short-rod-drag), with the granular
law that is fitted to it.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.studies.terradynamics.calibration import rod_fit
from rft import CATALOGUE, Viscous

LAWS = {  # law, colour, label
    "loose": (
        CATALOGUE["glass-0.3mm-loose"].medium,
        style.LOOSE,
        "loose 0.3 mm glass",
    ),
    "close": (
        CATALOGUE["glass-0.3mm-close"].medium,
        style.CLOSE,
        "close 0.3 mm glass",
    ),
    "viscous": (Viscous(2.0), style.FLUID, "viscous, 2 : 1"),
}


def compute(angles: int = 181) -> dict:
    """Return psi (N,) in rad, drag along and across (2, N) by each law, the forces in
    the bed and the law fitted to them."""
    psi = np.linspace(0.0, np.pi / 2, angles)
    numbers: dict = {"psi": psi}
    for name, (law, _, _) in LAWS.items():
        numbers[name] = np.array(law.traction(np.cos(psi), np.sin(psi)))
    fit = rod_fit("short-rod-drag")
    along, across = fit.data.forces
    numbers["bed"] = {"psi": fit.data.psi, "parallel": along, "perpendicular": across}
    numbers["fit"] = dict(zip(fit.names, fit.values.tolist()))
    numbers["fit"] |= {"axial_N": fit.axial_force, "rms_N": fit.rms}
    return numbers


@plots.styled
def draw(numbers: dict):
    """Draw drag across the rod solid and along it dashed."""
    fig, axes = plots.figure(6.0, 3.0)
    ax = axes[0, 0]
    psi = np.degrees(numbers["psi"])
    for name, (_, colour, label) in LAWS.items():
        along, across = numbers[name]
        ax.plot(psi, across, color=colour, label=label)
        ax.plot(psi, along, color=colour, ls="--")

    bed = numbers["bed"]
    psi = np.degrees(bed["psi"])
    along = bed["parallel"] / numbers["fit"]["axial_N"]
    across = bed["perpendicular"] / numbers["fit"]["axial_N"]
    dots = {"color": style.BLACK, "ms": 4, "ls": "none"}
    ax.plot(psi, across, "o", label="6 mm grains,\ndiscrete elements", **dots)
    ax.plot(psi, along, "o", mfc="white", **dots)
    ax.set(
        xlabel="attack angle $\\psi$ (degrees)",
        ylabel="drag / axial drag",
        xlim=(-2, 92),
        ylim=(0, None),
    )
    ax.set_xticks(range(0, 91, 15))
    style.draw_legend_right(ax, title="solid, filled: across\ndashed, open: along")
    return fig


if __name__ == "__main__":
    main("fig05c", compute, draw)
