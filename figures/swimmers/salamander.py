"""Legs and back of a salamander robot on sand: their coordination on a cylinder.

The shape variables are the bend of the back and the phase of the legs, which closes on
itself. Left: the robot of the scene `salamander` at four phases of a cycle; dots are
feet that touch. Middle: the x component of the CCF over both variables, and two gaits
that wind around the cylinder once per cycle: the back bends to bring the feet forward
(solid), or half a cycle later (dashed). Displacement is the integral of the CCF between
a gait and the straight line in the middle, the robot that walks with a stiff back, plus
the displacement along that line. Right: displacement per cycle against the lag of the
back, by the force balance and by this integral, with estimated errors as bands. The
best coordination goes about twice as far as the worst, as of a robot on poppy seeds
(APS March Meeting 2018, B50.12); all sizes are assumed.
"""

from __future__ import annotations

import numpy as np

import geomech
from figures import main, style
from geomech import plots
from geomech.mathematics.gaits import Fourier
from geomech.plots.maps import ccf_map
from geomech.plots.motion import BODY, LIFTED
from geomech.scenes import load
from geomech.studies.mechanics.motion import compute_motion

LAGS = np.linspace(0.0, 360.0, 13)  # degrees
DRAWN_LAGS = (0.0, 180.0)
PHASES = (0.0, 0.25, 0.5, 0.75)  # cycles


def bending(lag: float) -> Fourier:
    """Return the gait whose back bends a lag (degrees) later than that of the scene."""
    amplitude = load("salamander").gait.amplitude
    angle = np.radians(lag)
    return Fourier(
        cos=((float(np.cos(angle)),),),
        sin=((float(np.sin(angle)),),),
        amplitude=amplitude,
    )


def compute(lags=LAGS) -> dict:
    """Return what the three panels show.

    robot: {"points": (P, links + 1, 2), "legs": (P, legs, 2, 2), "weights": (P, legs)},
    BL, of one cycle. map: the CCF, BL/rad^2. lag: {"degrees": (L,), "area", "direct":
    (L,), "area_error", "direct_error": (L,)}, BL.
    """
    motion = compute_motion(load("salamander"))
    study = geomech.study("salamander")
    found = [
        study.displacement(tiers=["area", "direct"], gait=bending(lag)) for lag in lags
    ]
    lag = {"degrees": np.asarray(lags)}
    for k, tier in enumerate(("area", "direct")):
        lag[tier] = np.array([result["x"].values[k, 0] for result in found])
        lag[f"{tier}_error"] = np.array([result["x"].error[k, 0] for result in found])
    return {
        "robot": {
            "points": motion.points(),
            "legs": motion.leg_points(),
            "weights": motion.contact.weight,
        },
        "map": study.tables.curvature,
        "lag": lag,
    }


@plots.styled
def draw(numbers: dict):
    """Draw the robot, the CCF with two gaits, and displacement against lag."""
    fig, axes = plots.figure(10.6, 3.6, 3)
    left, middle, right = axes[0]
    draw_robot(left, **numbers["robot"])
    draw_map(middle, numbers["map"])
    draw_lag(right, numbers["lag"])
    return fig


def draw_robot(ax, points: np.ndarray, legs: np.ndarray, weights: np.ndarray) -> None:
    """Draw the robot at some phases, one below the other."""
    for k, phase in enumerate(PHASES):
        row = round(phase * (len(points) - 1))
        down = np.array([0.0, -0.32 * k])
        ax.plot(*(points[row] + down).T, color=BODY, lw=2.5)
        ax.plot(*(points[row, -1] + down), "o", color=style.VERMILION, ms=5)
        for leg, weight in zip(legs[row] + down, weights[row]):
            ax.plot(*leg.T, color=LIFTED, lw=1.5, zorder=1.9)
            if weight >= 0.5:
                ax.plot(*leg[1], "o", color=BODY, ms=4)
        ax.text(-0.85, down[1], f"{phase:g} cycle", va="center", **style.NOTE)
    ax.set(xlabel="x (BL)", aspect="equal", yticks=[], xlim=(-0.9, 0.9))
    ax.spines["left"].set_visible(False)


def draw_map(ax, field) -> None:
    """Draw the CCF along x with the loop at rest and two gaits."""
    scene = load("salamander")
    labels = (("bend of the back", "rad"), ("leg phase", "rad"))
    ccf_map(field, 0, (), ax=ax, labels=labels)
    t = np.linspace(0.0, 2 * np.pi, 200)
    ax.axvline(0.0, color="0.3", lw=0.9, ls=":")
    for lag, line in zip(DRAWN_LAGS, ("-", "--")):
        bend = bending(lag).shape(t)[:, 0]
        ax.plot(bend, t, color="black", lw=1.5, ls=line)
    ax.set(aspect="auto", xlim=np.array([-1.6, 1.6]) * scene.gait.amplitude)


def draw_lag(ax, lag: dict) -> None:
    """Draw displacement against the lag by both tiers."""
    entries = (
        ("direct", "force balance", style.BLACK),
        ("area", "integral of the CCF", style.VERMILION),
    )
    for tier, label, colour in entries:
        value = lag[tier]
        error = lag[f"{tier}_error"]
        ax.plot(lag["degrees"], value, color=colour, label=label)
        ax.fill_between(
            lag["degrees"], value - error, value + error, color=colour, alpha=0.25, lw=0
        )
    for degrees, line in zip(DRAWN_LAGS, ("-", "--")):
        ax.axvline(degrees, color="0.6", lw=0.9, ls=line)
    ax.set(
        xlabel="lag of the back (degrees)",
        ylabel="displacement per cycle, $x$ (BL)",
        xlim=(0, 360),
        ylim=(0, None),
        xticks=[0, 90, 180, 270, 360],
    )
    style.draw_legend_above(ax, 2)


if __name__ == "__main__":
    main("salamander", compute, draw)
