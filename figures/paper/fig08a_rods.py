"""Fig. 8(a): stress around a dragged cylinder as predicted by plates, and drag and lift
on rods of four shapes against depth.

(a) Resistive force theory assumes that the stress on a part of a rod equals the stress
on a plate of the same tilt at the same depth; the text of the paper says that the two
are nearly equal in discrete-element simulation. The line is the map for plates, and the
dots are the elements of a cylinder that moves level. Normal stress is positive where
the grains push, and tangential stress is positive from the bottom of the cylinder to
its top. Tilts run from 0 (the underside) through 90 degrees (the front) to 180 (the
top). The published angle also runs from 0 to pi; that it starts at the underside is
assumed. Its data are not in the text.

(b), (c) Drag and lift against the depth of the axis of the rod. (d) Lift over drag deep
below the surface, next to the sign that was measured (Ding, Gravish and Goldman, Phys.
Rev. Lett. 106, 028001 (2011)): up on round and square rods, down on a half cylinder
that lies on its flat side. The nine-term map gives upward lift on all of them: it pulls
on faces that look up by more than 53 degrees, and this pull lifts. Without tension
(dashed, open) the lift of the half cylinder falls to 0.04 of its drag, which still does
not have the measured sign. For that sign the grains would have to press down on faces
that look up, as they did on plates in that work. Undersides that slide along themselves
carry no load here; they could only add lift.

The sizes of the rods and the depths are assumed. The medium is 3 mm glass, as in the
text.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from figures import main, style
from geomech import plots
from rft.terradynamics.plates import (
    VERTICAL,
    HalfCylinder,
    RoundRod,
    SquareRod,
    loads,
    parts,
)

# m, assumed
RADIUS = 0.0127
WIDTH = 0.1
RODS = {
    "round": RoundRod(RADIUS, WIDTH),
    "half, flat down": HalfCylinder(RADIUS, WIDTH, "down"),
    "half, flat up": HalfCylinder(RADIUS, WIDTH, "up"),
    "square": SquareRod(2 * RADIUS, WIDTH),
}
# The sign of the measured lift, upwards; 0: not known.
MEASURED_SIGNS = {"round": 1, "half, flat down": -1, "half, flat up": 0, "square": 1}
SIGN_NAMES = {1: "up", -1: "down", 0: "not known"}
DEEPEST = 0.15  # m
DEEP = 100.0  # m, so deep that all of a rod has the same depth
LEVEL = (1.0, 0.0, 0.0)  # direction of motion
TENSIONS = ("keep", "cut")  # of the map where it pulls


def compute(medium: str = "glass-3mm", elements: int = 400, depths: int = 61) -> dict:
    """Return stresses around a cylinder, and drag and lift on the rods against depth.

    "beta": (B,) radians. "normal", "tangent": (B,) by plates, N/cm^3. "cylinder":
    {"beta", "normal", "tangent"} of its elements. "pulled": beta from which on the
    grains pull. "depth": (D,) of the axis, m. "rods": by name and tension {"drag",
    "lift": (D,), N, "ratio": lift over drag deep down}. "measured": sign by name, 0
    where it is not known.
    """
    stress = VERTICAL[medium].stress
    beta = np.linspace(0.0, np.pi, 361)
    normal, tangent = face_stress(stress, beta)
    is_pulled = (normal < 0) & (beta > np.pi / 2)
    rods: dict = {}
    for name, rod in RODS.items():
        outline = rod.outline(elements)
        rods[name] = {}
        for tension in TENSIONS:
            law = replace(stress, tension=tension)
            rods[name][tension] = rod_forces(law, outline, depths)
    return {
        "beta": beta,
        "normal": normal,
        "tangent": tangent,
        "cylinder": cylinder_stress(stress),
        "pulled": float(beta[is_pulled].min()),
        "depth": np.linspace(RADIUS, DEEPEST, depths),
        "rods": rods,
        "measured": MEASURED_SIGNS,
    }


def face_stress(stress, beta):
    """Return normal and tangential stress per depth on plates that move level,
    N/cm^3, at tilts beta, rad."""
    a_x, a_z = stress(beta, 0.0)
    sin = np.sin(beta)
    cos = np.cos(beta)
    return sin * a_x + cos * a_z, sin * a_z - cos * a_x


def cylinder_stress(stress) -> dict:
    """Return {"beta", "normal", "tangent"} (E,) of the leading elements of the round
    rod, rad and N/cm^3."""
    faces = parts(RODS["round"].outline(48), (0, -1, 0), LEVEL)
    # Faces that do not lead have no depth.
    leads = (faces.depth > 0).ravel()
    beta = np.mod(np.arctan2(faces.n[0].ravel(), -faces.n[1].ravel())[leads], np.pi)
    a_x, a_z = (a.ravel()[leads] for a in stress.alpha(faces.n, faces.v))
    sin = np.sin(beta)
    cos = np.cos(beta)
    return {
        "beta": beta,
        "normal": cos * a_z + sin * a_x,
        "tangent": sin * a_z - cos * a_x,
    }


def rod_forces(stress, outline, depths: int) -> dict:
    """Return drag and lift (D,) on a rod, N, and lift over drag deep down."""
    depth = np.append(np.linspace(RADIUS, DEEPEST, depths), DEEP)
    pose = np.stack([0 * depth, -depth, 0 * depth], -1)
    force = loads(stress, outline, pose, LEVEL).force
    drag = -force[:, 0]
    lift = force[:, 1]
    return {"drag": drag[:-1], "lift": lift[:-1], "ratio": float(lift[-1] / drag[-1])}


def table(numbers: dict) -> str:
    """Return lift over drag deep down, and the measured sign."""
    heads = ("lift over drag", "map as it is", "tension cut", "measured")
    rows = []
    for name, rod in numbers["rods"].items():
        ratios = [f"{rod[tension]['ratio']:+.2f}" for tension in TENSIONS]
        rows.append((name, *ratios, SIGN_NAMES[numbers["measured"][name]]))
    return style.table(heads, rows)


COLOURS = dict(zip(RODS, style.SEQUENCE))


@plots.styled
def draw(numbers: dict):
    """Draw (a) stress, (b) drag, (c) lift and (d) lift over drag."""
    fig, axes = plots.figure(7.8, 6.2, 2, 2)
    draw_stress(axes[0, 0], numbers)
    draw_forces(axes[0, 1], numbers, "drag")
    draw_forces(axes[1, 0], numbers, "lift")
    style.add_entry(axes[0, 1], "tension cut", ls="--")
    axes[0, 1].legend(loc="upper left")
    draw_ratios(axes[1, 1], numbers)
    style.letter_panels(axes)
    return fig


def draw_stress(ax, numbers: dict) -> None:
    """Draw stress over depth against tilt, on plates and around the cylinder."""
    cylinder = numbers["cylinder"]
    ax.axvspan(np.degrees(numbers["pulled"]), 180, **style.SHADED)
    looks = (
        ("normal", style.VERMILION, "o", "normal"),
        ("tangent", style.BLUE, "s", "tangential"),
    )
    beta = np.degrees(numbers["beta"])
    for key, colour, marker, name in looks:
        ax.plot(beta, numbers[key], color=colour, label=f"{name}, plates")
        dots = {"color": colour, "mfc": "white", "ms": 4, "label": f"{name}, cylinder"}
        ax.plot(np.degrees(cylinder["beta"]), cylinder[key], marker, **dots)
    style.draw_zero_line(ax)
    ax.set(
        xlabel=r"tilt $\beta$ of the face: underside 0, front 90, top 180",
        ylabel="stress / depth (N/cm$^3$)",
        xlim=(0, 180),
        xticks=range(0, 181, 45),
    )
    ax.text(178, ax.get_ylim()[1], "grains pull", ha="right", va="top", **style.NOTE)
    ax.legend(loc="lower left")


def draw_forces(ax, numbers: dict, key: str) -> None:
    """Draw "drag" or "lift" against depth, dashed without tension."""
    depth = 1e2 * numbers["depth"]
    for k, (name, rod) in enumerate(numbers["rods"].items()):
        look = style.curve_look(k, len(depth))
        ax.plot(depth, rod["keep"][key], label=name, **look)
        ax.plot(depth, rod["cut"][key], "--", **look | {"marker": ""})
    ax.set(xlabel="depth of the axis (cm)", ylabel=f"{key} (N)")
    ax.set(xlim=(0, 1e2 * DEEPEST))
    ax.set_xticks(range(0, 16, 5))
    style.draw_zero_line(ax)


def draw_ratios(ax, numbers: dict) -> None:
    """Draw lift over drag deep down, with arrows for the measured sign."""
    for k, (name, rod) in enumerate(numbers["rods"].items()):
        ax.plot(k, rod["keep"]["ratio"], "o", ms=5, color=COLOURS[name])
        ax.plot(k, rod["cut"]["ratio"], "o", ms=9, mfc="none", color=COLOURS[name])
        draw_measured_sign(ax, k + 0.3, numbers["measured"][name])
    style.add_entry(ax, "map as it is", ls="", marker="o", ms=5)
    style.add_entry(ax, "tension cut", ls="", marker="o", ms=9, mfc="none")
    style.draw_zero_line(ax)
    ax.set(
        xticks=range(len(RODS)),
        xticklabels=[name.replace(", ", ",\n") for name in RODS],
        ylabel="lift / drag, deep down",
        xlim=(-0.4, len(RODS) - 0.3),
        ylim=(-0.6, 1.3),
    )
    ax.legend(loc="upper left", ncols=2)


def draw_measured_sign(ax, x: float, sign: int) -> None:
    """Draw an arrow up or down at x; none for a sign that is not known."""
    if sign == 0:
        return
    arrow = {"arrowstyle": "-|>", "color": "0.3", "lw": 1.6}
    ax.annotate("", (x, 0.3 * sign), (x, 0.0), arrowprops=arrow)
    side = "bottom" if sign > 0 else "top"
    label = f"measured:\n{SIGN_NAMES[sign]}"
    ax.text(x, 0.34 * sign, label, fontsize=7, ha="center", va=side)


if __name__ == "__main__":
    main("fig08a", compute, draw, table)
