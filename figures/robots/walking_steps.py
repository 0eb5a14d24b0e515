"""The step-size study of the planar engine: Xplorer's progress from rest at 1 and 3 Hz
by implicit and by explicit steps.

The law of stress jumps at rest like dry friction and is rounded at a named speed.
Explicit steps (Heun's, of order 2 as well) chatter across the jump until they resolve
the rounding; implicit ones need not. Below, the residual of the balance of energy: work
of the motors - loss in the ground - change of the body's energy.
"""

from __future__ import annotations

import numpy as np

from figures import main, style
from geomech import plots
from geomech.scenes import load
from rft.terradynamics.walking import Tripod, Walker
from rft.terradynamics.walking.planar.equations import State
from rft.terradynamics.walking.planar.march import step
from rft.terradynamics.walking.planar_walk import batch_strides

STEPS = {
    "implicit": (12, 24, 48, 96, 192, 384),
    "explicit": (96, 192, 384, 768, 1536, 3072),
}
FINEST = 1536
FREQUENCIES = (1.0, 3.0)


def heun(robots, state: State, phase: float, of: float, dt: float) -> State:
    """Take one explicit step, of order 2, for comparison: no walk is computed so."""

    def slope(at: State, where: float):
        a, motors, ground = robots.accelerations(
            at.pose[None], at.twist[None], *robots.leg_motion(np.array([where]), of)
        )
        return State(at.twist, a[0], motors[0], ground[0], *np.zeros((3, 1)))

    first = slope(state, phase)
    then = State(*(x + dt * y for x, y in zip(state, first)))
    second = slope(then, phase + dt * robots.frequency[0, 0])
    return State(*(x + dt * (y + z) / 2 for x, y, z in zip(state, first, second)))


def progress(frequency: float, steps: int, how: str, cycles: float = 1.5):
    """Return the progress, m, and the residual of the balance of energy over the work,
    after some cycles from rest."""
    scene = load("xplorer")
    robots = batch_strides(
        [Walker(scene.robot, Tripod(frequency), scene.medium)], scene.numerics
    ).robots
    state = first = robots.start()
    count = round(cycles * steps)
    for k in range(count):
        phase = k / steps
        dt = 1 / (steps * frequency)
        if how == "implicit":
            state = step(robots, state, phase, phase + 0.5 / steps, dt)
        else:
            state = heun(robots, state, phase, phase + 0.5 / steps, dt)
        if not np.isfinite(state.pose).all() or np.abs(state.pose[0, :2]).max() > 10.0:
            return np.inf, np.inf
    residual = state.work - state.loss - robots.energy(state) + robots.energy(first)
    return state.pose[0, 0], abs(residual[0] / state.work[0])


def compute(steps=STEPS, finest: int = FINEST, frequencies=FREQUENCIES) -> dict:
    """Return {frequency: {how: (steps, error of the progress over it, residual of the
    energy's balance)}}."""
    out = {}
    for f in frequencies:
        truth = progress(f, finest, "implicit")[0]
        out[f] = {
            how: (n, *np.array([progress(f, k, how) for k in n]).T)
            for how, n in steps.items()
        }
        out[f] = {
            how: (n, np.abs(x / truth - 1), residual)
            for how, (n, x, residual) in out[f].items()
        }
    return out


@plots.styled
def draw(numbers: dict):
    fig, axes = plots.figure(7.2, 4.8, len(numbers), 2)
    for column, (f, lines) in zip(axes.T, numbers.items()):
        for k, (ax, label) in enumerate(
            zip(column, ("error of the progress", "energy not accounted for")), 1
        ):
            for (how, found), line, colour in zip(
                lines.items(), ("o-", "s-"), (style.BLUE, style.VERMILION)
            ):
                values = np.where(np.isfinite(found[k]), found[k], np.nan)
                ax.loglog(found[0], values, line, color=colour, lw=1.0, label=how)
            style.order_line(ax, lines["implicit"][0], lines["implicit"][k], 2)
            ax.set(xlabel="steps of a cycle", ylabel=label)
            style.grid(ax)
        column[0].set_title(f"{f:g} Hz")
    style.legend_right(axes[0, -1])
    return fig


if __name__ == "__main__":
    main("walking_steps", compute, draw)
