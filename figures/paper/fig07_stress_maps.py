"""Fig. 7(b) to (d): the nine coefficients of stress per unit depth, and the two stress
maps that they define.

The first panel shows the convention for plate, motion and stress (Fig. 6(a)). The
second panel compares the generic set M0 with media whose nine coefficients are known.
Each set is divided by the strength zeta of the medium: this one number converts one
medium into another. The maps are those of M0, hatched where the grains would pull on
the leading face. The coefficients and zeta are from
`rft.terradynamics.plates.VERTICAL`. For the other media of the published panel only
zeta is known.
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

    "names" and "generic": (9,) of M0, N/cm^3. "media": {name: {"zeta", "coefficients"
    (9,), "difference"}}, the coefficients over zeta, and the rms of their difference
    from M0 over the rms of M0. "survey": of M0.
    """
    generic = coefficients("generic")
    media = {}
    for name in SCALED:
        zeta = VERTICAL[f"{name}-scaled"].stress.zeta
        scaled = coefficients(name) / zeta
        ratio = np.mean((scaled - generic) ** 2) / np.mean(generic**2)
        media[name] = {
            "zeta": zeta,
            "coefficients": scaled,
            "difference": float(np.sqrt(ratio)),
        }
    return {
        "names": COEFFICIENTS,
        "generic": generic,
        "media": media,
        "survey": survey(VERTICAL["generic"].stress, cells),
    }


def coefficients(medium: str) -> np.ndarray:
    """Return the nine coefficients of a medium, N/cm^3."""
    stress = VERTICAL[medium].stress
    return np.array([getattr(stress, name) for name in COEFFICIENTS])


@plots.styled
def draw(numbers: dict):
    """Draw the convention, the coefficients and the two maps."""
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
    """Draw a plate at beta = 35 degrees that moves at gamma = 30 degrees, and the force
    on it in the generic map."""
    beta = np.radians(35)
    gamma = np.radians(30)
    middle = np.array([0.0, -0.85])
    along = np.array([np.cos(beta), np.sin(beta)])
    velocity = np.array([np.cos(gamma), -np.sin(gamma)])
    a_x, a_z = VERTICAL["generic"].stress(beta, gamma)
    ax.axhspan(-1.6, 0.0, color="#f3ead8", lw=0)
    ax.axhline(0.0, **style.SURFACE)
    plate = middle + 0.45 * np.outer([-1, 1], along)
    ax.plot(*plate.T, color=style.BLACK, lw=4, solid_capstyle="butt")

    drag = 0.9 * np.array([-a_x, 0.0])
    lift = 0.9 * np.array([0.0, a_z])
    draw_vector(ax, middle, velocity * 0.75, style.BLUE, "v", (0.05, -0.06))
    draw_vector(
        ax, middle, drag, style.VERMILION, r"$-\alpha_x|z|$", (-0.02, 0.05), "right"
    )
    draw_vector(ax, middle, lift, style.VERMILION, r"$\alpha_z|z|$", (0.04, 0.0))
    x, z = middle
    ax.plot([x, x + 0.95], [z, z], color="0.6", lw=0.6, ls="--")
    draw_angle(ax, middle, 0.0, beta, 0.34, r"$\beta$")
    draw_angle(ax, middle, -gamma, 0.0, 0.44, r"$\gamma$")

    depth_arrow = {"arrowstyle": "<->", "color": "0.3", "lw": 0.8}
    ax.annotate("", (-0.85, z), (-0.85, 0.0), arrowprops=depth_arrow)
    ax.text(-0.82, z / 2, "|z|", va="center")
    ax.text(-0.98, 0.03, "surface", va="bottom", **style.NOTE)
    ax.set(aspect="equal", xlim=(-1, 1.1), ylim=(-1.6, 0.3), xticks=[], yticks=[])
    for spine in ax.spines.values():
        spine.set_visible(False)


def draw_vector(
    ax, start, vector, colour: str, label: str, offset, side: str = "left"
) -> None:
    """Draw a vector with its label next to the tip. side: of the label that is
    there."""
    look = {"color": colour, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    tip = start + vector
    ax.annotate("", tip, start, arrowprops={"arrowstyle": "-|>", **look})
    ax.text(*(tip + offset), label, color=colour, ha=side, va="center")


def draw_angle(ax, centre, start: float, stop: float, radius: float, label: str):
    """Draw the arc of an angle from start to stop, rad, with its label."""
    arc = np.linspace(start, stop, 40)
    x, z = centre
    ax.plot(x + radius * np.cos(arc), z + radius * np.sin(arc), color="0.3", lw=0.8)
    middle = (start + stop) / 2
    x_label = x + (radius + 0.09) * np.cos(middle)
    z_label = z + (radius + 0.09) * np.sin(middle)
    ax.text(x_label, z_label, label, va="center")


def draw_coefficients(ax, numbers: dict) -> None:
    """Draw the coefficients of the media over their strength, and the generic set."""
    places = np.arange(len(numbers["names"]))
    style.draw_zero_line(ax)
    line = {"color": style.BLACK, "lw": 1.5, "marker": "*", "ms": 8}
    ax.plot(places, numbers["generic"], label="generic, $M_0$", **line)
    looks = zip((style.LOOSE, style.CLOSE), "os")
    for (name, medium), (colour, marker) in zip(numbers["media"].items(), looks):
        label = rf"{SCALED[name]}, $\zeta$ = {medium['zeta']:.3f}"
        dots = {"color": colour, "mfc": "none", "ms": 5, "label": label}
        ax.plot(places, medium["coefficients"], marker, **dots)
    labels = [f"${c[0]}_{{{c[1:].replace('m', '-')}}}$" for c in numbers["names"]]
    ax.set(
        ylabel=r"coefficient / $\zeta$ (N/cm$^3$)",
        xticks=places,
        xticklabels=labels,
        ylim=(-0.16, 0.62),
    )
    ax.tick_params(axis="x", labelsize=8)
    ax.legend(loc="upper right")


if __name__ == "__main__":
    main("fig07", compute, draw)
