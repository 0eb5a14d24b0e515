"""Xplorer and SandBot on sandy slopes, in loose poppy seeds. The figure needs MuJoCo.

Left: speed in the plane against the slope by the planar engine, and by MuJoCo with the
robot kept in the plane; free to turn, Xplorer turns downhill. Middle and right: speed
and slip of Xplorer against slope and frequency by the planar engine, with the outcomes
of `geomech.studies.terradynamics.outcome`.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main, style
from geomech import plots, sweep
from geomech.scenes import load
from geomech.studies.terradynamics import walking
from rft.terradynamics.ground import Slope

ANGLES = (-10, -5, 0, 5, 8, 10, 12, 15, 20, 25)  # degrees
FREQUENCIES = (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0)  # Hz
MAPPED = (-15, -10, -5, 0, 5, 10, 15, 20, 25, 30, 35)  # degrees
FINE = {"steps": 64, "elements": 24}
ROBOTS = ("Xplorer", "SandBot")
STRIDES = 14  # at most, to the limit cycle


def on_slope(scene, degrees: float):
    """Return a scene whose ground rises by an angle, degrees."""
    return dataclasses.replace(scene, effects=(Slope(np.radians(degrees)),))


def compute(angles=ANGLES, frequencies=FREQUENCIES, mapped=MAPPED, fine=FINE) -> dict:
    """Return angles (A,), degrees; speeds {robot: (by the planar engine, by MuJoCo)},
    m/s; and the sweep of Xplorer over slope and frequency."""
    # MuJoCo is an extra, and heavy.
    from rft.terradynamics.walking.mujoco_walk import Simulation

    speeds = {}
    for robot in ROBOTS:
        scene = load(robot.lower())
        numerics = dataclasses.replace(scene.numerics, **fine)
        scenes = [
            dataclasses.replace(on_slope(scene, x), numerics=numerics) for x in angles
        ]
        planar = [one.walk.speed for one in walking.walked(scenes, settling=True)]
        full = [
            Simulation(one.walker, numerics, planar=True).walk(STRIDES).speed
            for one in scenes
        ]
        speeds[robot] = (np.array(planar), np.array(full))
    over = {
        "effects.slope.angle_deg": list(map(float, mapped)),
        "gait.frequency": list(frequencies),
    }
    swept = sweep(load("xplorer-slope"), over)
    return {"angles": np.array(angles), "speeds": speeds, "swept": swept}


@plots.styled
def draw(numbers: dict):
    """Draw speeds by both engines, and the maps of speed and slip."""
    fig, axes = plots.figure(9.6, 3.2, 3)
    ax, *maps = axes[0]
    for (robot, speeds), colour in zip(
        numbers["speeds"].items(), (style.BLUE, style.VERMILION)
    ):
        planar, full = speeds
        ax.plot(numbers["angles"], planar, color=colour, label=robot)
        ax.plot(numbers["angles"], full, "o", color=colour, ms=4, label="MuJoCo")
    ax.axhline(0.0, color="0.6", lw=0.6)
    ax.set(xlabel="slope (degrees)", ylabel="speed (m/s)")
    ax.legend(loc="best", fontsize=7)
    names = plots.draw_maps_of_walks(maps, numbers["swept"], ("speed", "slip"))
    fig.legend(*names, loc="outside upper right", ncols=6, fontsize=7)
    return fig


if __name__ == "__main__":
    main("walking_slopes", compute, draw)
