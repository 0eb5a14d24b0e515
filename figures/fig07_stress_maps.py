"""Fig. 7(b) to (d): the nine coefficients of stress per depth, and the two maps that they make.

The first panel is the convention of plate, motion and stress (Fig. 6(a)), the second the coefficients of media that have
nine of their own, each over the medium's zeta, beside the generic set M0: one number, the strength, takes one medium to the
other. The maps are of M0, hatched where the grains would pull on the face that leads. Coefficients and zeta are those of
`rft.terradynamics.plates.VERTICAL`; the other media of the published panel have only their zeta there.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from rft.terradynamics.plates import VERTICAL, survey
from rft.terradynamics.plates.stress import COEFFICIENTS

SCALED = {
    "poppy-seeds-loose": "poppy seeds, loose",
    "poppy-seeds-close": "poppy seeds, close",
}


def compute(cells: int = 180) -> dict:
    """Return the nine coefficients and the survey of the generic map.

    "names" and "generic": (9,) of M0, N/cm^3. "media": {name: {"zeta", "coefficients" (9,), "off"}}, the coefficients over
    zeta, and the rms of their difference from M0 over the rms of M0. "survey": of M0.
    """
    values = lambda name: np.array(
        [getattr(VERTICAL[name].stress, c) for c in COEFFICIENTS]
    )
    generic, media = values("generic"), {}
    for name in SCALED:
        zeta = VERTICAL[f"{name}-scaled"].stress.zeta
        scaled = values(name) / zeta
        difference = float(
            np.sqrt(np.mean((scaled - generic) ** 2) / np.mean(generic**2))
        )
        media[name] = {"zeta": zeta, "coefficients": scaled, "off": difference}
    generic_map = survey(VERTICAL["generic"].stress, cells)
    return {
        "names": COEFFICIENTS,
        "generic": generic,
        "media": media,
        "survey": generic_map,
    }


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.4, 6.6, 2, 2)
    draw_convention(axes[0, 0])
    draw_coefficients(axes[0, 1], numbers)
    for ax, name in zip(axes[1], "zx"):
        plots.stress_map(ax, numbers["survey"], name)
    titles = (
        "convention",
        "(b) coefficients over strength",
        r"(c) upwards, $M_0$",
        r"(d) against the motion, $M_0$",
    )
    for ax, title in zip(axes.flat, titles):
        ax.set_title(title, loc="left")
    return fig


def draw_convention(ax) -> None:
    """Draw a plate at beta = 35 degrees that moves at gamma = 30 degrees, and the force on it in the generic map."""
    beta, gamma, middle = np.radians(35), np.radians(30), np.array([0.0, -0.85])
    along, velocity = (
        np.array([np.cos(beta), np.sin(beta)]),
        np.array([np.cos(gamma), -np.sin(gamma)]),
    )
    a_x, a_z = VERTICAL["generic"].stress(beta, gamma)
    ax.axhspan(-1.6, 0.0, color="#f3ead8", lw=0)
    ax.axhline(0.0, **style.SURFACE)
    ax.plot(
        *(middle + 0.45 * np.outer([-1, 1], along)).T,
        color=style.BLACK,
        lw=4,
        solid_capstyle="butt",
    )
    arrows = (
        (velocity * 0.75, style.BLUE, "v", (0.05, -0.06)),
        (
            0.9 * np.array([-a_x, 0.0]),
            style.VERMILION,
            r"$-\alpha_x|z|$",
            (-0.02, 0.05),
        ),
        (0.9 * np.array([0.0, a_z]), style.VERMILION, r"$\alpha_z|z|$", (0.04, 0.0)),
    )
    for vector, colour, label, (right, up) in arrows:
        tip = middle + vector
        ax.annotate(
            "",
            tip,
            middle,
            arrowprops={
                "arrowstyle": "-|>",
                "color": colour,
                "lw": 1.4,
                "shrinkA": 0,
                "shrinkB": 0,
            },
        )
        side = "right" if vector[0] < 0 else "left"
        ax.text(tip[0] + right, tip[1] + up, label, color=colour, ha=side, va="center")
    ax.plot(
        [middle[0], middle[0] + 0.95], [middle[1]] * 2, color="0.6", lw=0.6, ls="--"
    )
    for start, stop, reach, label in (
        (0.0, beta, 0.34, r"$\beta$"),
        (-gamma, 0.0, 0.44, r"$\gamma$"),
    ):
        turn = np.linspace(start, stop, 40)
        ax.plot(
            middle[0] + reach * np.cos(turn),
            middle[1] + reach * np.sin(turn),
            color="0.3",
            lw=0.8,
        )
        at = (start + stop) / 2
        ax.text(
            middle[0] + (reach + 0.09) * np.cos(at),
            middle[1] + (reach + 0.09) * np.sin(at),
            label,
            va="center",
        )
    ax.annotate(
        "",
        (-0.85, middle[1]),
        (-0.85, 0.0),
        arrowprops={"arrowstyle": "<->", "color": "0.3", "lw": 0.8},
    )
    ax.text(-0.82, middle[1] / 2, "|z|", va="center")
    ax.text(-0.98, 0.03, "surface", va="bottom", **style.NOTE)
    ax.set(aspect="equal", xlim=(-1, 1.1), ylim=(-1.6, 0.3), xticks=[], yticks=[])
    for spine in ax.spines.values():
        spine.set_visible(False)


def draw_coefficients(ax, numbers: dict) -> None:
    at = np.arange(len(numbers["names"]))
    style.zero_line(ax)
    ax.plot(
        at,
        numbers["generic"],
        color=style.BLACK,
        lw=1.5,
        marker="*",
        ms=8,
        label="generic, $M_0$",
    )
    for (name, medium), colour, mark in zip(
        numbers["media"].items(), (style.LOOSE, style.CLOSE), "os"
    ):
        label = rf"{SCALED[name]}, $\zeta$ = {medium['zeta']:.3f}"
        ax.plot(
            at,
            medium["coefficients"],
            mark,
            color=colour,
            mfc="none",
            ms=5,
            label=label,
        )
    labels = [f"${c[0]}_{{{c[1:].replace('m', '-')}}}$" for c in numbers["names"]]
    ax.set(
        ylabel=r"coefficient / $\zeta$ (N/cm$^3$)",
        xticks=at,
        xticklabels=labels,
        ylim=(-0.16, 0.62),
    )
    ax.tick_params(axis="x", labelsize=8)
    ax.legend(loc="upper right")


if __name__ == "__main__":
    main("fig07", compute, draw)
