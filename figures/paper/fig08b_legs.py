"""Fig. 8(b): forces on a c-leg, a flat leg and a reversed c-leg that turn through loose
poppy seeds about a fixed hub.

All three have the projected length 2 R with R = 3.8 cm, and turn at 2 pi rad/s;
doubling that changes no force, in the text and here. Angle 0 is where a leg points
straight down, and positive angles come later. The forces are not symmetric about it: a
leg presses into the grains on its way down and is held back by them on its way up,
where they are weaker. What the curvature does to this shows in `asymmetry`, the odd
part of a force in the angle over its even part. The c-leg, its bulge ahead, meets the
grains first, feels most lift and is pushed up until it has all but left; the flat leg
and the reversed one are pulled down at the end, and the reversed one, its hollow ahead,
has its peaks after straight down.

The height of the hub (2 cm) and the width of the legs (2.5 cm) are not in the text:
assumed. The dotted lines are for hubs a centimetre lower and higher. Forces are in
proportion to the width. The measured curves are not in the text, either; of them it
says that the peaks for the c-leg are within 10 % of those of the theory.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load

LEGS = ("c-leg", "flat-leg", "reversed-c-leg")
HUBS = (-0.01, 0.0, 0.01)  # m, added to the scene's height


def compute(legs=LEGS, hubs=HUBS, samples: int = 541) -> dict:
    """Return {"legs", "own": row of the scene's own height among ``hubs``}.

    By leg: {"outline": (N, 2), m, "hub": its height, m, "angle": (T,), radians,
    "force": (H, T, 2), N, for hubs at the scene's height plus ``hubs``}. The angles are
    symmetric about 0.
    """
    found = {}
    for name in legs:
        scene = load(name)
        motion = replace(scene.motion, start=-np.pi, stop=np.pi, samples=samples)
        height = scene.motion.hub_height
        runs = [
            replace(scene, motion=replace(motion, hub_height=height + add)).run()
            for add in hubs
        ]
        found[name] = {
            "outline": scene.outline.points, "hub": height, "angle": runs[0].pose[:, 2],
            "force": np.stack([run.force for run in runs]),
        }  # fmt: skip
    return {"legs": found, "own": hubs.index(0.0)}


def asymmetry(angle, force) -> float:
    """Return the norm of the odd part of a force over that of its even part, at angles
    (T,) symmetric about 0."""
    even = (force + force[::-1]) / 2
    odd = (force - force[::-1]) / 2
    return float(np.sqrt(np.trapezoid(odd**2, angle) / np.trapezoid(even**2, angle)))


def peaks(numbers: dict, name: str) -> dict:
    """Return, at the scene's height, {"peak", "least": N, "at": degrees, "asymmetry"}
    by component "x", "z"."""
    leg = numbers["legs"][name]
    out = {}
    for k, axis in enumerate("xz"):
        force = leg["force"][numbers["own"], :, k]
        at = float(np.degrees(leg["angle"][force.argmax()]))
        out[axis] = {
            "peak": float(force.max()), "least": float(force.min()), "at": at, "asymmetry": asymmetry(leg["angle"], force),
        }  # fmt: skip
    return out


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
    rows = [
        (
            name,
            f"F_{axis}",
            f"{p['peak']:.2f}",
            f"{p['at']:.0f}",
            f"{p['least'] + 0.0:.2f}",
            f"{p['asymmetry']:.2f}",
        )
        for name in numbers["legs"]
        for axis, p in peaks(numbers, name).items()
    ]
    return style.table(heads, rows)


LOOKS = dict(zip(LEGS, ((style.BLUE, "o"), (style.BLACK, "s"), (style.VERMILION, "^"))))
LABELS = dict(zip(LEGS, ("c-leg", "flat leg", "reversed c-leg")))
DRAWN = (-75, -25, 25, 75)  # degrees


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.4, 5.2, 3, 2)
    for ax, (name, leg) in zip(axes[0], numbers["legs"].items()):
        draw_leg(ax, leg, *LOOKS[name])
        ax.set_title(LABELS[name])
    note = "light to dark: 75 degrees\nbefore to 75 after"
    axes[0, 0].text(-10.5, -9.2, note, va="bottom", **style.NOTE | {"fontsize": 7})
    for ax, k, label in (
        (axes[1, 0], 0, "$F_x$, forwards (N)"),
        (axes[1, 1], 1, "$F_z$, upwards (N)"),
    ):
        for name, leg in numbers["legs"].items():
            angle, (colour, marker) = np.degrees(leg["angle"]), LOOKS[name]
            ax.plot(angle, leg["force"][:, :, k].T, ":", color=colour, lw=0.8)
            reference = leg["force"][numbers["own"], :, k]
            ax.plot(
                angle,
                reference,
                color=colour,
                lw=1.4,
                marker=marker,
                ms=4,
                markevery=[reference.argmax()],
            )
        style.zero_line(ax)
        ax.axvline(0.0, **style.GUIDE)
        ax.set(
            xlabel=r"angle $\theta$ (degrees), 0: straight down",
            ylabel=label,
            xlim=(-135, 135),
        )
        ax.set_xticks(range(-90, 91, 45))
    draw_asymmetry(axes[1, 2], numbers)
    return fig


def draw_leg(ax, leg: dict, colour: str, marker: str) -> None:
    """Draw poses at a few angles, the first the lightest; the marker at the tip is that
    of the leg's peaks."""
    for strength, degrees in zip((0.25, 0.5, 0.75, 1.0), DRAWN):
        cos = np.cos(np.radians(degrees))
        sin = np.sin(np.radians(degrees))
        x, z = (leg["outline"] @ np.array([[cos, -sin], [sin, cos]])).T
        ax.plot(
            1e2 * x,
            1e2 * (z + leg["hub"]),
            color=colour,
            alpha=strength,
            lw=1.8,
            marker=marker,
            ms=5,
            markevery=[-1],
        )
    ax.plot(0.0, 1e2 * leg["hub"], "o", color="0.3", ms=4)
    ax.axhline(0.0, **style.SURFACE)
    ax.set(
        aspect="equal",
        xlabel="x (cm)",
        ylabel="z (cm)",
        xlim=(-11, 11),
        ylim=(-9.5, 5.5),
    )


def draw_asymmetry(ax, numbers: dict) -> None:
    for k, name in enumerate(numbers["legs"]):
        for axis, marker, right in (("x", "o", -0.1), ("z", "s", 0.1)):
            at = peaks(numbers, name)[axis]["asymmetry"]
            ax.plot(
                k + right,
                at,
                marker,
                ms=6,
                color=LOOKS[name][0],
                mfc="white" if axis == "x" else None,
            )
    style.entry(ax, "$F_x$", ls="", marker="o", ms=6, mfc="white")
    style.entry(ax, "$F_z$", ls="", marker="s", ms=6)
    ax.set(
        xticks=range(len(LEGS)),
        xticklabels=[LABELS[n].replace(" c", "\nc") for n in LEGS],
        ylim=(0, None),
    )
    ax.set(ylabel="odd / even part in the angle", xlim=(-0.5, len(LEGS) - 0.5))
    ax.legend(loc="upper right")


if __name__ == "__main__":
    main("fig08b", compute, draw, table)
