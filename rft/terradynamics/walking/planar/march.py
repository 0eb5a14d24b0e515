"""Time steps of many robots at once, each at its own rate
(`rft.terradynamics.walking.planar.sdirk`).

Steps end where the clock's rate jumps. Robots that stick take ten times as many
iterations as robots that slip. So no robot waits for another: each evaluation of forces
is a batch of all robots under way, every one in its own step, stage and iteration."""

from __future__ import annotations

from typing import Any

import numpy as np

from rft.balance.backend import compiles
from rft.formulas.vectors import gather
from rft.terradynamics.walking.planar.equations import Robots, State
from rft.terradynamics.walking.planar.sdirk import (
    EFFORT,
    GAMMA,
    TOLERANCE,
    Effort,
    Step,
    has_ended,
    newton_step,
    next_problem,
    stage_time,
    start_of_step,
)

# End heights of `rft.terradynamics.walking.planar.sdirk.has_ended` that no robot
# reaches.
NO_END = (np.inf, np.inf)


def march(
    robots: Robots,
    index,
    state: State,
    phases,
    rate_phases,
    end_heights=NO_END,
    shares=None,
) -> tuple[State, np.ndarray]:
    """Return the states after every step (S, B) of the robots ``index`` from a state,
    and the number of evaluations of forces for each (B,).

    The steps go from phase to phase (S + 1,), in cycles. In each the legs rotate at the
    rates of the clock at ``rate_phases`` (S,), which determine the side of a kink.
    end_heights: as for `rft.terradynamics.walking.planar.sdirk.has_ended`; a robot at
    an end stays there. shares: (B, legs), of the force of undisturbed ground on each
    leg; by default all of it."""
    index = np.asarray(index)
    phases = np.asarray(phases)
    starts = np.broadcast_to(phases[:-1, None], (len(rate_phases), len(index)))
    angles, rates = robots.leg_motion(
        starts, np.broadcast_to(np.asarray(rate_phases)[:, None], starts.shape), index
    )
    lengths = np.diff(phases)[:, None] / robots.frequency[index, 0]
    end_heights = np.stack([np.broadcast_to(x, len(index)) for x in end_heights])

    if compiles("auto", robots.elements.law):
        # Only here: the import loads numba.
        from rft.terradynamics.walking.planar.compiled import run_steps
    else:
        run_steps = run_steps_by_numpy
    states, evaluations = run_steps(
        robots,
        index,
        state.to_array(),
        angles,
        rates,
        lengths,
        end_heights,
        EFFORT,
        shares,
    )
    return State.from_array(states), evaluations


def step(
    robots: Robots, state: State, phase: float, rate_phase: float, dt: float
) -> State:
    """Return the state of robots of one frequency after a time step dt, s, from a
    phase, with the legs at the rates of the clock at ``rate_phase``."""
    phases = (phase, phase + dt * robots.frequency[0, 0])
    states, _ = march(robots, range(len(robots)), state, phases, [rate_phase])
    return states.take(0)


def run_steps_by_numpy(
    robots: Robots,
    index,
    start: np.ndarray,
    angles,
    rates,
    lengths,
    end_heights,
    effort: Effort,
    shares=None,
):
    """Return the states after each step (S, B, 11) and the numbers of evaluations (B,),
    from states as arrays (B, 11).

    angles: (S, B, K), of the legs at the beginning of each step, rad. rates: (S, B, K),
    rad/s. lengths: (S, B), s. end_heights: (2, B), m. shares: (B, K), as of
    `march`."""
    count, size = lengths.shape
    states = np.empty((count, *start.shape))
    evaluations = np.zeros(size, int)

    # Robots under way: their columns, the numbers of their steps, and where they are in
    # them.
    column = np.arange(size)
    number = np.zeros(size, int)
    steps = steps_from_array(start)
    while column.size:
        robot = index[column]
        length = lengths[number, column]
        h = steps.stage.part * length
        steps, is_over = _advance_stages(
            robots, robot, steps, h, length, angles[number, column],
            rates[number, column], effort, None if shares is None else shares[column],
        )  # fmt: skip
        evaluations[column] += 1
        if not is_over.any():
            continue

        # Robots whose step is over store it. Those at an end stay there.
        pose = steps.accepted.pose
        row = accepted_array(steps)
        states[number[is_over], column[is_over]] = row[is_over]
        number = number + is_over
        ended = is_over & has_ended(pose[1], pose[2], end_heights[:, column])
        for j in np.flatnonzero(ended):
            states[number[j] :, column[j]] = row[j]

        active = ~ended & (number < count)
        if not active.all():
            steps = take_rows(steps, active)
            column = column[active]
            number = number[active]
    return states, evaluations


def _advance_stages(
    robots: Robots,
    index,
    steps: Step,
    h: np.ndarray,
    length: np.ndarray,
    start_angle: np.ndarray,
    rate: np.ndarray,
    effort: Effort,
    shares: np.ndarray | None,
) -> tuple[Step, np.ndarray]:
    """Return robots after one evaluation of forces, and whether their time steps are
    over (B,).

    h, length: (B,), s, of the present part of the step and of the step. start_angle:
    (B, K), rad, of the legs at the beginning of the step. rate: (B, K), rad/s.
    shares: (B, K), as of `march`."""
    k = GAMMA * h
    width = gather(effort.widths, steps.newton.width, 0)
    ground = robots.ground_under(index, width)
    tolerance = TOLERANCE * ground.rounding
    time = (stage_time(steps.stage) * length)[:, None]
    residual, slopes, power = robots.residual(
        index,
        steps.stage.base,
        steps.stage.start,
        steps.newton.trial,
        start_angle + time * rate,
        rate,
        k,
        ground,
        shares,
    )
    newton, is_solved, has_failed = newton_step(
        steps.newton, residual, slopes, power, k, robots.reach[index], tolerance, effort
    )
    steps = Step(steps.accepted, steps.stage, newton)
    if not (is_solved | has_failed).any():
        return steps, np.zeros(len(index), bool)
    return next_problem(steps, is_solved, has_failed, tolerance, k, h, effort)


def steps_from_array(state: np.ndarray) -> Step:
    """Return robots in the states of an array (B, 11) at the start of a time step."""
    x = tuple(state.T)
    return start_of_step(x[:3], x[3:6], *x[6:])


def accepted_array(steps: Step) -> np.ndarray:
    """Return the accepted states as an array (B, 11)."""
    pose, twist, *sums = steps.accepted
    return np.stack([*pose, *twist, *sums], -1)


def take_rows(values: Any, rows: Any) -> Any:
    """Return these rows of all arrays in nested tuples."""
    if not isinstance(values, tuple):
        return values[rows]
    parts = [take_rows(x, rows) for x in values]
    if hasattr(values, "_fields"):
        return type(values)(*parts)
    return tuple(parts)
