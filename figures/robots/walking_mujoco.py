"""The engine of three dimensions: errors against steps and elements, and speeds
compared with the planar engine. The figure needs MuJoCo.

The errors are those of the progress of Xplorer in one stride of its limit cycle at 2
Hz, against the time steps per cycle, each of which is 16 steps of MuJoCo, and against
the elements of a leg. The speeds of the planar engine are computed with 96 steps and 48
elements.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft.terradynamics.walking import Tripod, Walker, engine

STUDY = {"steps": (8, 12, 16, 24, 32, 48, 64), "elements": (4, 6, 8, 12, 16, 24)}
FINEST = {"steps": 256, "elements": 96}
FINE = {"steps": 96, "elements": 48}  # of the planar engine
ORDERS = {"steps": 1, "elements": 2}
FREQUENCY = 2.0
MOST_STRIDES = 6  # strides, at most, to the limit cycle
FREQUENCIES = {
    "Xplorer": (1.0, 2.0, 3.0, 4.0),
    "SandBot": tuple(np.array([2.0, 4.0, 6.0, 8.0]) / (2 * np.pi)),
}


def simulation(**numerics):
    """Return the walk of Xplorer with other numerics, not begun yet."""
    # MuJoCo is an extra, and heavy.
    from rft.terradynamics.walking.mujoco_walk import Simulation

    scene = load("xplorer")
    walker = Walker(scene.robot, Tripod(FREQUENCY), scene.medium)
    return Simulation(walker, dataclasses.replace(scene.numerics, **numerics))


def stride_length(start, **numerics) -> float:
    """Return the distance of one stride from a state, m."""
    walk = simulation(**numerics).walk(1, start=start)
    return float(walk.pose[-1, 0] - walk.pose[0, 0])


def compute(study=STUDY, finest=FINEST, frequencies=FREQUENCIES, fine=FINE) -> dict:
    """Return {"errors": {setting: (values, error of the stride over it)}, "speeds":
    {robot: (frequencies, planar, MuJoCo)}}, Hz, m/s."""
    start = simulation().walk(MOST_STRIDES).limit
    errors = {}
    for setting, values in study.items():
        reference = stride_length(start, **{setting: finest[setting]})
        lengths = [stride_length(start, **{setting: value}) for value in values]
        errors[setting] = (values, np.abs(np.array(lengths) / reference - 1))
    speeds = {}
    for robot, of_robot in frequencies.items():
        planar, full = mean_speeds(load(robot.lower()), of_robot, fine)
        speeds[robot] = (of_robot, planar, full)
    return {"errors": errors, "speeds": speeds}


def mean_speeds(scene, frequencies, fine: dict) -> tuple[np.ndarray, np.ndarray]:
    """Return mean speeds (F,), m/s, at frequencies, Hz, by the planar engine with the
    numerics ``fine``, and by MuJoCo."""
    walkers = []
    for frequency in frequencies:
        gait = dataclasses.replace(scene.gait, frequency=float(frequency))
        walkers.append(dataclasses.replace(scene.walker, gait=gait))
    fine_numerics = dataclasses.replace(scene.numerics, **fine)
    planar = engine("planar").walk(walkers, fine_numerics, 3)
    full = engine("mujoco").walk(walkers, scene.numerics, 3)
    planar_speeds = np.array([walk.speed for walk in planar])
    return planar_speeds, np.array([walk.speed for walk in full])


@plots.styled
def draw(numbers: dict):
    """Draw errors at the left, and speeds by both engines, a panel for each robot."""
    fig, axes = plots.figure(8.4, 2.8, 1 + len(numbers["speeds"]))
    draw_errors(axes[0, 0], numbers["errors"])
    for ax, (robot, speeds) in zip(axes[0, 1:], numbers["speeds"].items()):
        draw_speeds(ax, robot, *speeds)
    return fig


def draw_errors(ax, errors: dict) -> None:
    """Draw the error of a stride against steps and elements, with lines of the declared
    orders."""
    looks = {"steps": ("o-", style.BLUE), "elements": ("s-", style.VERMILION)}
    for setting, (values, error) in errors.items():
        line, colour = looks[setting]
        ax.loglog(values, error, line, color=colour, lw=1.0, label=setting)
        style.draw_order_line(ax, values, error, ORDERS[setting])
    ax.set(xlabel="steps of a cycle, elements", ylabel="error of the way")
    ax.set_xticks([4, 8, 16, 32, 64], ["4", "8", "16", "32", "64"])
    ax.set_xticks([], minor=True)
    ax.legend(loc="best", fontsize=7)


def draw_speeds(ax, robot: str, frequencies, planar, full) -> None:
    """Draw the speeds of a robot by the planar engine and by MuJoCo."""
    ax.plot(frequencies, planar, color=style.BLACK, label="planar")
    ax.plot(frequencies, full, "o", color=style.BLUE, ms=5, label="MuJoCo")
    ax.set(xlabel="frequency (Hz)", ylabel="speed (m/s)", ylim=(0, None))
    largest = 100 * np.abs(full / planar - 1).max()
    ax.set_title(f"{robot}: within {largest:.1f} %")
    ax.legend(loc="best")


if __name__ == "__main__":
    main("walking_mujoco", compute, draw)
