"""Steps of a robot on flippers over ground that it disturbs, and speeds of SandBot on
c-legs, whose law of weakening was fixed before these walks were computed.

Above: progress in each of ten cycles with strokes of three depths, with a fixed and a
free wrist; progress in the last of them against depth for three sweeps. Below: the
same against the weakening, with half, once and twice the radius; speed of SandBot
against the rate of its legs, on ground of three strengths without and with prints.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft.terradynamics.plates import CLeg
from rft.terradynamics.walking import Fineness, PrintedGround, Tripod, Walker, engine

CYCLES = 10
WRISTS = ("fixed", "free")
DASHES = {"fixed": "-", "free": "--"}
SHOWN_DEPTHS = (0.02, 0.03, 0.04)  # m
DEPTHS = (0.01, 0.015, 0.02, 0.025, 0.03, 0.04)  # m
SWEEPS = (40, 80, 120)  # degrees
WEAKENINGS = (0.0, 0.2, 0.35, 0.5, 0.65, 0.8)
RADII = (0.5, 1.0, 2.0)  # of the scene's
ROUGH = Fineness(steps=32, elements=8)

LEGS = CLeg(radius=0.0355, width=0.02)  # of SandBot, assumed
RATES = (4.0, 8.0, 12.0, 16.0, 24.0)  # rad/s
STRENGTHS = (0.7, 1.0, 1.5)  # of the ground, over that of the scene
LEG_WEAKENING = 0.2
LEG_RADIUS = 0.02  # m, the width of a leg
LEG_CYCLES = 15


def flipper_steps(
    cycles: int,
    weakening: float,
    radius: float = 1.0,
    sweep: float | None = None,
    **sizes,
) -> np.ndarray:
    """Return the progress in each cycle (C,), m, 0 after the robot's end. radius: over
    that of the scene. sweep: degrees."""
    scene = load("flipper-robot")
    (effect,) = scene.effects
    ground = PrintedGround(radius * effect.radius, weakening)
    gait = scene.gait
    if sweep is not None:
        gait = dataclasses.replace(gait, sweep=math.radians(sweep))
    robot = dataclasses.replace(scene.robot, **sizes)
    walker = Walker(robot, gait, scene.medium, (ground,))
    (walk,) = engine("mujoco").walk([walker], ROUGH, cycles)
    lengths = np.zeros(cycles)
    lengths[: len(walk.step_length)] = walk.step_length
    return lengths


def sandbot_speed(rate: float, strength: float, weakening: float) -> float:
    """Return the speed of SandBot on c-legs, m/s."""
    scene = load("sandbot")
    robot = dataclasses.replace(scene.robot, legs=LEGS, axle=0.0)
    medium = dataclasses.replace(scene.medium, zeta=strength * scene.medium.zeta)
    effects = (PrintedGround(LEG_RADIUS, weakening),) if weakening else ()
    walker = Walker(robot, Tripod(rate / (2 * math.pi)), medium, effects)
    (walk,) = engine("planar").walk([walker], Fineness(), LEG_CYCLES)
    return walk.speed


def compute(
    cycles: int = CYCLES,
    shown: tuple = SHOWN_DEPTHS,
    depths: tuple = DEPTHS,
    sweeps: tuple = SWEEPS,
    weakenings: tuple = WEAKENINGS,
    radii: tuple = RADII,
    rates: tuple = RATES,
    strengths: tuple = STRENGTHS,
) -> dict:
    """Return progress by wrist and depth, sweep or radius, and speeds of SandBot by
    strength and weakening, with the values that they belong to."""
    weakening = load("flipper-robot").effects[0].weakening
    steps = {}
    by_depth = {}
    by_weakening = {}
    for wrist in WRISTS:
        for depth in shown:
            steps[wrist, depth] = flipper_steps(
                cycles, weakening, wrist=wrist, depth=depth
            )
        for sweep in sweeps:
            by_depth[wrist, sweep] = [
                flipper_steps(cycles, weakening, sweep=sweep, wrist=wrist, depth=depth)
                for depth in depths
            ]
        for radius in radii:
            by_weakening[wrist, radius] = [
                flipper_steps(cycles, one, radius, wrist=wrist) for one in weakenings
            ]
    speeds = {}
    for strength in strengths:
        for one in (0.0, LEG_WEAKENING):
            speeds[strength, one] = [
                sandbot_speed(rate, strength, one) for rate in rates
            ]
    return {
        "cycles": np.arange(1, cycles + 1),
        "depths": np.array(depths),
        "weakenings": np.array(weakenings),
        "rates": np.array(rates),
        "steps": steps,
        "by depth": by_depth,
        "by weakening": by_weakening,
        "speeds": speeds,
    }


@plots.styled
def draw(numbers: dict):
    """Draw the four panels."""
    fig, axes = plots.figure(8.4, 5.6, 2, 2)
    for (wrist, depth), lengths in numbers["steps"].items():
        look = line_look(wrist, SHOWN_DEPTHS.index(depth))
        label = f"{1e3 * depth:g} mm deep, {wrist}"
        axes[0, 0].plot(numbers["cycles"], 1e3 * lengths, **look, label=label)
    axes[0, 0].set(xlabel="cycle", ylabel="progress (mm)")
    x = 1e3 * numbers["depths"]
    draw_last(axes[0, 1], x, numbers["by depth"], SWEEPS, "{:g} degrees")
    axes[0, 1].set(xlabel="depth (mm)", ylabel="progress in the end (mm)")
    x = numbers["weakenings"]
    draw_last(axes[1, 0], x, numbers["by weakening"], RADII, "radius x {:g}")
    axes[1, 0].set(xlabel="weakening", ylabel="progress in the end (mm)")
    for (strength, weakening), speeds in numbers["speeds"].items():
        colour = style.SEQUENCE[STRENGTHS.index(strength)]
        dashes = "--" if weakening else "-"
        label = f"ground x {strength:g}, weakening {weakening:g}"
        y = 100 * np.array(speeds)
        axes[1, 1].semilogy(numbers["rates"], y, dashes, color=colour, label=label)
    axes[1, 1].set(xlabel="rate of SandBot's legs (rad/s)", ylabel="speed (cm/s)")
    for ax in axes.ravel():
        style.draw_legend_right(ax)
    return fig


def draw_last(ax, x, runs: dict, values: tuple, words: str) -> None:
    """Draw the progress of the last three cycles against x, a line for each wrist and
    value."""
    for (wrist, value), lengths in runs.items():
        last = [1e3 * run[-3:].mean() for run in lengths]
        label = f"{words.format(value)}, {wrist}"
        ax.plot(x, last, **line_look(wrist, values.index(value)), label=label)


def line_look(wrist: str, k: int) -> dict:
    """Return the look of a line for a wrist and the value number k."""
    return {"color": style.SEQUENCE[k], "ls": DASHES[wrist], "lw": 1.0}


def table(numbers: dict) -> str:
    """Return the numbers as lines: progress in mm in the first cycles and the last, and
    speeds in cm/s."""
    lines = []
    for (wrist, sweep), runs in numbers["by depth"].items():
        for depth, run in zip(numbers["depths"], runs):
            shown = ", ".join(f"{1e3 * x:.1f}" for x in (*run[:3], run[-1]))
            lines.append(f"{wrist}, {sweep} degrees, {1e3 * depth:g} mm: {shown}")
    for (wrist, radius), runs in numbers["by weakening"].items():
        shown = ", ".join(f"{1e3 * run[-3:].mean():.1f}" for run in runs)
        lines.append(f"{wrist}, radius x {radius:g}, weakenings: {shown}")
    for (strength, weakening), speeds in numbers["speeds"].items():
        shown = ", ".join(f"{100 * x:.1f}" for x in speeds)
        lines.append(f"SandBot, ground x {strength:g}, {weakening:g}: {shown}")
    return "\n".join(lines)


if __name__ == "__main__":
    main("flipper_steps", compute, draw, table)
