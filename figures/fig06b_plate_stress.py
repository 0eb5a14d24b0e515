"""Fig. 6(b): drag and lift stress on a plate against its depth, for some tilts and directions of motion.

Force over the area of the plate, sigma = F / A, against the depth of its middle. As long as the plate crosses the surface
the stress rises with the square of how far it is in; once it is under (shaded for all tilts) it is |z| alpha(beta, gamma),
a straight line through the origin, as Sec. II B says of all media, tilts and directions. On the way up (gamma < 0) a level
plate is held down, in the generic map by a quarter of what resists it on the way down.

The size of the plate, the medium, the angles and the greatest depth of the published panel are not in the text: assumed. The
bottom of the bed, where the measured stress leaves the line, is not modelled.
"""

from __future__ import annotations

import numpy as np

from figures import main
from geomech.output import plots
from rft.vertical import VERTICAL, Plate, loads

LENGTH, WIDTH = 0.038, 0.025  # m, assumed
DEEPEST = 0.08  # m, assumed
ANGLES = ((0, 90), (30, 90), (60, 30), (90, 0), (0, -90))  # (beta, gamma) in degrees, assumed


def compute(medium: str = "poppy-seeds-loose", angles=ANGLES, depths: int = 161) -> dict:
    """Of each plate: "depth": (D,) of its middle, m. "plates": by (beta, gamma) in degrees {"sigma_x", "sigma_z": (D,), Pa,
    against the motion's x and upwards, "alpha": (2,) slopes of both once the plate is under, N/cm^3}. "under": m, where all
    are."""
    depth, stress = np.linspace(0.0, DEEPEST, depths), VERTICAL[medium].stress
    under, plates = depth > LENGTH / 2, {}
    for beta, gamma in angles:
        plate = Plate(LENGTH, WIDTH, np.radians(beta)).outline(40)
        pose = np.stack([0 * depth, -depth, 0 * depth], -1)
        way = np.cos(np.radians(gamma)), -np.sin(np.radians(gamma)), 0.0
        force = loads(stress, plate, pose, way).force / (LENGTH * WIDTH)
        slopes = np.polyfit(depth[under], force[under] * [-1, 1], 1)[0] / 1e6
        plates[beta, gamma] = {"sigma_x": -force[:, 0], "sigma_z": force[:, 1], "alpha": slopes}
    return {"depth": depth, "plates": plates, "under": LENGTH / 2, "medium": medium}


def table(numbers: dict) -> str:
    """Slopes of the straight lines."""
    lines = [numbers["medium"], "  beta  gamma   alpha_x   alpha_z  (degrees, N/cm^3)"]
    for (beta, gamma), found in numbers["plates"].items():
        lines.append("{:6}{:7}{:10.4f}{:10.4f}".format(beta, gamma, *(found["alpha"].round(9) + 0.0)))
    return "\n".join(lines)


COLOURS = ("black", "#0072B2", "#009E73", "#D55E00", "#CC79A7")


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.0, 3.3, 2)
    for ax, name, said in zip(axes[0], "xz", ("drag stress", "lift stress")):
        ax.axvspan(1e2 * numbers["under"], 1e2 * DEEPEST, color="0.93", lw=0)
        for colour, ((beta, gamma), found) in zip(COLOURS, numbers["plates"].items()):
            label = rf"$\beta$ = {beta}, $\gamma$ = ${gamma}$" + (", on the way up" if gamma < 0 else "")
            dashes = "--" if gamma < 0 else "-"
            ax.plot(1e2 * numbers["depth"], 1e-3 * found[f"sigma_{name}"], dashes, color=colour, label=label)
        ax.axhline(0.0, color="0.6", lw=0.6)
        ax.set(xlabel="depth |z| of the plate's middle (cm)", ylabel=rf"{said} $\sigma_{name}$ (kPa)")
        ax.set(xlim=(0, 1e2 * DEEPEST))
    axes[0, 0].text(1e2 * numbers["under"] + 0.1, axes[0, 0].get_ylim()[1], "all plates under", va="top", fontsize=8)
    axes[0, 1].legend(title="tilt, direction (degrees)", loc="center left", bbox_to_anchor=(1.0, 0.5))
    return fig


if __name__ == "__main__":
    main("fig06b", compute, draw, table)
