"""Joints that give way: a passive tail in a viscous fluid, and a swimmer in loose glass
beads whose cables have slack.

Left: displacement of three equal links whose head's joint moves by A cos(t), while the
tail's joint is a spring of stiffness k, against k over omega M22, the drag on that
joint. The line is the limit of small amplitude, CCF_x(0) pi A^2 M21 omega k / (k^2 +
omega^2 M22^2), where M is the metric of the drag at the straight shape. It is largest
where the spring is as stiff as the drag. Middle: loops that the shape of the swimmer in
sand makes for three widths of the slack, and the loop of the command, all clockwise.
Right: its displacement against the slack at two amplitudes of the command, with
estimated errors (at most 0.0011 body lengths) as bands, and the displacement of gaits
that prescribe the shape. Stiffness and slack are assumed.
"""

from __future__ import annotations

import dataclasses

import numpy as np

import geomech
from figures import main, style
from geomech import plots
from geomech.plots.maps import draw_arrow
from geomech.scenes import load
from geomech.studies.displacement.batch import joined_scene

# Metric of three equal links with a drag ratio of 2 at the straight shape, as
# sysplotter publishes it, and CCF_x there (Fig. 11(d) of the viscous swimmer).
DRAG = 0.0073160  # M22
COUPLING = 0.0050297  # M21
CCF = 5 / 243
RATIOS = np.geomspace(0.1, 10.0, 17)  # of stiffness and drag on the joint
TAIL_AMPLITUDES = (0.25, 1.0, 1.5)  # rad
SLACKS = np.linspace(0.0, 0.6, 25)  # rad to either side
DRAWN_SLACKS = (0.0, 0.2, 0.4)  # rad
CABLE_AMPLITUDES = (1.0, 1.5)  # rad


def compute(ratios=RATIOS, slacks=SLACKS) -> dict:
    """Return the displacements and loops of the three panels.

    tail: {"ratio": (R,), "scaled": (A, R)}, displacement over the amplitude squared,
    BL/rad2. loops: {slack: (N, 2)}, rad. cable: {"slack": (S,), "x", "error": (A, S),
    "prescribed": (A,)}, BL.
    """
    return {
        "tail": tail_displacements(np.asarray(ratios)),
        "loops": cable_loops(),
        "cable": cable_displacements(np.asarray(slacks)),
    }


def tail_displacements(ratios: np.ndarray) -> dict:
    """Return displacements against the stiffness of the tail."""
    scene = load("three-link-tail")
    (springs,) = scene.system.effects
    omega = 2 * np.pi * springs.frequency
    scenes = []
    for amplitude in TAIL_AMPLITUDES:
        gait = dataclasses.replace(scene.gait, semi_axes=(amplitude, amplitude))
        for ratio in ratios:
            spring = dataclasses.replace(springs, stiffness=float(ratio * omega * DRAG))
            scenes.append(scene.changed(effects=(spring,), gait=gait))
    net = joined_scene(scenes).cycle().net[:, 0].reshape(len(TAIL_AMPLITUDES), -1)
    return {
        "ratio": ratios,
        "scaled": net / np.array(TAIL_AMPLITUDES)[:, None] ** 2,
    }


def small_amplitude(ratio: np.ndarray) -> np.ndarray:
    """Return the limit of the tail's displacement over A^2 at small amplitude A."""
    return CCF * np.pi * COUPLING / DRAG * ratio / (1 + ratio**2)


def cable_loops() -> dict:
    """Return the loop (N, 2) that the shape makes for each slack."""
    scene = load("three-link-cable")
    (springs,) = scene.system.effects
    loops = {}
    for slack in DRAWN_SLACKS:
        slackened = dataclasses.replace(springs, dead_band=slack)
        loops[slack] = scene.changed(effects=(slackened,)).cycle().springs.alpha
    return loops


