"""Fig. 8(b): forces on a c-leg, a flat leg and a reversed c-leg that rotate through
loose poppy seeds about a fixed hub.

All three legs have the projected length 2 R with R = 3.8 cm and rotate at 2 pi rad/s;
doubling the rate changes no force, in the text and here. At angle 0 a leg points
straight down, and positive angles come later. The forces are not symmetric about angle
0: a leg presses into the grains on its way down, and on its way up the grains, which
are weaker there, hold it back. `asymmetry` measures the effect of the curvature of the
leg on this: the odd part of a force in the angle over its even part. The c-leg, whose
bulge leads, meets the grains first, feels the most lift and is pushed up until it has
almost left the grains. The flat leg and the reversed leg are pulled down at the end.
The reversed leg, whose hollow leads, has its peaks after it has passed straight down.

The height of the hub (2 cm) and the width of the legs (2.5 cm) are not in the text and
are assumed. The dotted lines are for hubs one centimetre lower and higher. Forces are
proportional to the width. The measured curves are not in the text either; it says that
the peaks for the c-leg are within 10 % of the theory.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.integrate import trapezoid

from figures import main, style
from geomech import plots
from geomech.scenes import load

LEGS = ("c-leg", "flat-leg", "reversed-c-leg")
LABELS = {"c-leg": "c-leg", "flat-leg": "flat leg", "reversed-c-leg": "reversed c-leg"}
LOOKS = {  # colour and marker
    "c-leg": (style.BLUE, "o"),
    "flat-leg": (style.BLACK, "s"),
    "reversed-c-leg": (style.VERMILION, "^"),
}
HUBS = (-0.01, 0.0, 0.01)  # m, added to the scene's height
DRAWN_ANGLES = {-75: 0.25, -25: 0.5, 25: 0.75, 75: 1.0}  # degrees: opacity


def compute(legs=LEGS, hubs=HUBS, samples: int = 541) -> dict:
    """Return {"legs", "own": row of the scene's own height among ``hubs``}.

    By leg: {"outline": (N, 2), m, "hub": its height, m, "angle": (T,), radians,
    "force": (H, T, 2), N, for hubs at the scene's height plus ``hubs``}. The angles are
    symmetric about 0.
    """
    forces_by_leg = {}
    for name in legs:
        scene = load(name)
        turn = replace(scene.motion, start=-np.pi, stop=np.pi, samples=samples)
        height = scene.motion.hub_height
        runs = []
        for added in hubs:
            motion = replace(turn, hub_height=height + added)
            runs.append(replace(scene, motion=motion).run())
        forces_by_leg[name] = {
            "outline": scene.outline.points,
            "hub": height,
            "angle": runs[0].pose[:, 2],
            "force": np.stack([run.force for run in runs]),
        }
    return {"legs": forces_by_leg, "own": hubs.index(0.0)}


def asymmetry(angle, force) -> float:
    """Return the norm of the odd part of a force over that of its even part, at angles
    (T,) symmetric about 0."""
    even = (force + force[::-1]) / 2
    odd = (force - force[::-1]) / 2
    return float(np.sqrt(trapezoid(odd**2, angle) / trapezoid(even**2, angle)))


def peaks(numbers: dict, name: str) -> dict:
    """Return, at the scene's height, {"peak", "least": N, "peak_angle": degrees,
    "asymmetry"} by component "x", "z"."""
    leg = numbers["legs"][name]
    angle = leg["angle"]
    by_component = {}
    for k, axis in enumerate("xz"):
        force = leg["force"][numbers["own"], :, k]
        by_component[axis] = {
            "peak": float(force.max()),
            "least": float(force.min()),
            "peak_angle": float(np.degrees(angle[force.argmax()])),
            "asymmetry": asymmetry(angle, force),
        }
    return by_component


def table(numbers: dict) -> str:
    """Return peaks, the angles at which they are, and asymmetry."""
    heads = (
        "leg",
        "force",
        "peak (N)",
        "at (degrees)",
        "least (N)",
        "odd / even in the angle",
    )
    rows = []
    for name in numbers["legs"]:
        for axis, force in peaks(numbers, name).items():
            least = force["least"] + 0.0  # without negative zero
            row = (
                name,
                f"F_{axis}",
                f"{force['peak']:.2f}",
                f"{force['peak_angle']:.0f}",
                f"{least:.2f}",
                f"{force['asymmetry']:.2f}",
            )
            rows.append(row)
    return style.table(heads, rows)


@plots.styled
def draw(numbers: dict):
    """Draw the legs above, and forces and asymmetry below."""
    fig, axes = plots.figure(8.4, 5.2, 3, 2)
    for ax, (name, leg) in zip(axes[0], numbers["legs"].items()):
        draw_leg(ax, leg, *LOOKS[name])
        ax.set_title(LABELS[name])
    note = "light to dark: 75 degrees\nbefore to 75 after"
    axes[0, 0].text(-10.5, -9.2, note, va="bottom", **style.NOTE | {"fontsize": 7})
    draw_force(axes[1, 0], numbers, 0, "$F_x$, forwards (N)")
    draw_force(axes[1, 1], numbers, 1, "$F_z$, upwards (N)")
    draw_asymmetry(axes[1, 2], numbers)
    return fig


def draw_leg(ax, leg: dict, colour: str, marker: str) -> None:
    """Draw poses at a few angles, the first the lightest; the marker at the tip is that
    of the leg's peaks."""
    look = {"color": colour, "lw": 1.8, "marker": marker, "ms": 5, "markevery": [-1]}
    for degrees, opacity in DRAWN_ANGLES.items():
        cos = np.cos(np.radians(degrees))
        sin = np.sin(np.radians(degrees))
        x, z = (leg["outline"] @ np.array([[cos, -sin], [sin, cos]])).T
        ax.plot(1e2 * x, 1e2 * (z + leg["hub"]), alpha=opacity, **look)
    ax.plot(0.0, 1e2 * leg["hub"], "o", color="0.3", ms=4)
    ax.axhline(0.0, **style.SURFACE)
    ax.set(aspect="equal", xlabel="x (cm)", ylabel="z (cm)")
    ax.set(xlim=(-11, 11), ylim=(-9.5, 5.5))


def draw_force(ax, numbers: dict, component: int, label: str) -> None:
    """Draw a component of the force against the angle: solid at the scene's height of
    the hub with a marker at the peak, dotted at all heights."""
    for name, leg in numbers["legs"].items():
        colour, marker = LOOKS[name]
        angle = np.degrees(leg["angle"])
        force = leg["force"][:, :, component]
        ax.plot(angle, force.T, ":", color=colour, lw=0.8)
        own = force[numbers["own"]]
        dot = {"marker": marker, "ms": 4, "markevery": [own.argmax()]}
        ax.plot(angle, own, color=colour, lw=1.4, **dot)
    style.draw_zero_line(ax)
    ax.axvline(0.0, **style.GUIDE)
    ax.set(xlabel=r"angle $\theta$ (degrees), 0: straight down", ylabel=label)
    ax.set(xlim=(-135, 135))
    ax.set_xticks(range(-90, 91, 45))


def draw_asymmetry(ax, numbers: dict) -> None:
    """Draw the asymmetry of both components for each leg."""
    for k, name in enumerate(numbers["legs"]):
        forces = peaks(numbers, name)
        dot = {"color": LOOKS[name][0], "ms": 6}
        ax.plot(k - 0.1, forces["x"]["asymmetry"], "o", mfc="white", **dot)
        ax.plot(k + 0.1, forces["z"]["asymmetry"], "s", **dot)
    style.add_entry(ax, "$F_x$", ls="", marker="o", ms=6, mfc="white")
    style.add_entry(ax, "$F_z$", ls="", marker="s", ms=6)
    ax.set(
        xticks=range(len(LEGS)),
        xticklabels=[LABELS[name].replace(" c", "\nc") for name in LEGS],
        ylabel="odd / even part in the angle",
        xlim=(-0.5, len(LEGS) - 0.5),
        ylim=(0, None),
    )
    ax.legend(loc="upper right")


if __name__ == "__main__":
    main("fig08b", compute, draw, table)
