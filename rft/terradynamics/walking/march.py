"""Steps in time of many robots at once, each at its own rate
(`rft.terradynamics.walking.sdirk`).

Steps end where the clock's rate jumps. Some robots stick where others slip, and take
ten times as many iterations. So no robot waits for another: each evaluation of forces
is a batch of all robots under way, every one in its own step, stage and iteration."""

from __future__ import annotations

from typing import Any

import numpy as np

from rft.balance.backend import compiles
from rft.formulas.vectors import gather
from rft.terradynamics.walking.planar import Robots, State
from rft.terradynamics.walking.sdirk import (
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

UNENDING = (
    np.inf,
    np.inf,
)  # `rft.terradynamics.walking.sdirk.has_ended`: robots neither sink nor fly


def march(
    robots: Robots, index, state: State, phases, rate_phases, ends=UNENDING
) -> tuple[State, np.ndarray]:
    """Return the states after every step (S, B) of the robots ``index`` from a state,
    and how often forces were evaluated (B,).

    The steps go from phase to phase (S + 1,), in cycles. In each the legs rotate at the
    rates of the clock at ``rate_phases`` (S,), which tell the side of a kink. ends: see
    `rft.terradynamics.walking.sdirk.has_ended`; a robot at an end stays there."""
    index = np.asarray(index)
    phases = np.asarray(phases)
    starts = np.broadcast_to(phases[:-1, None], (len(rate_phases), len(index)))
    angles, rates = robots.leg_motion(
        starts, np.broadcast_to(np.asarray(rate_phases)[:, None], starts.shape), index
    )
    lengths = np.diff(phases)[:, None] / robots.frequency[index, 0]
    ends = np.stack([np.broadcast_to(x, len(index)) for x in ends])
    if compiles("auto", robots.elements.law):
        from rft.terradynamics.walking.compiled import run_steps
    else:
        run_steps = run_steps_by_numpy
    states, tries = run_steps(
        robots, index, state.packed(), angles, rates, lengths, ends, EFFORT
    )
    return State.unpacked(states), tries


def step(
    robots: Robots, state: State, phase: float, rate_phase: float, dt: float
) -> State:
    """Return the state of robots of one frequency after a time step dt, s, from a
    phase, with the legs at the rates of the clock at ``rate_phase``."""
    phases = phase, phase + dt * robots.frequency[0, 0]
    return march(robots, range(len(robots)), state, phases, [rate_phase])[0].take(0)


def run_steps_by_numpy(
    robots: Robots,
    index,
    start: np.ndarray,
    angles,
    rates,
    lengths,
    ends,
    effort: Effort,
):
    """Return the states after each step (S, B, 11) and the numbers of evaluations (B,),
    from packed states (B, 11).

    angles: (S, B, K), of the legs at the beginning of each step, rad. rates: (S, B, K),
    rad/s. lengths: (S, B), s. ends: (2, B)."""
    count, size = lengths.shape
    states = np.empty((count, *start.shape))
    tries = np.zeros(size, int)
    # Of the robots under way: their columns, the numbers of their steps, and where they
    # are in them.
    column = np.arange(size)
    number = np.zeros(size, int)
    steps = unpacked(start)
    while column.size:
        robot = index[column]
        length = lengths[number, column]
        h = steps.stage.part * length
        time = (stage_time(steps.stage) * length)[:, None]
        width = gather(effort.widths, steps.newton.width, 0)
        rate = rates[number, column]
        ground = robots.ground_under(robot, width)
        k = GAMMA * h
        residual, slopes, power = robots.residual(
            robot, steps.stage.base, steps.stage.start, steps.newton.trial, angles[number, column] + time * rate, rate, k,
            ground,
        )  # fmt: skip
        tolerance = TOLERANCE * ground.rounding
        newton, solved, failed = newton_step(
            steps.newton,
            residual,
            slopes,
            power,
            k,
            robots.reach[robot],
            tolerance,
            effort,
        )
        steps = Step(steps.accepted, steps.stage, newton)
        tries[column] += 1
        if not (solved | failed).any():
            continue
        steps, over = next_problem(steps, solved, failed, tolerance, k, h, effort)
        if over.any():
            row = packed(steps)
            pose = steps.accepted.pose
            states[number[over], column[over]] = row[over]
            number = number + over
            ended = over & has_ended(pose[1], pose[2], ends[:, column])
            for j in np.flatnonzero(ended):
                states[number[j] :, column[j]] = row[j]
            active = ~ended & (number < count)
            if not active.all():
                steps = select(steps, active)
                column = column[active]
                number = number[active]
    return states, tries


def unpacked(state: np.ndarray) -> Step:
    """Return robots in packed states (B, 11) at the start of a time step."""
    x = tuple(state.T)
    return start_of_step(x[:3], x[3:6], *x[6:])


def packed(steps: Step) -> np.ndarray:
    """Return the accepted states (B, 11)."""
    pose, twist, *sums = steps.accepted
    return np.stack([*pose, *twist, *sums], -1)


def select(values: Any, rows: Any) -> Any:
    """Return these rows of all arrays in nested tuples."""
    if not isinstance(values, tuple):
        return values[rows]
    parts = [select(x, rows) for x in values]
    return type(values)(*parts) if hasattr(values, "_fields") else tuple(parts)