def cable_displacements(slacks: np.ndarray) -> dict:
    """Return displacements against the slack, with errors, and of prescribed gaits."""
    over = {
        "gait.amplitude": list(CABLE_AMPLITUDES),
        "effects.springs.dead_band": [float(slack) for slack in slacks],
    }
    x = geomech.sweep("three-link-cable", over)["x"]
    prescribed = geomech.displacement("three-link-glass", CABLE_AMPLITUDES, "direct")
    return {
        "slack": slacks,
        "x": x.values,
        "error": x.error,
        "prescribed": prescribed["x"].values.ravel(),
    }


@plots.styled
def draw(numbers: dict):
    """Draw displacement against stiffness, the loops, and displacement against
    slack."""
    fig, axes = plots.figure(10.2, 3.4, 3)
    left, middle, right = axes[0]
    draw_tail(left, numbers["tail"])
    draw_loops(middle, numbers["loops"])
    draw_cable(right, numbers["cable"])
    return fig


def draw_tail(ax, tail: dict) -> None:
    """Draw displacement over the amplitude squared against the stiffness."""
    ax.axvline(1.0, **style.GUIDE, ls="--")
    fine = np.geomspace(RATIOS[0], RATIOS[-1], 200)
    ax.plot(fine, small_amplitude(fine), color="black", label="small amplitude")
    colours = (style.BLUE, style.GREEN, style.VERMILION)
    for amplitude, scaled, colour, marker in zip(
        TAIL_AMPLITUDES, tail["scaled"], colours, "os^"
    ):
        look = {"color": colour, "marker": marker, "ms": 4, "ls": "", "mfc": "none"}
        ax.plot(tail["ratio"], scaled, label=f"$A$ = {amplitude:g} rad", **look)
    ax.set(
        xscale="log",
        xlabel=r"stiffness of the tail's joint, $k\,/\,(\omega M_{22})$",
        ylabel=r"displacement per cycle$\,/\,A^2$ (BL/rad$^2$)",
        ylim=(0, None),
    )
    style.draw_legend_above(ax, 2)


def draw_loops(ax, loops: dict) -> None:
    """Draw the loops of the shape over that of the command."""
    command, _ = load("three-link-cable").gait.cycle(256)
    draw_loop(ax, command, "command", color="0.3", ls="--")
    for (slack, loop), colour in zip(loops.items(), style.shades(len(loops))):
        draw_loop(ax, loop, f"slack {slack:g} rad", color=colour)
    ax.set(
        xlabel=r"$\alpha_1$ (rad)",
        ylabel=r"$\alpha_2$ (rad)",
        aspect="equal",
        xlim=(-1.15, 1.15),
        ylim=(-1.15, 1.15),
    )
    style.draw_legend_above(ax, 2)


def draw_loop(ax, loop: np.ndarray, label: str, **look) -> None:
    """Draw a closed loop (N, 2) with an arrow along it."""
    closed = np.concatenate([loop, loop[:1]])
    ax.plot(*closed.T, label=label, **look)
    top = int(loop[:, 1].argmax())
    draw_arrow(ax, loop[top - 12], loop[top - 4], look["color"])


def draw_cable(ax, cable: dict) -> None:
    """Draw displacement against the slack, and of prescribed gaits."""
    style.draw_zero_line(ax)
    colours = (style.BLUE, style.VERMILION)
    for amplitude, x, error, prescribed, colour in zip(
        CABLE_AMPLITUDES, cable["x"], cable["error"], cable["prescribed"], colours
    ):
        slack = cable["slack"]
        ax.plot(slack, x, color=colour, label=f"$A$ = {amplitude:g} rad")
        ax.fill_between(slack, x - error, x + error, color=colour, alpha=0.3, lw=0)
        ax.axhline(prescribed, color=colour, ls=":", lw=0.9)
    style.add_entry(ax, "prescribed", ls=":", lw=0.9)
    ax.set(
        xlabel="slack to either side (rad)",
        ylabel="displacement per cycle (BL)",
        xlim=(0, cable["slack"][-1]),
    )
    style.draw_legend_above(ax, 2)


if __name__ == "__main__":
    main("compliance", compute, draw)
