"""Fig. 5(c): drag along and across a rod against its attack angle, in dry grains and in a viscous fluid.

Forces are in units of the axial drag 2 k rho g r |z| per length. Dots: drag on a rod in a discrete-element bed of 6 mm
grains (the sample short-rod-drag), with the granular law fitted to it.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.studies.calibration import rod_fit
from rft import CATALOGUE, Viscous


def compute(angles: int = 181) -> dict:
    """Return psi (N,) in rad, drag along and across (2, N) by each law, the bed's forces and the law fitted to them."""
    psi = np.linspace(0.0, np.pi / 2, angles)
    laws = {
        "loose": CATALOGUE["glass-0.3mm-loose"].medium,
        "close": CATALOGUE["glass-0.3mm-close"].medium,
        "viscous": Viscous(2.0),
    }
    curves = {
        name: np.array(law.traction(np.cos(psi), np.sin(psi)))
        for name, law in laws.items()
    }
    fit = rod_fit("short-rod-drag")
    bed = {
        "psi": fit.data.psi,
        "parallel": fit.data.forces[0],
        "perpendicular": fit.data.forces[1],
    }
    values = dict(zip(fit.names, fit.values.tolist()))
    return {
        "psi": psi,
        **curves,
        "bed": bed,
        "fit": {**values, "axial_N": fit.axial_force, "rms_N": fit.rms},
    }


@plots.styled
def draw(numbers: dict):
    """Draw drag across the rod solid and along it dashed."""
    fig, axes = plots.figure(6.0, 3.0)
    ax, degrees = axes[0, 0], np.degrees(numbers["psi"])
    curves = {
        "loose": (style.LOOSE, "loose 0.3 mm glass"),
        "close": (style.CLOSE, "close 0.3 mm glass"),
        "viscous": (style.FLUID, "viscous, 2 : 1"),
    }
    for name, (colour, label) in curves.items():
        along, across = numbers[name]
        ax.plot(degrees, across, color=colour, label=label)
        ax.plot(degrees, along, color=colour, ls="--")
    bed, fit = numbers["bed"], numbers["fit"]
    scale = fit["axial_N"]
    dots = {"color": style.BLACK, "ms": 4, "ls": "none"}
    ax.plot(
        np.degrees(bed["psi"]),
        bed["perpendicular"] / scale,
        "o",
        label="6 mm grains,\ndiscrete elements",
        **dots,
    )
    ax.plot(np.degrees(bed["psi"]), bed["parallel"] / scale, "o", mfc="white", **dots)
    ax.set(
        xlabel="attack angle $\\psi$ (degrees)",
        ylabel="drag / axial drag",
        xlim=(-2, 92),
        ylim=(0, None),
    )
    ax.set_xticks(range(0, 91, 15))
    style.legend_right(ax, title="solid, filled: across\ndashed, open: along")
    return fig


if __name__ == "__main__":
    main("fig05c", compute, draw)
