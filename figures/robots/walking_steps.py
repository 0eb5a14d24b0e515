"""Step size of the planar engine: progress of Xplorer from rest at 1 and 3 Hz, by
implicit and by explicit steps.

The law of stress jumps at rest like dry friction, and the numerics round it at a given
speed. Explicit steps (Heun's method, also of order 2) chatter across the jump until
they resolve the rounding; implicit steps need not resolve it. Below: residual of the
balance of energy, which is the work of the motors minus the loss in the ground minus
the change of the energy of the body.
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
FREQUENCIES = (1.0, 3.0)  # Hz
CYCLES = 1.5  # from rest
FARTHEST = 10.0  # m, from which on a robot counts as thrown off


def heun(robots, state: State, phase: float, rate_phase: float, dt: float) -> State:
    """Return the state after one explicit step of order 2, with the arguments of
    `step`, for comparison: no walk is computed by it."""

    def slope(state: State, phase: float) -> State:
        angle, rate = robots.leg_motion(np.array([phase]), rate_phase)
        acceleration, motor_power, ground_power = robots.accelerations(
            state.pose[None], state.twist[None], angle, rate
        )
        sums = np.zeros((3, 1))  # of unsolved steps: there are none
        return State(
            state.twist, acceleration[0], motor_power[0], ground_power[0], *sums
        )

    start_slope = slope(state, phase)
    end = State(*(x + dt * dx for x, dx in zip(state, start_slope)))
    end_slope = slope(end, phase + dt * robots.frequency[0, 0])
    slopes = zip(state, start_slope, end_slope)
    return State(*(x + dt * (dx + dy) / 2 for x, dx, dy in slopes))


METHODS = {"implicit": step, "explicit": heun}


def progress(
    frequency: float, steps: int, method: str, cycles: float = CYCLES
) -> tuple[float, float]:
    """Return the distance, m, and the residual of the balance of energy over the work,
    after some cycles from rest; both infinite for a robot that is thrown off."""
    scene = load("xplorer")
    walker = Walker(scene.robot, Tripod(frequency), scene.medium)
    robots = batch_strides([walker], scene.numerics).robots
    take_step = METHODS[method]
    dt = 1 / (steps * frequency)
    start = robots.start()
    state = start
    for k in range(round(cycles * steps)):
        phase = k / steps
        state = take_step(robots, state, phase, phase + 0.5 / steps, dt)
        place = state.pose[0, :2]
        if not np.isfinite(state.pose).all() or np.abs(place).max() > FARTHEST:
            return np.inf, np.inf
    residual = state.work - state.loss - robots.energy(state) + robots.energy(start)
    return state.pose[0, 0], abs(residual[0] / state.work[0])


def compute(steps=STEPS, finest: int = FINEST, frequencies=FREQUENCIES) -> dict:
    """Return {frequency: {method: (steps, error of the distance over it, residual of
    the energy's balance)}}."""
    numbers: dict = {}
    for frequency in frequencies:
        reference, _ = progress(frequency, finest, "implicit")
        numbers[frequency] = {}
        for method, counts in steps.items():
            runs = [progress(frequency, count, method) for count in counts]
            distance, residual = np.array(runs).T
            error = np.abs(distance / reference - 1)
            numbers[frequency][method] = (counts, error, residual)
    return numbers


@plots.styled
def draw(numbers: dict):
    """Draw a column for each frequency: errors above, residuals below."""
    fig, axes = plots.figure(7.2, 4.8, len(numbers), 2)
    for column, (frequency, methods) in zip(axes.T, numbers.items()):
        error_ax, residual_ax = column
        draw_convergence(error_ax, methods, 1, "error of the progress")
        draw_convergence(residual_ax, methods, 2, "energy not accounted for")
        error_ax.set_title(f"{frequency:g} Hz")
    style.draw_legend_right(axes[0, -1])
    return fig


def draw_convergence(ax, methods: dict, k: int, label: str) -> None:
    """Draw entry k of each method against the steps of a cycle, with a line of order
    2."""
    looks = {"implicit": ("o-", style.BLUE), "explicit": ("s-", style.VERMILION)}
    for method, entries in methods.items():
        line, colour = looks[method]
        values = np.where(np.isfinite(entries[k]), entries[k], np.nan)
        ax.loglog(entries[0], values, line, color=colour, lw=1.0, label=method)
    implicit = methods["implicit"]
    style.draw_order_line(ax, implicit[0], implicit[k], 2)
    ax.set(xlabel="steps of a cycle", ylabel=label)
    style.draw_grid(ax)


if __name__ == "__main__":
    main("walking_steps", compute, draw)
