"""The drawing of a chain of three links with its joint angles and body frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

TARGET = Path(__file__).parents[1] / "generated" / "alpha.svg"


def drawing() -> str:
    """Draw three links with alpha_1, alpha_2 and the body frame; return the Markdown
    that shows it."""
    from matplotlib.figure import Figure

    import geomech

    alpha = np.radians([50.0, 35.0])
    body = geomech.bodies.Chain(lengths=(1, 1, 1))
    ends = body.points(alpha, np.zeros(3))
    headings = np.arctan2(*np.diff(ends, axis=0)[:, ::-1].T)
    figure = Figure(figsize=(6.4, 3.1), layout="constrained")
    ax = figure.subplots()
    ax.plot(
        *ends.T,
        "-o",
        color="0.25",
        lw=5,
        ms=7,
        mfc="white",
        solid_capstyle="round",
        zorder=2,
    )
    for k, colour in enumerate(("C0", "C3")):
        _angle(
            ax, ends[k + 1], headings[k], headings[k + 1], rf"$\alpha_{k + 1}$", colour
        )
    for k, (dx, dy, ha) in enumerate(
        [(-0.02, -0.02, "right"), (0.03, -0.05, "left"), (-0.02, 0.02, "right")]
    ):
        ax.annotate(
            f"link {k + 1}",
            ends[k : k + 2].mean(0) + (dx, dy),
            ha=ha,
            va="center",
            fontsize=10,
        )
    ax.annotate("tail", ends[0] + (-0.03, 0), ha="right", va="center", fontsize=10)
    ax.annotate("head", ends[3] + (0.03, 0), ha="left", va="center", fontsize=10)
    arrow = {"arrowstyle": "-|>", "color": "C2", "lw": 1.8}
    for tip, name in (((0.16, 0), "$x$"), ((0, 0.16), "$y$")):
        ax.annotate("", tip, (0, 0), arrowprops=arrow, zorder=4)
        ax.annotate(
            name,
            np.multiply(tip, 1.18),
            color="C2",
            ha="center",
            va="center",
            fontsize=11,
        )
    ax.plot(0, 0, "o", color="C2", ms=4, zorder=4)
    ax.annotate("body frame", (-0.02, 0.06), color="C2", ha="right", fontsize=10)
    ax.set_aspect("equal")
    ax.margins(0.14)
    ax.axis("off")
    TARGET.parent.mkdir(exist_ok=True)
    figure.savefig(TARGET, metadata={"Date": None})
    alt = "Three links; alpha_1 at the joint next to the tail and alpha_2 at the joint next to the head, counter-clockwise"
    return f"![{alt}](/generated/{TARGET.name})"


def _angle(ax, joint, before: float, after: float, name: str, colour: str) -> None:
    """Draw the straight continuation of a link, the arc from it to the next link, and
    the angle's name."""
    radius, angles = 0.13, np.linspace(before, after, 40)
    ray = joint + 0.2 * np.array([[0, 0], [np.cos(before), np.sin(before)]])
    ax.plot(*ray.T, ":", color=colour, lw=1.4)
    arc = joint + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ax.annotate(
        "",
        arc[-1],
        arc[-3],
        arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.4},
    )
    ax.plot(*arc[:-2].T, color=colour, lw=1.4)
    middle = 0.5 * (before + after)
    ax.annotate(name, joint + 1.55 * radius * np.array([np.cos(middle), np.sin(middle)]), color=colour, ha="center",
                va="center", fontsize=13)  # fmt: skip
