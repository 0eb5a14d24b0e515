"""The engine of three dimensions: its errors by steps and elements, and its speeds
against the planar engine's. Needs MuJoCo.

Xplorer's progress in a stride of its limit cycle at 2 Hz, against the time steps of a
cycle, of which each is 16 of MuJoCo's, and against the elements of a leg. The speeds of
the planar engine are those of 96 steps and 48 elements.
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


def _simulation(**numerics):
    """Return the walk of Xplorer with other numerics, not begun yet."""
    from rft.terradynamics.walking.mujoco_walk import Simulation

    scene = load("xplorer")
    walker = Walker(scene.robot, Tripod(FREQUENCY), scene.medium)
    return Simulation(walker, dataclasses.replace(scene.numerics, **numerics))


def stride_length(start, **numerics) -> float:
    """Return the progress in one stride from a state, m."""
    walk = _simulation(**numerics).walk(1, start=start)
    return float(walk.pose[-1, 0] - walk.pose[0, 0])


def compute(study=STUDY, finest=FINEST, frequencies=FREQUENCIES, fine=FINE) -> dict:
    """Return {"errors": {setting: (values, error of the way over it)}, "speeds":
    {robot: (frequencies, planar, MuJoCo)}}, Hz, m/s."""
    start = _simulation().walk(MOST_STRIDES).limit
    errors = {}
    for name, values in study.items():
        truth = stride_length(start, **{name: finest[name]})
        ways = np.array([stride_length(start, **{name: k}) for k in values])
        errors[name] = values, np.abs(ways / truth - 1)
    speeds = {}
    for name, chosen in frequencies.items():
        scene = load(name.lower())
        walkers = [
            dataclasses.replace(
                scene.walker, gait=dataclasses.replace(scene.gait, frequency=float(f))
            )
            for f in chosen
        ]
        finely = dataclasses.replace(scene.numerics, **fine)
        planar = engine("planar").walk(walkers, finely, 3)
        full = engine("mujoco").walk(walkers, scene.numerics, 3)
        speeds[name] = (
            chosen,
            *(np.array([w.speed for w in x]) for x in (planar, full)),
        )
    return {"errors": errors, "speeds": speeds}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.4, 2.8, 1 + len(numbers["speeds"]))
    ax = axes[0, 0]
    looks = {"steps": ("o-", style.BLUE), "elements": ("s-", style.VERMILION)}
    for name, (values, error) in numbers["errors"].items():
        line, colour = looks[name]
        ax.loglog(values, error, line, color=colour, lw=1.0, label=name)
        style.order_line(ax, values, error, ORDERS[name])
    ax.set(xlabel="steps of a cycle, elements", ylabel="error of the way")
    ax.set_xticks([4, 8, 16, 32, 64], ["4", "8", "16", "32", "64"])
    ax.set_xticks([], minor=True)
    ax.legend(loc="best", fontsize=7)
    for ax, (name, (frequency, planar, full)) in zip(
        axes[0, 1:], numbers["speeds"].items()
    ):
        ax.plot(frequency, planar, color=style.BLACK, label="planar")
        ax.plot(frequency, full, "o", color=style.BLUE, ms=5, label="MuJoCo")
        ax.set(xlabel="frequency (Hz)", ylabel="speed (m/s)", ylim=(0, None))
        ax.set_title(f"{name}: within {100 * np.abs(full / planar - 1).max():.1f} %")
        ax.legend(loc="best")
    return fig


if __name__ == "__main__":
    main("walking_mujoco", compute, draw)
