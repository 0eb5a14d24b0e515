"""Screws in sand by the law of three dimensions: what one pulls against slip, and how
craft on two of them go.

The craft is that of the built-in scene ``screws``; it and its sand are assumed. Lines
are the balance in the mean over a turn, without inertia
(`rft.terradynamics.walking.cruise`); circles and paths are MuJoCo's. Axes are a third
of the blade's radius out of the ground, at the surface, or so far under it.
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
PATHS = {
    ("mirrored", 1.0): 10,
    ("alike", 2.5): 10,
    ("alike", 1.0): 4,
}  # turns that are shown


def compute(
    slips: int = 49,
    pitches=PITCHES,
    tried=(0.03, 0.06, 0.12),
    fineness: Fineness | None = None,
) -> dict:
    """Return what a screw pulls, how far craft advance a turn, and their paths.

    slip, pulled {height: Turning}; pitch, advance {mass: (P,)}, m a turn; found (T,):
    MuJoCo's at the pitches ``tried`` with the scene's mass; paths {(pair, mass):
    (time, x, y, Cruise)}, s and m.
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

    pulled = {}
    for height in HEIGHTS:
        screw = scene.robot.screw
        pulled[height] = turning(scene.medium, screw, height, slip, triangles=triangles)
    advance = {}
    for mass in MASSES:
        advances = [balance(robot(mass, pitch)).advance for pitch in pitches]
        advance[mass] = np.array(advances)
    speeds = [walk(robot(scene.robot.mass, pitch)).speed for pitch in tried]
    paths = {}
    for (pair, mass), turns in PATHS.items():
        craft = dataclasses.replace(scene.robot, pair=pair, mass=mass)
        path = walk(craft)
        shown = path.t * frequency <= turns + 1e-9
        paths[pair, mass] = (
            turns / frequency,
            path.pose[shown, 0],
            path.spatial["y"][shown],
            balance(craft),
        )
    return {
        "slip": slip,
        "pulled": pulled,
        "pitch": np.array(pitches),
        "advance": advance,
        "tried": np.array(tried),
        "found": np.array([speed / frequency for speed in speeds]),
        "paths": paths,
    }


def table(numbers: dict) -> str:
    """Return what MuJoCo finds beside the balance."""
    lines = []
    by_balance = np.interp(numbers["tried"], numbers["pitch"], numbers["advance"][1.0])
    for p, found, expected in zip(numbers["tried"], numbers["found"], by_balance):
        lines.append(
            f"pitch {p:g} m: advance {found:.4g} m a turn by MuJoCo, {expected:.4g} by the balance"
        )
    for (pair, mass), (time, x, y, steady) in numbers["paths"].items():
        lines.append(
            f"{pair}, {mass:g} kg, {time:g} s: to ({x[-1]:.4g}, {y[-1]:.4g}) m; {steady.velocity} m/s by balance"
        )
    return "\n".join(lines)


@plots.styled
def draw(numbers: dict):
    fig, ((thrust, advance), (torque, path)) = plots.figure(7.4, 5.6, 2, 2)
    for (height, pulled), colour in zip(
        numbers["pulled"].items(), style.shades(len(numbers["pulled"]))
    ):
        thrust.plot(
            numbers["slip"], pulled.thrust, color=colour, label=height_text(height)
        )
        torque.plot(numbers["slip"], 1e3 * pulled.torque, color=colour)
    style.zero_line(thrust)
    thrust.set(xlabel="slip", ylabel="thrust (N)", title="one screw")
    thrust.legend(title="axis", alignment="left")
    torque.set(xlabel="slip", ylabel="torque (mN m)", ylim=(0.0, None))
    pitch = 1e3 * numbers["pitch"]
    colours = dict(zip(numbers["advance"], style.shades(len(numbers["advance"]))))
    for mass, found in numbers["advance"].items():
        advance.plot(pitch, 1e3 * found, color=colours[mass], label=f"{mass:g} kg")
    dots = {
        "color": colours[1.0],
        "ls": "",
        "marker": "o",
        "mfc": "white",
        "label": "1 kg, MuJoCo",
    }
    advance.plot(1e3 * numbers["tried"], 1e3 * numbers["found"], **dots)
    advance.plot(pitch, pitch, **style.GUIDE, ls=":", label="as in a nut")
    top = 1.9e3 * max(np.nanmax(found) for found in numbers["advance"].values())
    advance.set(
        xlabel="pitch (mm)",
        ylabel="advance a turn (mm)",
        title="craft on two",
        ylim=(0.0, top),
    )
    advance.legend()
    shades = style.shades(len(numbers["paths"]))
    for ((pair, mass), (time, x, y, steady)), colour in zip(
        numbers["paths"].items(), shades
    ):
        path.plot(
            1e2 * x, 1e2 * y, color=colour, label=f"{pair}, {mass:g} kg, {time:g} s"
        )
        arc = se2.exp(
            np.linspace(0.0, time, 200)[:, None] * [*steady.velocity, steady.yaw_rate]
        )
        path.plot(1e2 * arc[:, 0], 1e2 * arc[:, 1], "--", lw=0.8, color=colour)
    style.entry(path, "by balance", ls="--", lw=0.8)
    path.set(xlabel="$x$ (cm)", ylabel="$y$ (cm), to the left", aspect="equal")
    path.legend(loc="lower right")
    return fig


def height_text(height: float) -> str:
    """Return the height of an axis over the surface, m, in words."""
    if height == 0:
        return "at the surface"
    side = "above" if height > 0 else "below"
    return f"{abs(1e3 * height):.0f} mm {side}"


if __name__ == "__main__":
    main("screws", compute, draw, table)
