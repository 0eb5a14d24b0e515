"""Fig. 8(b): forces on a c-leg, a flat leg and a reversed c-leg that turn through loose poppy seeds about a fixed hub.

All three have the projected length 2 R with R = 3.8 cm, and turn at 2 pi rad/s; doubling that changes no force, in the text
and here. Angle 0 is where a leg points straight down, and positive angles come later. The forces are not symmetric about it:
a leg presses into the grains on its way down and is held back by them on its way up, where they are weaker. What the
curvature does to this is told by `asymmetry`, the odd part of a force in the angle over its even part. The c-leg, its bulge
ahead, meets the grains first, feels most lift and is pushed up until it has all but left; the flat leg and the reversed one
are pulled down at the end, and the reversed one, its hollow ahead, has its peaks after straight down.

The height of the hub (2 cm) and the width of the legs (2.5 cm) are not in the text: assumed. The dotted lines are for hubs a
centimetre lower and higher. Forces are in proportion to the width. The measured curves are not in the text, either; of them
it says that the peaks for the c-leg are within 10 % of those of the theory.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from figures import main
from geomech.output import plots
from geomech.scene import load

LEGS = ("c-leg", "flat-leg", "reversed-c-leg")
HUBS = (-0.01, 0.0, 0.01)  # m, added to the scene's height


def compute(legs=LEGS, hubs=HUBS, samples: int = 541) -> dict:
    """By leg: {"outline": (N, 2), m, "hub": its height, m, "angle": (T,), radians, "force": (H, T, 2), N, for hubs at the
    scene's height plus ``hubs``}. The angles are alike on both sides of 0."""
    found = {}
    for name in legs:
        scene = load(name)
        motion = replace(scene.motion, start=-np.pi, stop=np.pi, samples=samples)
        height = scene.motion.hub_height
        runs = [replace(scene, motion=replace(motion, hub_height=height + add)).run() for add in hubs]
        found[name] = {
            "outline": scene.outline.points, "hub": height, "angle": runs[0].pose[:, 2],
            "force": np.stack([run.force for run in runs]),
        }  # fmt: skip
    return {"legs": found, "own": hubs.index(0.0)}


def asymmetry(angle, force) -> float:
    """Norm of the part of a force that is odd in the angle over that of the even one; angles alike on both sides of 0."""
    even, odd = (force + force[::-1]) / 2, (force - force[::-1]) / 2
    return float(np.sqrt(np.trapezoid(odd**2, angle) / np.trapezoid(even**2, angle)))


def peaks(numbers: dict, name: str) -> dict:
    """Of the hub at the scene's height, by component "x", "z": {"peak", "least": N, "at": degrees, "asymmetry"}."""
    leg, out = numbers["legs"][name], {}
    for k, axis in enumerate("xz"):
        force = leg["force"][numbers["own"], :, k]
        at = float(np.degrees(leg["angle"][force.argmax()]))
        out[axis] = {
            "peak": float(force.max()), "least": float(force.min()), "at": at, "asymmetry": asymmetry(leg["angle"], force),
        }  # fmt: skip
    return out


def table(numbers: dict) -> str:
    """Peaks, where they are, and asymmetry."""
    lines = ["leg              force   peak (N)   at (degrees)   least (N)   odd / even in the angle"]
    for name in numbers["legs"]:
        for axis, p in peaks(numbers, name).items():
            lines.append(
                f"{name:17}F_{axis}{p['peak']:12.2f}{p['at']:12.0f}{p['least'] + 0.0:14.2f}{p['asymmetry']:16.2f}"
            )
    return "\n".join(lines)


COLOURS = dict(zip(LEGS, ("#0072B2", "black", "#D55E00")))
LABELS = dict(zip(LEGS, ("c-leg", "flat leg", "reversed c-leg")))
DRAWN = (-75, -25, 25, 75)  # degrees


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.4, 5.2, 3, 2)
    for ax, (name, leg) in zip(axes[0], numbers["legs"].items()):
        draw_leg(ax, leg, COLOURS[name])
        ax.set_title(LABELS[name])
    axes[0, 0].text(-10.5, -9.2, "light to dark: 75 degrees\nbefore to 75 after", fontsize=7, va="bottom", color="0.3")
    for ax, k, said in ((axes[1, 0], 0, "$F_x$, forwards (N)"), (axes[1, 1], 1, "$F_z$, upwards (N)")):
        for name, leg in numbers["legs"].items():
            angle = np.degrees(leg["angle"])
            for row, force in enumerate(leg["force"]):
                own = row == numbers["own"]
                ax.plot(angle, force[:, k], "-" if own else ":", color=COLOURS[name], lw=1.4 if own else 0.8)
        ax.axhline(0.0, color="0.6", lw=0.6)
        ax.axvline(0.0, color="0.8", lw=0.6, zorder=0)
        ax.set(xlabel=r"angle $\theta$ (degrees), 0: straight down", ylabel=said, xlim=(-135, 135))
        ax.set_xticks(range(-90, 91, 45))
    draw_asymmetry(axes[1, 2], numbers)
    return fig


def draw_leg(ax, leg: dict, colour: str) -> None:
    """Poses at a few angles, the first the lightest."""
    for strength, degrees in zip((0.25, 0.5, 0.75, 1.0), DRAWN):
        cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        x, z = (leg["outline"] @ np.array([[cos, -sin], [sin, cos]])).T
        ax.plot(1e2 * x, 1e2 * (z + leg["hub"]), color=colour, alpha=strength, lw=1.8)
    ax.plot(0.0, 1e2 * leg["hub"], "o", color="0.3", ms=4)
    ax.axhline(0.0, color="peru", lw=1.0, zorder=0)
    ax.set(aspect="equal", xlabel="x (cm)", ylabel="z (cm)", xlim=(-11, 11), ylim=(-9.5, 5.5))


def draw_asymmetry(ax, numbers: dict) -> None:
    for k, name in enumerate(numbers["legs"]):
        for axis, marker, right in (("x", "o", -0.1), ("z", "s", 0.1)):
            at = peaks(numbers, name)[axis]["asymmetry"]
            ax.plot(k + right, at, marker, ms=6, color=COLOURS[name], mfc="white" if axis == "x" else None)
    ax.plot([], [], "o", ms=6, mfc="white", color="0.3", label="$F_x$")
    ax.plot([], [], "s", ms=6, color="0.3", label="$F_z$")
    ax.set(xticks=range(len(LEGS)), xticklabels=[LABELS[n].replace(" c", "\nc") for n in LEGS], ylim=(0, None))
    ax.set(ylabel="odd / even part in the angle", xlim=(-0.5, len(LEGS) - 0.5))
    ax.legend(loc="upper right")


if __name__ == "__main__":
    main("fig08b", compute, draw, table)
