"""The engine of three dimensions: its step-size study, and its speeds against those of the planar engine. Needs MuJoCo.

Xplorer's progress in a stride of its limit cycle at 2 Hz by implicit steps
(`rft.terradynamics.walking.multibody`), and by MuJoCo's own, with the grains' forces
held as they are at the start of each: these are of order 1, and go astray below some
200 steps a cycle.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft.terradynamics.walking import Tripod, Walker, engine

STEPS = {
    "implicit": (12, 16, 24, 32, 48, 64, 96, 128),
    "held": (128, 256, 512, 1024, 2048, 4096),
}
FINEST, FREQUENCY = 768, 2.0
MOST_STRIDES = 6  # strides, at most, to the limit cycle
HEAVY = 1e-4  # kg m^2, of a leg about its hip, where its forces are held: without, none of these steps stays finite
FREQUENCIES = {
    "Xplorer": (1.0, 2.0, 3.0, 4.0),
    "SandBot": tuple(np.array([2.0, 4.0, 6.0, 8.0]) / (2 * np.pi)),
}


def _simulation(steps: int):
    """Return the walk of Xplorer by so many steps a cycle, not begun yet."""
    from rft.terradynamics.walking.mujoco_walk import Simulation

    scene = load("xplorer")
    walker = Walker(scene.robot, Tripod(FREQUENCY), scene.medium)
    return Simulation(walker, dataclasses.replace(scene.numerics, steps=steps))


def stride_length(start, steps: int, how: str) -> float:
    """Return the progress in one stride from a state, m. how: "implicit", or "held" for MuJoCo's own steps."""
    import mujoco

    body, h = _simulation(steps).body, 1 / (FREQUENCY * steps)
    model, data = body.model, body.data
    data.qpos[:], data.qvel[:] = start
    mujoco.mj_forward(model, data)
    if how == "held":
        model.opt.timestep, model.opt.integrator = (
            h,
            int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST),
        )
        model.dof_armature[6:] = (
            HEAVY  # of what turns as it is told, and so feels nothing of it
        )
    for k in range(steps):
        if how == "implicit":
            body.step(h)
            continue
        data.qfrc_applied[:] = body._loads(0.0)[0]
        data.ctrl[:] = body.control((k + 1) * h, (k + 0.5) * h)
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        if data.warning[int(mujoco.mjtWarning.mjWARN_BADQACC)].number:
            return np.inf  # MuJoCo has begun anew
    return float(data.qpos[0] - start.qpos[0])


def compute(steps=STEPS, finest: int = FINEST, frequencies=FREQUENCIES) -> dict:
    """Return {"steps": {how: (steps, error of the way over it)}, "speeds": {robot: (frequencies, planar, MuJoCo)}}, Hz, m/s."""
    start = _simulation(64).walk(MOST_STRIDES).limit
    truth = stride_length(start, finest, "implicit")
    study = {
        how: (n, np.array([abs(stride_length(start, k, how) / truth - 1) for k in n]))
        for how, n in steps.items()
    }
    speeds = {}
    for name, chosen in frequencies.items():
        scene = load(name.lower())
        walkers = [
            dataclasses.replace(
                scene.walker, gait=dataclasses.replace(scene.gait, frequency=float(f))
            )
            for f in chosen
        ]
        each = (
            engine(how).walk(walkers, scene.numerics, 3) for how in ("planar", "mujoco")
        )
        speeds[name] = (chosen, *(np.array([w.speed for w in walks]) for walks in each))
    return {"steps": study, "speeds": speeds}


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(8.4, 2.8, 1 + len(numbers["speeds"]))
    ax = axes[0, 0]
    looks = {
        "implicit": ("o-", style.BLUE, "implicit"),
        "held": ("s-", style.VERMILION, "grains' forces held"),
    }
    for how, (steps, error) in numbers["steps"].items():
        line, colour, label = looks[how]
        ax.loglog(
            steps,
            np.where(np.isfinite(error), error, np.nan),
            line,
            color=colour,
            lw=1.0,
            label=label,
        )
    style.order_line(ax, *numbers["steps"]["implicit"], 2)
    ax.set(xlabel="steps of a cycle", ylabel="error of the way")
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
