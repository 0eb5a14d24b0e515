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

from figures import main, style
from geomech import plots
from rft.terradynamics.plates import VERTICAL, Plate, loads

LENGTH, WIDTH = 0.038, 0.025  # m, assumed
DEEPEST = 0.08  # m, assumed
ANGLES = (
    (0, 90),
    (30, 90),
    (60, 30),
    (90, 0),
    (0, -90),
)  # (beta, gamma) in degrees, assumed


def compute(
    medium: str = "poppy-seeds-loose", angles=ANGLES, depths: int = 161
) -> dict:
    """Return stresses on each plate against depth.

    "depth": (D,) of its middle, m. "plates": by (beta, gamma) in degrees {"sigma_x", "sigma_z": (D,), Pa, against the motion's
    x and upwards, "alpha": (2,) slopes of both once the plate is under, N/cm^3}. "under": m, where all are.
    """
    depth, stress = np.linspace(0.0, DEEPEST, depths), VERTICAL[medium].stress
    under, plates = depth > LENGTH / 2, {}
    for beta, gamma in angles:
        plate = Plate(LENGTH, WIDTH, np.radians(beta)).outline(40)
        pose = np.stack([0 * depth, -depth, 0 * depth], -1)
        velocity = np.cos(np.radians(gamma)), -np.sin(np.radians(gamma)), 0.0
        force = loads(stress, plate, pose, velocity).force / (LENGTH * WIDTH)
        slopes = np.polyfit(depth[under], force[under] * [-1, 1], 1)[0] / 1e6
        plates[beta, gamma] = {
            "sigma_x": -force[:, 0],
            "sigma_z": force[:, 1],
            "alpha": slopes,
        }
    return {"depth": depth, "plates": plates, "under": LENGTH / 2, "medium": medium}


def table(numbers: dict) -> str:
    """Return the slopes of the straight lines."""
    heads = "beta (degrees)", "gamma (degrees)", "alpha_x (N/cm^3)", "alpha_z (N/cm^3)"
    slopes = {
        angles: plate["alpha"].round(9) + 0.0
        for angles, plate in numbers["plates"].items()
    }
    rows = [
        (f"{beta}", f"{gamma}", f"{x:.4f}", f"{z:.4f}")
        for (beta, gamma), (x, z) in slopes.items()
    ]
    return f"{numbers['medium']}\n{style.table(heads, rows)}"


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.0, 3.3, 2)
    depth = 1e2 * numbers["depth"]
    for ax, name, stress in zip(axes[0], "xz", ("drag stress", "lift stress")):
        ax.axvspan(1e2 * numbers["under"], depth[-1], **style.SHADED)
        for k, ((beta, gamma), plate) in enumerate(numbers["plates"].items()):
            label = rf"$\beta$ = {beta}, $\gamma$ = ${gamma}$" + (
                ", on the way up" if gamma < 0 else ""
            )
            look = style.sparse(k, len(depth)) | {
                "ls": "--" if gamma < 0 else "-",
                "label": label,
            }
            ax.plot(depth, 1e-3 * plate[f"sigma_{name}"], **look)
        style.zero_line(ax)
        ax.set(
            xlabel="depth |z| of the plate's middle (cm)",
            ylabel=rf"{stress} $\sigma_{name}$ (kPa)",
        )
        ax.set(xlim=(0, depth[-1]))
    axes[0, 0].text(
        1e2 * numbers["under"] + 0.1,
        axes[0, 0].get_ylim()[1],
        "all plates under",
        va="top",
        **style.NOTE,
    )
    style.legend_right(axes[0, 1], title="tilt, direction (degrees)")
    return fig


if __name__ == "__main__":
    main("fig06b", compute, draw, table)
