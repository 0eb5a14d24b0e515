"""Screws in sand: thrust of a screw against slip by the law of three dimensions, and
the paths of craft on two screws.

The craft is that of the built-in scene ``screws``; the craft and its sand are assumed.
Lines are the balance of the mean forces over a turn, without inertia
(`rft.terradynamics.walking.cruise`). Circles and paths are computed with MuJoCo. The
axes of single screws are above the surface, at it and below it.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft.formulas import se2
from rft.terradynamics.walking import Fineness, Walker, cruise, engine, turning
from rft.terradynamics.walking.craft import PER_SQUARE

HEIGHTS = (0.01, 0.0, -0.01, -0.03)  # m, of the axis over the surface
MASSES = (0.5, 1.0, 2.0)  # kg
PITCHES = (0.02, 0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.2, 0.24)  # m
# Turns that are drawn, by the pair of screws and the mass, kg.
PATHS = {("mirrored", 1.0): 10, ("alike", 2.5): 10, ("alike", 1.0): 4}


def compute(
    slips: int = 49,
    pitches=PITCHES,
    mujoco_pitches=(0.03, 0.06, 0.12),
    fineness: Fineness | None = None,
) -> dict:
    """Return the pull of a screw, the advance of craft per turn, and their paths.

    slip, turning {height: Turning}; pitch, advance {mass: (P,)}, m per turn;
    mujoco_pitch, mujoco_advance (T,): MuJoCo's with the scene's mass; paths {(pair,
    mass): (time, x, y, Cruise)}, s and m.
    """
    scene = load("screws")
    slip = np.linspace(-0.2, 1.0, slips)
    fineness = fineness or scene.numerics
    triangles = PER_SQUARE * fineness.elements**2
    frequency = scene.gait.frequency

    def robot(mass: float, pitch: float):
        screw = dataclasses.replace(scene.robot.screw, pitch=pitch)
        return dataclasses.replace(scene.robot, mass=mass, screw=screw)

    def walk(robot):
        walker = Walker(robot, scene.gait, scene.medium)
        return engine("mujoco").walk([walker], fineness)[0]

    def balance(robot):
        return cruise(scene.medium, robot, frequency, triangles)

    by_height = {}
    for height in HEIGHTS:
        screw = scene.robot.screw
        by_height[height] = turning(
            scene.medium, screw, height, slip, triangles=triangles
        )
    advance = {}
    for mass in MASSES:
        advances = [balance(robot(mass, pitch)).advance for pitch in pitches]
        advance[mass] = np.array(advances)
    speeds = [walk(robot(scene.robot.mass, pitch)).speed for pitch in mujoco_pitches]

    paths = {}
    for (pair, mass), turns in PATHS.items():
        craft = dataclasses.replace(scene.robot, pair=pair, mass=mass)
        path = walk(craft)
        is_drawn = path.t * frequency <= turns + 1e-9
        paths[pair, mass] = (
            turns / frequency,
            path.pose[is_drawn, 0],
            path.spatial["y"][is_drawn],
            balance(craft),
        )
    return {
        "slip": slip,
        "turning": by_height,
        "pitch": np.array(pitches),
        "advance": advance,
        "mujoco_pitch": np.array(mujoco_pitches),
        "mujoco_advance": np.array([speed / frequency for speed in speeds]),
        "paths": paths,
    }


def table(numbers: dict) -> str:
    """Return MuJoCo's numbers next to those of the balance."""
    lines = []
    pitches = numbers["mujoco_pitch"]
    by_balance = np.interp(pitches, numbers["pitch"], numbers["advance"][1.0])
    for pitch, full, steady in zip(pitches, numbers["mujoco_advance"], by_balance):
        lines.append(
            f"pitch {pitch:g} m: advance {full:.4g} m a turn by MuJoCo,"
            f" {steady:.4g} by the balance"
        )
    for (pair, mass), (time, x, y, steady) in numbers["paths"].items():
        lines.append(
            f"{pair}, {mass:g} kg, {time:g} s: to ({x[-1]:.4g}, {y[-1]:.4g}) m;"
            f" {steady.velocity} m/s by balance"
        )
    return "\n".join(lines)


@plots.styled
def draw(numbers: dict):
    """Draw thrust and torque of a screw at the left, advance and paths of craft at the
    right."""
    fig, ((thrust_ax, advance_ax), (torque_ax, path_ax)) = plots.figure(7.4, 5.6, 2, 2)
    draw_screw(thrust_ax, torque_ax, numbers)
    draw_advance(advance_ax, numbers)
    draw_paths(path_ax, numbers["paths"])
    return fig


def draw_screw(thrust_ax, torque_ax, numbers: dict) -> None:
    """Draw thrust and torque against slip at each height of the axis."""
    slip = numbers["slip"]
    shades = style.shades(len(numbers["turning"]))
    for (height, screw), shade in zip(numbers["turning"].items(), shades):
        thrust_ax.plot(slip, screw.thrust, color=shade, label=height_text(height))
        torque_ax.plot(slip, 1e3 * screw.torque, color=shade)
    style.draw_zero_line(thrust_ax)
    thrust_ax.set(xlabel="slip", ylabel="thrust (N)", title="one screw")
    thrust_ax.legend(title="axis", alignment="left")
    torque_ax.set(xlabel="slip", ylabel="torque (mN m)", ylim=(0.0, None))


def draw_advance(ax, numbers: dict) -> None:
    """Draw the advance per turn against the pitch, for each mass."""
    pitch = 1e3 * numbers["pitch"]
    colours = dict(zip(numbers["advance"], style.shades(len(numbers["advance"]))))
    for mass, advance in numbers["advance"].items():
        ax.plot(pitch, 1e3 * advance, color=colours[mass], label=f"{mass:g} kg")
    dots = {"color": colours[1.0], "ls": "", "marker": "o", "mfc": "white"}
    mujoco_pitch = 1e3 * numbers["mujoco_pitch"]
    mujoco_advance = 1e3 * numbers["mujoco_advance"]
    ax.plot(mujoco_pitch, mujoco_advance, label="1 kg, MuJoCo", **dots)
    ax.plot(pitch, pitch, **style.GUIDE, ls=":", label="as in a nut")
    largest = max(np.nanmax(advance) for advance in numbers["advance"].values())
    ax.set(xlabel="pitch (mm)", ylabel="advance a turn (mm)", title="craft on two")
    ax.set(ylim=(0.0, 1.9e3 * largest))
    ax.legend()


def draw_paths(ax, paths: dict) -> None:
    """Draw paths by MuJoCo solid, and arcs by the balance dashed."""
    shades = style.shades(len(paths))
    for ((pair, mass), path), shade in zip(paths.items(), shades):
        time, x, y, steady = path
        label = f"{pair}, {mass:g} kg, {time:g} s"
        ax.plot(1e2 * x, 1e2 * y, color=shade, label=label)
        t = np.linspace(0.0, time, 200)[:, None]
        arc = se2.exp(t * [*steady.velocity, steady.yaw_rate])
        ax.plot(1e2 * arc[:, 0], 1e2 * arc[:, 1], "--", lw=0.8, color=shade)
    style.add_entry(ax, "by balance", ls="--", lw=0.8)
    ax.set(xlabel="$x$ (cm)", ylabel="$y$ (cm), to the left", aspect="equal")
    ax.legend(loc="lower right")


def height_text(height: float) -> str:
    """Return the height of an axis over the surface, m, in words."""
    if height == 0:
        return "at the surface"
    side = "above" if height > 0 else "below"
    return f"{abs(1e3 * height):.0f} mm {side}"


if __name__ == "__main__":
    main("screws", compute, draw, table)
