"""Effects of the ground: force on the c-leg of Fig. 8(b) in loose poppy seeds with
grain inertia, with air, on a slope, and in disturbed ground.

Left: force that the inertia of the grains adds, over the force without it, both rms
over the turn, against the rate, for lambda of 1 to 4; experiments notice it above about
230 rpm (dashed). Middle: peak lift over its value in still, level ground, against air
speed over the speed of fluidisation, and against slope over the angle of repose, for a
leg that sweeps down the slope and one that sweeps up. Right: lift against angle where
an earlier intrusion has disturbed the ground in front of the leg.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft.terradynamics.ground import Aeration, DisturbedGround, GrainInertia, Slope
from rft.terradynamics.ground.slope import REPOSE

NOTICED_RATE = 230.0  # rpm
SHARE = 0.1  # of the force, from which an effect counts as noticeable; assumed
PLACES = (-0.04, 0.0, 0.04)  # m
FLUIDISATION = 0.03  # m/s


def compute(
    rates=(30, 60, 115, 230, 460),
    strengths=(1.0, 2.0, 4.0),
    shares=(0, 0.2, 0.4, 0.6, 0.8),
) -> dict:
    """Return rates (R,), rpm; added (S, R); noticeable_rates (S,), at which SHARE is
    added. shares (N,), aerated, rising and falling (N,): peaks of the lift over that
    without, on ground that rises or falls ahead of the robot by shares of REPOSE. angle
    (T,), rad; lift {place: (T,)}, N."""
    leg = load("c-leg")
    without = leg.run()
    added = [[added_force(leg, without, k, rpm) for rpm in rates] for k in strengths]
    added = np.array(added) / np.sqrt((without.force**2).sum(-1).mean())

    def lift(effect) -> np.ndarray:
        return leg.changed(effects=(effect,)).run().force[:, 1]

    def peaks(effects) -> np.ndarray:
        highest = [lift(effect).max() for effect in effects]
        return np.array(highest) / without.force[:, 1].max()

    lifts = {None: without.force[:, 1]}
    for x in PLACES:
        lifts[x] = lift(DisturbedGround(places=(x,), radius=0.02, weakening=0.5))
    return {
        "rates": np.array(rates),
        "strengths": strengths,
        "added": added,
        # The force grows with the square of the rate.
        "noticeable_rates": rates[-1] * np.sqrt(SHARE / added[:, -1]),
        "shares": np.array(shares),
        "aerated": peaks(Aeration(x * FLUIDISATION, FLUIDISATION) for x in shares),
        "rising": peaks(Slope(x * REPOSE) for x in shares),
        "falling": peaks(Slope(-x * REPOSE) for x in shares),
        "angle": without.pose[:, 2],
        "lift": lifts,
    }


def added_force(leg, without, strength: float, rpm: float) -> float:
    """Return the rms over the turn of the force that the inertia of grains adds, N."""
    fast = dataclasses.replace(leg.motion, rate=rpm * 2 * np.pi / 60)
    run = leg.changed(motion=fast, effects=(GrainInertia(strength),)).run()
    return np.sqrt(((run.force - without.force) ** 2).sum(-1).mean())


def table(numbers: dict) -> str:
    """Return the rates above which the inertia of grains is noticeable."""
    column = list(numbers["rates"]).index(NOTICED_RATE)
    lines = []
    for k, strength in enumerate(numbers["strengths"]):
        percent = 100 * numbers["added"][k, column]
        rate = numbers["noticeable_rates"][k]
        lines.append(
            f"lambda = {strength:g}: {percent:.0f} % of the force at"
            f" {NOTICED_RATE:.0f} rpm, {100 * SHARE:.0f} % at {rate:.0f} rpm"
        )
    return "\n".join(lines)


@plots.styled
def draw(numbers: dict):
    """Draw the inertia of grains, aerated and sloped ground, and disturbed ground."""
    fig, axes = plots.figure(10.2, 3.2, 3)
    inertia_ax, peak_ax, lift_ax = axes[0]
    draw_inertia(inertia_ax, numbers)
    draw_peaks(peak_ax, numbers)
    draw_lift(lift_ax, numbers)
    return fig


def draw_inertia(ax, numbers: dict) -> None:
    """Draw the force that the inertia of grains adds against the rate."""
    rates = numbers["rates"]
    strengths = numbers["strengths"]
    shades = style.shades(len(strengths))
    for strength, added, shade in zip(strengths, numbers["added"], shades):
        label = rf"$\lambda$ = {strength:g}"
        ax.loglog(rates, added, "o-", lw=1.0, color=shade, label=label)
    ax.axvline(NOTICED_RATE, **style.GUIDE, ls="--")
    ax.axhline(SHARE, **style.GUIDE)
    ax.set_xlabel("rate of turning (rpm)")
    ax.set_ylabel("added by grain inertia / force without")
    style.set_named_ticks(ax, rates, [str(rate) for rate in rates])
    ax.legend(loc="upper left")


def draw_peaks(ax, numbers: dict) -> None:
    """Draw the peak of the lift against air speed and slope."""
    slope = "slope / angle of repose"
    looks = (
        ("aerated", "o-", style.BLUE, "air speed / fluidisation"),
        ("rising", "s-", style.VERMILION, f"{slope}, leg sweeps downhill"),
        ("falling", "s--", style.VERMILION, f"{slope}, leg sweeps uphill"),
    )
    shares = numbers["shares"]
    for name, line, colour, label in looks:
        ax.plot(shares, numbers[name], line, lw=1.0, color=colour, label=label)
    ax.set(xlabel="share", ylabel="peak lift / that without")
    ax.set(xlim=(0, 1), ylim=(0, 1.02))
    style.draw_legend_above(ax)


def draw_lift(ax, numbers: dict) -> None:
    """Draw lift against angle where the ground has been disturbed."""
    angle = np.degrees(numbers["angle"])
    for k, (place, lift) in enumerate(numbers["lift"].items()):
        label = "untouched"
        if place is not None:
            label = f"earlier at x = {1e3 * place:g} mm"
        ax.plot(angle, lift, lw=1.0, label=label, **style.curve_look(k, len(angle)))
    ax.set(xlabel="angle of the leg (degrees)", ylabel="lift (N)")
    style.draw_legend_above(ax, 2)


if __name__ == "__main__":
    main("ground_effects", compute, draw, table)
