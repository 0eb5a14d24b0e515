"""SDIRK2 with Newton's method: one robot's time steps, stage by stage and evaluation by
evaluation.

The law of stress depends on the direction of a velocity alone, so the equations are
stiff wherever something is nearly at rest. Explicit steps chatter there. So do linearly
implicit ones, as a step may begin in slip and end in stick. So each stage is solved to
convergence: SDIRK2 of Alexander, SIAM J. Numer. Anal. 14, 1006 (1977), of order 2,
L-stable and stiffly accurate, by Newton's method on the three rates. Where Newton's
method fails, it goes through wider roundings of the law down to the law's own. Where
this fails as well, the step is halved.

All functions are formulas (`rft.formulas.vectors`):
`rft.terradynamics.walking.planar.march` takes many robots through them side by side by
NumPy, `rft.terradynamics.walking.planar.compiled` one after the other. Triples are
(x, z, pitch)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.formulas.newton import plus, solve3, times
from rft.formulas.vectors import absolute, floor, formula, maximum, where

GAMMA = 1.0 - 0.5**0.5
TOLERANCE = 1e-3  # largest residual of a solved stage, over the rounding
MOST_HALVINGS = 3  # of a step
# Distance that a step of Newton's method moves a body by at most, over a leg's reach.
LONGEST_MOVE = 0.5
# Share of a step of Newton's method, below which the method has failed.
SMALLEST_SHARE = 0.05
# Decrease of the residual over the one that Newton's method predicts, at least.
LEAST_DECREASE = 0.1


class Effort(NamedTuple):
    """Limits of the work on a stage.

    widths: (W, 1), factors of the rounding, one after another until the stage is solved
    at the first or last, which are 1. iterations: most of Newton's method at a width.
    smallest: smallest part of a step."""

    widths: np.ndarray
    iterations: float
    smallest: float


EFFORT = Effort(
    widths=np.array([[1.0, 30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2, 1.0]]).T,
    iterations=14.0,
    smallest=0.5**MOST_HALVINGS,
)


class AcceptedState(NamedTuple):
    """State at the start of the present part of a step, with the fields of
    `rft.terradynamics.walking.planar.equations.State`."""

    pose: tuple[float, float, float]
    twist: tuple[float, float, float]
    work: float
    loss: float
    unsolved: float
    defect: float
    residual: float


class Stage(NamedTuple):
    """A stage of a part of a step: v = start + k a(base + k v, v).

    part, elapsed: the present part, and the sum of those before it, over the step.
    is_second: 0 at the first stage, 1 at the second. base, start: triples of the
    equation. guess: first trial for v. first_result: power of the motors and into the
    ground, W, and residual, m/s, at the end of the first stage."""

    part: float
    elapsed: float
    is_second: float
    base: tuple[float, float, float]
    start: tuple[float, float, float]
    guess: tuple[float, float, float]
    first_result: tuple[float, float, float]


class Newton(NamedTuple):
    """Newton's method for a stage at one rounding.

    width: index of the rounding in `Effort.widths`. evaluations: number of them at it.
    best: of all v tried, the one of the smallest ``residual``, m/s. power: of the
    motors and into the ground, W, at the best v. step: Newton's step from there. trial:
    v of the next evaluation, a ``share`` of the step from the best. first_share: first
    share of this step that was tried."""

    width: float
    evaluations: float
    best: tuple[float, float, float]
    trial: tuple[float, float, float]
    step: tuple[float, float, float]
    residual: float
    share: float
    first_share: float
    power: tuple[float, float]


class Step(NamedTuple):
    """A robot within a time step."""

    accepted: AcceptedState
    stage: Stage
    newton: Newton


@formula
def start_of_step(pose, twist, work, loss, unsolved, defect, residual):
    """Return a robot in a state at the start of a time step."""
    zero = 0.0 * work
    one = zero + 1.0
    zeros = (zero, zero, zero)
    return Step(
        AcceptedState(pose, twist, work, loss, unsolved, defect, residual),
        Stage(one, zero, zero, pose, twist, twist, zeros),
        Newton(zero, zero, twist, twist, zeros, zero + np.inf, one, one, (zero, zero)),
    )


@formula
def pick(condition, a, b):
    """Return the triple a where the condition holds, b elsewhere."""
    return (
        where(condition, a[0], b[0]),
        where(condition, a[1], b[1]),
        where(condition, a[2], b[2]),
    )


@formula
def largest_speed(v, reach):
    """Return the largest of the speeds v_x, v_z and reach times the rate of pitch."""
    return maximum(maximum(absolute(v[0]), absolute(v[1])), reach * absolute(v[2]))


@formula
def stage_time(stage):
    """Return the time at which a stage is evaluated, over the step."""
    return stage.elapsed + where(stage.is_second > 0.0, 1.0, GAMMA) * stage.part


@formula
def newton_step(newton, residual, slopes, power, k, reach, tolerance, effort):
    """Return Newton's method after an evaluation at its trial, whether the stage is
    solved, and whether the method failed.

    residual: a triple, m/s. slopes: of the residual, three columns. power: of the
    motors and into the ground at the trial, W. tolerance: of the residual, m/s."""
    # The sum makes the size nan where any of the three is.
    size = largest_speed(residual, reach) + 0.0 * (
        residual[0] + residual[1] + residual[2]
    )
    better = size <= (1.0 - LEAST_DECREASE * newton.share) * newton.residual

    # A better trial is where the next step starts. After a worse one, half of the last
    # step's share is tried.
    x, z, pitch = solve3(slopes[0], slopes[1], slopes[2], residual)
    step = pick(better, (-x, -z, -pitch), newton.step)
    longest = 1.0 / maximum(
        1.0, largest_speed(step, reach) * k / (LONGEST_MOVE * reach)
    )
    first_share = where(better, longest, newton.first_share)
    share = where(better, first_share, 0.5 * newton.share)
    best = pick(better, newton.trial, newton.best)
    best_residual = where(better, size, newton.residual)
    best_power = (
        where(better, power[0], newton.power[0]),
        where(better, power[1], newton.power[1]),
    )
    evaluations = newton.evaluations + 1.0
    trial = plus(best, times(share, step))

    solved = better & (best_residual <= tolerance)
    failed = (where(solved, np.inf, share) <= SMALLEST_SHARE * first_share) | (
        where(solved, 0.0, evaluations) >= effort.iterations
    )
    new = Newton(
        newton.width,
        evaluations,
        best,
        trial,
        step,
        best_residual,
        share,
        first_share,
        best_power,
    )
    return new, solved, failed


@formula
def end_of_part(old, stage, newton, ended, tolerance, k, h):
    """Return the accepted state after a part of a step, h s long, where it has ended,
    and the old one elsewhere."""
    first_motor, first_ground, first_residual = stage.first_result
    unsolved = where(newton.residual > tolerance, newton.residual, 0.0)
    unsolved = unsolved + where(first_residual > tolerance, first_residual, 0.0)
    work = h * (1.0 - GAMMA) * first_motor + k * newton.power[0]
    loss = h * (1.0 - GAMMA) * first_ground + k * newton.power[1]
    residual = maximum(old.residual, maximum(newton.residual, first_residual))
    return AcceptedState(
        pick(ended, plus(stage.base, times(k, newton.best)), old.pose),
        pick(ended, newton.best, old.twist),
        old.work + where(ended, work, 0.0),
        old.loss + where(ended, loss, 0.0),
        old.unsolved + where(ended, where(unsolved > 0.0, 1.0, 0.0), 0.0),
        old.defect + where(ended, unsolved, 0.0),
        where(ended, residual, old.residual),
    )


@formula
def next_part(stage, ended, halved):
    """Return the part of the step that comes next, the sum of those before it, and
    whether the step is over."""
    elapsed = stage.elapsed + where(ended, stage.part, 0.0)
    part = where(halved, 0.5 * stage.part, stage.part)
    # Two halves that are done join to one part.
    for _ in range(MOST_HALVINGS):
        pairs = elapsed / (2.0 * part)
        part = where(ended & (part < 1.0) & (pairs == floor(pairs)), 2.0 * part, part)
    over = ended & (elapsed >= 1.0)
    return part, where(over, 0.0, elapsed), over


@formula
def next_stage(old, stage, newton, accepted, restarts, second, part, elapsed, k, h):
    """Return the stage to solve next: the first one of a part where it ``restarts``
    from the accepted state, the second one where the first is ready, else the same."""
    rest = h - k
    second_base = plus(old.pose, times(rest, newton.best))
    second_start = plus(
        old.twist, times(rest / k, plus(newton.best, times(-1.0, stage.start)))
    )
    first_result = (newton.power[0], newton.power[1], newton.residual)
    return Stage(
        part,
        elapsed,
        where(restarts, 0.0, where(second, 1.0, stage.is_second)),
        pick(restarts, accepted.pose, pick(second, second_base, stage.base)),
        pick(restarts, accepted.twist, pick(second, second_start, stage.start)),
        pick(restarts, accepted.twist, pick(second, newton.best, stage.guess)),
        pick(second, first_result, stage.first_result),
    )


@formula
def next_newton(newton, guess, new_stage, next_width):
    """Return Newton's method for the problem to solve next: from a guess for a new
    stage, from the best v for the next width (but the first), else as it is."""
    fresh = new_stage | next_width
    trial = pick(next_width & (newton.width > 0.0), newton.best, guess)
    return Newton(
        where(next_width, newton.width + 1.0, where(fresh, 0.0, newton.width)),
        where(fresh, 0.0, newton.evaluations),
        pick(fresh, trial, newton.best),
        pick(fresh, trial, newton.trial),
        pick(fresh, (0.0, 0.0, 0.0), newton.step),
        where(fresh, np.inf, newton.residual),
        where(fresh, 1.0, newton.share),
        where(fresh, 1.0, newton.first_share),
        newton.power,
    )


@formula
def next_problem(step, solved, failed, tolerance, k, h, effort):
    """Return a robot with the next rounding, stage or part of a step to solve where
    Newton's method has solved a stage or failed, and whether the time step is over;
    elsewhere the robot as it is. h: s, of the present part of the step."""
    old = step.accepted
    stage = step.stage
    newton = step.newton

    # A stage is ready once solved at the law's own rounding. Unsolved at the last
    # width, it is taken as it is where the step cannot be halved any more.
    at_last = newton.width >= len(effort.widths) - 1.0
    at_first = newton.width <= 0.0
    ready = (solved & (at_first | at_last)) | (
        failed & at_last & (stage.part <= effort.smallest)
    )
    halved = where(ready, False, failed & at_last)
    next_width = where(ready | at_last, False, solved | failed)
    second = ready & (stage.is_second <= 0.0)
    ended = ready & (stage.is_second > 0.0)
    restarts = ended | halved

    accepted = end_of_part(old, stage, newton, ended, tolerance, k, h)
    part, elapsed, over = next_part(stage, ended, halved)
    new_stage = next_stage(
        old, stage, newton, accepted, restarts, second, part, elapsed, k, h
    )
    new_newton = next_newton(newton, new_stage.guess, restarts | second, next_width)
    return Step(accepted, new_stage, new_newton), over


@formula
def has_ended(z, pitch, end_heights):
    """Return whether a robot has sunk, -z above the first of two heights, is airborne,
    z above the second, or has flipped."""
    has_sunk = z + end_heights[0] < 0.0
    return has_sunk | (z > end_heights[1]) | (absolute(pitch) > 0.5 * np.pi)
