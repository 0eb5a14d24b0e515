"""Fig. 6(b): drag and lift stress on a plate against its depth, for several tilts and
directions of motion.

The stress is the force over the area of the plate, sigma = F / A, against the depth of
its middle. While the plate crosses the surface, the stress grows with the square of the
submerged length. Once the plate is below the surface (shaded for all tilts), the stress
is |z| alpha(beta, gamma), a straight line through the origin, as Sec. II B states for
all media, tilts and directions. On the way up (gamma < 0) the grains hold a level plate
down; in the generic map their resistance is then a quarter of the resistance on the
way down.

The size of the plate, the medium, the angles and the greatest depth of the published
panel are not in the text and are assumed. The bottom of the bed, where the measured
stress leaves the line, is not modelled.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from rft.terradynamics.plates import VERTICAL, Plate, loads

LENGTH = 0.038  # m, assumed
WIDTH = 0.025  # m, assumed
DEEPEST = 0.08  # m, assumed
# (beta, gamma) in degrees, assumed.
ANGLES = ((0, 90), (30, 90), (60, 30), (90, 0), (0, -90))


def compute(
    medium: str = "poppy-seeds-loose", angles=ANGLES, depths: int = 161
) -> dict:
    """Return stresses on each plate against depth.

    "depth": (D,) of its middle, m. "plates": by (beta, gamma) in degrees {"sigma_x",
    "sigma_z": (D,), Pa, against the motion and upwards, "alpha": (2,) slopes of both
    once the plate is under, N/cm^3}. "under": depth at which all plates are under, m.
    """
    depth = np.linspace(0.0, DEEPEST, depths)
    pose = np.stack([0 * depth, -depth, 0 * depth], -1)
    is_under = depth > LENGTH / 2
    plates = {}
    for beta, gamma in angles:
        plate = Plate(LENGTH, WIDTH, np.radians(beta)).outline(40)
        velocity = (np.cos(np.radians(gamma)), -np.sin(np.radians(gamma)), 0.0)
        force = loads(VERTICAL[medium].stress, plate, pose, velocity).force
        stress = force / (LENGTH * WIDTH) * [-1, 1]
        slopes = np.polyfit(depth[is_under], stress[is_under], 1)[0] / 1e6
        plates[beta, gamma] = {
            "sigma_x": stress[:, 0],
            "sigma_z": stress[:, 1],
            "alpha": slopes,
        }
    return {"depth": depth, "plates": plates, "under": LENGTH / 2, "medium": medium}


def table(numbers: dict) -> str:
    """Return the slopes of the straight lines."""
    heads = (
        "beta (degrees)",
        "gamma (degrees)",
        "alpha_x (N/cm^3)",
        "alpha_z (N/cm^3)",
    )
    rows = []
    for (beta, gamma), plate in numbers["plates"].items():
        x, z = plate["alpha"].round(9) + 0.0  # without negative zeros
        rows.append((f"{beta}", f"{gamma}", f"{x:.4f}", f"{z:.4f}"))
    return f"{numbers['medium']}\n{style.table(heads, rows)}"


@plots.styled
def draw(numbers: dict):
    """Draw drag at the left and lift at the right, dashed on the way up."""
    fig, axes = plots.figure(8.0, 3.3, 2)
    depth = 1e2 * numbers["depth"]
    for ax, name, stress in zip(axes[0], "xz", ("drag stress", "lift stress")):
        ax.axvspan(1e2 * numbers["under"], depth[-1], **style.SHADED)
        for k, ((beta, gamma), plate) in enumerate(numbers["plates"].items()):
            label = rf"$\beta$ = {beta}, $\gamma$ = ${gamma}$"
            dashes = "-"
            if gamma < 0:
                label += ", on the way up"
                dashes = "--"
            look = style.curve_look(k, len(depth))
            sigma = 1e-3 * plate[f"sigma_{name}"]
            ax.plot(depth, sigma, ls=dashes, label=label, **look)
        style.draw_zero_line(ax)
        ax.set(
            xlabel="depth |z| of the plate's middle (cm)",
            ylabel=rf"{stress} $\sigma_{name}$ (kPa)",
        )
        ax.set(xlim=(0, depth[-1]))
    left = axes[0, 0]
    x = 1e2 * numbers["under"] + 0.1
    left.text(x, left.get_ylim()[1], "all plates under", va="top", **style.NOTE)
    style.draw_legend_right(axes[0, 1], title="tilt, direction (degrees)")
    return fig


if __name__ == "__main__":
    main("fig06b", compute, draw, table)
