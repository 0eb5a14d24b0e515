"""Sidewinding in sand, on the level and on slopes: contact that travels along the body.

Left: the scene `sidewinder` over three cycles, from light to dark; thick where it
touches the ground, which leaves separate tracks aslant to the direction of travel.
Middle: its displacement along and across the body against the lag of the wave of
contact behind the horizontal wave, with estimated errors as bands, and the displacement
of the same wave without lifting. A quarter of a cycle sends it sideways without
turning. Right: distance uphill per cycle on slopes towards its left, over the share of
a cycle for which a part touches, and what becomes of it where it does not climb. The
steeper the slope, the more of the body must touch, as in sidewinders (Marvi et al.,
Science 346, 224, 2014): a trend, as amplitude and weight are assumed.
"""

from __future__ import annotations

import numpy as np

import geomech
from figures import main, style
from geomech import plots
from geomech.plots.motion import BODY, LIFTED
from geomech.scenes import load
from geomech.studies.mechanics.motion import compute_motion
from geomech.studies.mechanics.outcome import SLIDES, SLIPS

LAGS = np.linspace(0.0, 360.0, 25)  # degrees
DUTIES = np.linspace(0.25, 0.7, 10)
ANGLES = np.linspace(0.0, 25.0, 11)  # degrees
CYCLES = 3
SHOWN = 4  # bodies
MARKS = {SLIPS: "v", SLIDES: "x"}


def compute(lags=LAGS, duties=DUTIES, angles=ANGLES) -> dict:
    """Return the motion and the displacements of the three panels.

    motion: {"points": (P, elements + 1, 2), "weights": (P, elements)}, BL. lag:
    {"degrees": (L,), "x", "y", "error": (L,), "without": float}, BL. slope: {"duty":
    (D,), "degrees": (A,), "uphill": (D, A), "outcome": (D, A)}, BL.
    """
    return {
        "motion": sidewinding(),
        "lag": lagging(np.asarray(lags, float)),
        "slope": climbing(np.asarray(duties, float), np.asarray(angles, float)),
    }


def sidewinding() -> dict:
    """Return the body and its contact at every phase of some cycles."""
    motion = compute_motion(load("sidewinder"), CYCLES)
    return {"points": motion.points(), "weights": motion.contact.weight}


def lagging(lags: np.ndarray) -> dict:
    """Return displacements against the lag, and without lifting."""
    scene = load("sidewinder")
    swept = geomech.sweep(scene, {"contact.lag_deg": lags.tolist()})
    plain = scene.changed(contact=None)
    return {
        "degrees": lags,
        "x": swept["x"].values,
        "y": swept["y"].values,
        "error": swept["x"].error,
        "without": float(plain.cycle().net[0]),
    }


def climbing(duties: np.ndarray, angles: np.ndarray) -> dict:
    """Return distances uphill, and outcomes, over contact and slope."""
    over = {
        "contact.duty": duties.tolist(),
        "effects.slope.angle_deg": angles.tolist(),
    }
    swept = geomech.sweep("sidewinder-slope", over)
    return {
        "duty": duties,
        "degrees": angles,
        "uphill": swept["uphill"].values,
        "outcome": swept["outcome"].values,
    }


@plots.styled
def draw(numbers: dict):
    """Draw the body, displacement against lag, and the outcomes on slopes."""
    fig, axes = plots.figure(10.6, 3.5, 3)
    left, middle, right = axes[0]
    draw_body(left, **numbers["motion"])
    draw_lag(middle, numbers["lag"])
    draw_slope(right, numbers["slope"])
    return fig


def draw_body(ax, points: np.ndarray, weights: np.ndarray) -> None:
    """Draw the body at some phases over the places that touched the ground."""
    middles = (points[:, 1:] + points[:, :-1]) / 2
    ax.plot(*middles[weights > 0.5].T, "o", ms=1.2, color="0.82", rasterized=True)
    rows = np.linspace(0, len(points) - 1, SHOWN).round().astype(int)
    for k, row in enumerate(rows):
        shade = 0.35 + 0.65 * k / (SHOWN - 1)
        ax.plot(*points[row].T, color=LIFTED, lw=1.5, alpha=shade)
        touches = weights[row] > 0.5
        broken = np.where(touches[:, None], points[row, :-1], np.nan)
        ax.plot(*broken.T, color=BODY, lw=3.0, alpha=shade)
    ax.set(xlabel="x (BL)", ylabel="y (BL)", aspect="equal")


def draw_lag(ax, lag: dict) -> None:
    """Draw both components against the lag."""
    style.draw_zero_line(ax)
    entries = (("x", "along, $x$", style.BLUE), ("y", "across, $y$", style.VERMILION))
    for name, label, colour in entries:
        value = lag[name]
        ax.plot(lag["degrees"], value, color=colour, label=label)
        low = value - lag["error"]
        high = value + lag["error"]
        ax.fill_between(lag["degrees"], low, high, color=colour, alpha=0.3, lw=0)
    ax.axhline(lag["without"], color=style.BLUE, ls=":", lw=0.9)
    style.add_entry(ax, "$x$ without lifting", color=style.BLUE, ls=":", lw=0.9)
    ax.axvline(90.0, **style.GUIDE, ls="--")
    ax.set(
        xlabel="lag of contact (degrees)",
        ylabel="displacement per cycle (BL)",
        xlim=(0, 360),
        xticks=[0, 90, 180, 270, 360],
    )
    style.draw_legend_above(ax, 2)


def draw_slope(ax, slope: dict) -> None:
    """Draw the distance uphill as a map, and marks where it does not climb."""
    from cmcrameri import cm

    top = np.nanmax(np.abs(slope["uphill"]))
    image = ax.pcolormesh(
        slope["duty"],
        slope["degrees"],
        slope["uphill"].T,
        cmap=cm.vik,
        vmin=-top,
        vmax=top,
        shading="nearest",
        rasterized=True,
    )
    ax.figure.colorbar(image, ax=ax).set_label("distance uphill (BL)")
    duty, degrees = np.meshgrid(slope["duty"], slope["degrees"], indexing="ij")
    for name, marker in MARKS.items():
        where = slope["outcome"] == name
        ax.scatter(
            duty[where], degrees[where], marker=marker, s=14, color="black", label=name
        )
    ax.set(xlabel="share of a cycle in contact, duty", ylabel="slope (degrees)")
    style.draw_legend_above(ax, 2)


if __name__ == "__main__":
    main("sidewinding", compute, draw)
