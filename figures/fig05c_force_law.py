"""Fig. 5(c): drag along and across a rod against its attack angle, in dry grains and in a viscous fluid.

Forces are in units of the axial drag 2 k rho g r |z| per length. Dots: drag on a rod in a discrete-element bed of 6 mm
grains (figures/data/dem_rod_drag.csv), with the granular law fitted to it.
"""

from __future__ import annotations

from importlib import resources

import numpy as np

from figures import main
from geomech.output import plots
from rft import CATALOGUE, Granular, Viscous

GRAINS = {"depth_m": 0.030, "radius_m": 0.008, "length_m": 0.080, "bulk_density": 0.588 * 1030.0}  # header of the CSV
GRAVITY = 9.81


def compute(angles: int = 181) -> dict:
    """psi (N,) in rad; for each law (f_parallel, f_perpendicular), (2, N); the bed's forces and the law fitted to them."""
    psi = np.linspace(0.0, np.pi / 2, angles)
    laws = {
        "loose": CATALOGUE["glass-0.3mm-loose"].medium,
        "close": CATALOGUE["glass-0.3mm-close"].medium,
        "viscous": Viscous(2.0),
    }
    curves = {name: np.array(law.traction(np.cos(psi), np.sin(psi))) for name, law in laws.items()}
    bed = rod_drag()
    return {"psi": psi, **curves, "bed": bed, "fit": fit_granular(bed["psi"], bed["parallel"], bed["perpendicular"])}


def rod_drag() -> dict:
    """The bed's attack angles (rad) and forces on the whole rod (N)."""
    text = (resources.files("figures") / "data" / "dem_rod_drag.csv").read_text()
    rows = [line.split(",") for line in text.splitlines() if line[0].isdigit()]
    psi, parallel, perpendicular, _ = np.array(rows, float).T
    return {"psi": np.radians(psi), "parallel": parallel, "perpendicular": perpendicular}


def fit_granular(psi, parallel, perpendicular) -> dict:
    """C, gamma0 (rad), k and the rms residual (N) of Eqs. 2-3, least squares on both force components of a rod."""
    from scipy.optimize import least_squares

    unit = 2 * GRAVITY * GRAINS["bulk_density"] * GRAINS["radius_m"] * GRAINS["depth_m"] * GRAINS["length_m"]

    def misfit(p):
        f_t, f_n = Granular(C=p[0], gamma0=p[1]).traction(np.cos(psi), np.sin(psi))
        return np.concatenate([p[2] * unit * f_t - parallel, p[2] * unit * f_n - perpendicular])

    best = least_squares(misfit, (1.8, 0.24, 2.5), bounds=((0, 0.01, 0), (100, 1.5, 100)))
    C, gamma0, k = (float(x) for x in best.x)
    return {"C": C, "gamma0": gamma0, "k": k, "unit_N": unit, "rms_N": float(np.sqrt(np.mean(best.fun**2)))}


@plots.styled
def draw(numbers: dict):
    """Solid: across the rod, dashed: along it."""
    fig, axes = plots.figure(6.0, 3.0)
    ax, degrees = axes[0, 0], np.degrees(numbers["psi"])
    styles = {
        "loose": ("#D55E00", "loose 0.3 mm glass"),
        "close": ("#0072B2", "close 0.3 mm glass"),
        "viscous": ("0.5", "viscous, 2 : 1"),
    }
    for name, (colour, label) in styles.items():
        along, across = numbers[name]
        ax.plot(degrees, across, color=colour, label=label)
        ax.plot(degrees, along, color=colour, ls="--")
    bed, fit = numbers["bed"], numbers["fit"]
    scale = fit["k"] * fit["unit_N"]
    style = {"color": "black", "ms": 4, "ls": "none"}
    ax.plot(np.degrees(bed["psi"]), bed["perpendicular"] / scale, "o", label="6 mm grains,\ndiscrete elements", **style)
    ax.plot(np.degrees(bed["psi"]), bed["parallel"] / scale, "o", mfc="white", **style)
    ax.set(xlabel="attack angle $\\psi$ (degrees)", ylabel="drag / axial drag", xlim=(-2, 92), ylim=(0, None))
    ax.set_xticks(range(0, 91, 15))
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="solid, filled: across\ndashed, open: along")
    return fig


if __name__ == "__main__":
    main("fig05c", compute, draw)
