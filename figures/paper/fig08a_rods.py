"""Fig. 8(a): stress around a dragged cylinder by plates, and drag and lift on rods of
four shapes against depth.

(a) Resistive force theory takes the stress on a part of a rod for that on a plate of
the same tilt at the same depth; the text says that the two are nearly equal in
discrete-element simulation. The line is the map for plates, the dots the elements of a
cylinder that moves level: normal stress, positive where the grains push, and tangential
stress, positive from the bottom of the cylinder to its top. Tilts run from 0 (the
underside) through 90 degrees (the front) to 180 (the top); that the published angle
from 0 to pi starts below is assumed. Its data are not in the text.

(b), (c) Drag and lift against the depth of the rod's axis. (d) Lift over drag deep
down, beside the sign that was measured (Ding, Gravish and Goldman, Phys. Rev. Lett.
106, 028001 (2011)): up on round and square rods, down on a half cylinder that lies on
its flat side. The nine-term map says up for all. It pulls on faces that look up by more
than 53 degrees, and that lifts. Without tension (dashed, open) nothing is left of the
half cylinder's lift but 0.04 of its drag, still not the measured sign: it takes faces
that look up to be pressed down, as plates were in that work. Undersides that slide
along themselves carry nothing here; they could only add lift.

Sizes of the rods and depths are assumed; medium: 3 mm glass, as in the text.
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
    "round": (RoundRod(RADIUS, WIDTH), "up"),
    "half, flat down": (HalfCylinder(RADIUS, WIDTH, "down"), "down"),
    "half, flat up": (HalfCylinder(RADIUS, WIDTH, "up"), None),
    "square": (SquareRod(2 * RADIUS, WIDTH), "up"),
}  # and the sign of the lift that was measured
# m; at the second, one depth for all of a rod
DEEPEST = 0.15
DEEP = 100.0
LEVEL = (1.0, 0.0, 0.0)


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
    normal, tangent = on_face(stress, beta)
    faces = parts(RODS["round"][0].outline(48), (0, -1, 0), LEVEL)
    leads = (faces.depth > 0).ravel()
    around = np.mod(np.arctan2(faces.n[0].ravel(), -faces.n[1].ravel())[leads], np.pi)
    a_x, a_z = (a.ravel()[leads] for a in stress.alpha(faces.n, faces.v))
    sin = np.sin(around)
    cos = np.cos(around)
    cylinder = {
        "beta": around,
        "normal": cos * a_z + sin * a_x,
        "tangent": sin * a_z - cos * a_x,
    }
    return {
        "beta": beta, "normal": normal, "tangent": tangent, "cylinder": cylinder,
        "pulled": float(beta[(normal < 0) & (beta > np.pi / 2)].min()), "depth": np.linspace(RADIUS, DEEPEST, depths),
        "rods": {name: {tension: rod_forces(replace(stress, tension=tension), rod.outline(elements), depths)
                        for tension in ("keep", "cut")} for name, (rod, _) in RODS.items()},
        "measured": {name: {"up": 1, "down": -1, None: 0}[sign] for name, (_, sign) in RODS.items()},
    }  # fmt: skip


def on_face(stress, beta):
    """Return normal and tangential stress per depth on plates that move level,
    N/cm^3."""
    a_x, a_z = stress(beta, 0.0)
    sin = np.sin(beta)
    cos = np.cos(beta)
    return sin * a_x + cos * a_z, sin * a_z - cos * a_x


def rod_forces(stress, outline, depths: int) -> dict:
    """Return drag and lift (D,) on a rod, N, and lift over drag deep down."""
    depth = np.append(np.linspace(RADIUS, DEEPEST, depths), DEEP)
    force = loads(
        stress, outline, np.stack([0 * depth, -depth, 0 * depth], -1), LEVEL
    ).force
    drag = -force[:, 0]
    lift = force[:, 1]
    return {"drag": drag[:-1], "lift": lift[:-1], "ratio": float(lift[-1] / drag[-1])}


def table(numbers: dict) -> str:
    """Return lift over drag deep down, and the measured sign."""
    signs = {1: "up", -1: "down", 0: "not known"}
    rows = [
        (
            name,
            f"{rod['keep']['ratio']:+.2f}",
            f"{rod['cut']['ratio']:+.2f}",
            signs[numbers["measured"][name]],
        )
        for name, rod in numbers["rods"].items()
    ]
    return style.table(
        ("lift over drag", "map as it is", "tension cut", "measured"), rows
    )


COLOURS = dict(zip(RODS, style.SEQUENCE))


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.8, 6.2, 2, 2)
    draw_stress(axes[0, 0], numbers)
    for ax, what in ((axes[0, 1], "drag"), (axes[1, 0], "lift")):
        for k, (name, rod) in enumerate(numbers["rods"].items()):
            look = style.sparse(k, len(numbers["depth"]))
            ax.plot(1e2 * numbers["depth"], rod["keep"][what], label=name, **look)
            ax.plot(
                1e2 * numbers["depth"], rod["cut"][what], "--", **look | {"marker": ""}
            )
        ax.set(
            xlabel="depth of the axis (cm)",
            ylabel=f"{what} (N)",
            xlim=(0, 1e2 * DEEPEST),
        )
        ax.set_xticks(range(0, 16, 5))
        style.zero_line(ax)
    style.entry(axes[0, 1], "tension cut", ls="--")
    axes[0, 1].legend(loc="upper left")
    draw_ratios(axes[1, 1], numbers)
    style.letter_panels(axes)
    return fig


def draw_stress(ax, numbers: dict) -> None:
    around = numbers["cylinder"]
    ax.axvspan(np.degrees(numbers["pulled"]), 180, **style.SHADED)
    looks = (
        ("normal", style.VERMILION, "o", "normal"),
        ("tangent", style.BLUE, "s", "tangential"),
    )
    for what, colour, marker, name in looks:
        ax.plot(
            np.degrees(numbers["beta"]),
            numbers[what],
            color=colour,
            label=f"{name}, plates",
        )
        dots = {"color": colour, "mfc": "white", "ms": 4, "label": f"{name}, cylinder"}
        ax.plot(np.degrees(around["beta"]), around[what], marker, **dots)
    style.zero_line(ax)
    ax.set(
        xlabel=r"tilt $\beta$ of the face: underside 0, front 90, top 180",
        ylabel="stress / depth (N/cm$^3$)",
    )
    ax.set(xlim=(0, 180), xticks=range(0, 181, 45))
    ax.text(178, ax.get_ylim()[1], "grains pull", ha="right", va="top", **style.NOTE)
    ax.legend(loc="lower left")


def draw_ratios(ax, numbers: dict) -> None:
    arrow = {"arrowstyle": "-|>", "color": "0.3", "lw": 1.6}
    for k, (name, rod) in enumerate(numbers["rods"].items()):
        ax.plot(k, rod["keep"]["ratio"], "o", ms=5, color=COLOURS[name])
        ax.plot(k, rod["cut"]["ratio"], "o", ms=9, mfc="none", color=COLOURS[name])
        if sign := numbers["measured"][name]:
            ax.annotate("", (k + 0.3, 0.3 * sign), (k + 0.3, 0.0), arrowprops=arrow)
            direction, side = ("up", "bottom") if sign > 0 else ("down", "top")
            ax.text(
                k + 0.3,
                0.34 * sign,
                f"measured:\n{direction}",
                fontsize=7,
                ha="center",
                va=side,
            )
    style.entry(ax, "map as it is", ls="", marker="o", ms=5)
    style.entry(ax, "tension cut", ls="", marker="o", ms=9, mfc="none")
    style.zero_line(ax)
    ax.set(
        xticks=range(len(RODS)),
        xticklabels=[n.replace(", ", ",\n") for n in RODS],
        ylabel="lift / drag, deep down",
    )
    ax.set(xlim=(-0.4, len(RODS) - 0.3), ylim=(-0.6, 1.3))
    ax.legend(loc="upper left", ncols=2)


if __name__ == "__main__":
    main("fig08a", compute, draw, table)
