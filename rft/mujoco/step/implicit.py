"""The force of the grains in a step, by the velocity at the end of the step.

In a step h from positions x and velocities v, with the inertia M, all other smooth
forces tau and MuJoCo's constraints,

    r(b) = N b - tau - sum_g J_g^T w_g(x, v + h b) - J_c^T f(J_c a - a_ref) = 0,
    M a = N b,

is solved for the change b of the velocities over h. w_g is the wrench of the grains on
geom g, by its twist along its own axes, rounded over a small speed; f are the forces of
`rft.mujoco.step.rows`. N = M + h B contains the terms B that MuJoCo's integrator itself
takes implicitly: the damping of joints in Euler's, also the motors' in the implicit
ones, nothing in RK4, whose stages take h / 2. The w_g become passive forces. MuJoCo's
own equations of the step then have the same b for their only solution, so that nothing
of MuJoCo changes: its motors, constraints and grains act together, and no force
outlives the velocity that it resists.

Newton's method, by slopes in closed form, starts at the last acceleration. Where a full
step does not reduce the residual, |r|^2 = r . M^-1 r, a step d goes downhill instead:
to where d . r, negative at its start, changes its sign. If the grains' forces were the
slopes of a potential, as those of dry friction nearly are, this would be its minimum
along d. So the search crosses the jump of the stress at rest, and it leaves folds
behind. In a fold, a face that begins to lead is pulled along, and the residual has a
minimum that is no solution. There the tangent is not positive, and dampers that bear as
much as the elements are added to it until d goes downhill. If that fails, the equations
are solved at a wider rounding first. Compiled code calls these functions, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.mujoco.step.algebra import (
    add_projected,
    cholesky,
    dot,
    geom_twists,
    inverse_norm2,
    joint_forces,
    multiply,
    solve_linear,
)
from rft.mujoco.step.parts import add_dampers, write_slopes, write_wrenches
from rft.mujoco.step.rows import add_row_slopes, row_forces

ACCURACY = 1e-5  # residual, over the forces that act without the grains
MAX_ITERATIONS = 40  # of Newton's method at one rounding
# |r|^2 after a full step over that before it, up to which the step is accepted.
FULL_STEP_RATIO = 0.25
LEAST_DECREASE = 1e-3  # share of |r|^2 by which a search along Newton's step reduces it
MAX_TRIALS = 12  # along a line
FLAT_SLOPE = 0.1  # slope along a line, over that at its start, where the search ends
NARROW_BRACKET = 1e-7  # share of a line at which its search ends
# Factors of the dampers that are added to a tangent: the first, from one to the next,
# and the limit.
FIRST_DAMPING = 0.1
DAMPING_GROWTH = 10.0
MAX_DAMPING = 1e6
# Where the method fails: wider roundings that are tried, and the factor from one to the
# next.
WIDER_LEVELS = 4
ROUNDING_GROWTH = 10.0
# Residual, over the accuracy, that is accepted where the search cycles in a fold.
LOOSE_RATIO = 30.0
# As required; loosely, or at a wider rounding; not.
SOLVED, COARSER, UNSOLVED = 0, 1, 2


class Motion(NamedTuple):
    """How n degrees of freedom move the geoms of a block. jacobian: (G, 6, n), to the
    twists of all geoms along their own axes. members: (m,), the geoms of the block that
    are in the ground. dofs: degrees of freedom of each geom, one geom after the other;
    first: (G + 1,), where those of each begin."""

    jacobian: np.ndarray
    members: np.ndarray
    dofs: np.ndarray
    first: np.ndarray


class System(NamedTuple):
    """The equations of motion of a block without grains and constraints. inertia:
    (n, n), M. effective: (n, n), N. lower: (n, n), Cholesky factor of M. force: (n,),
    tau. velocity: (n,), v. step: h, s. motion: of its geoms."""

    inertia: np.ndarray
    effective: np.ndarray
    lower: np.ndarray
    force: np.ndarray
    velocity: np.ndarray
    step: float
    motion: Motion


class Point(NamedTuple):
    """A point of the search, arrays that are written. change: (n,), b. wrenches:
    (G, 6), w. residual: (n,), r."""

    change: np.ndarray
    wrenches: np.ndarray
    residual: np.ndarray


class Result(NamedTuple):
    """How well a step is solved. residual: |r| over the forces without grains. status:
    `SOLVED`, `COARSER` or `UNSOLVED`. rounding: m/s, at which it is. iterations: of
    Newton's method."""

    residual: float
    status: int
    rounding: float
    iterations: int


def block_system(inertia, effective, force, velocity, step, motion) -> System:
    """Return the equations of motion of a block."""
    lower = cholesky(inertia)
    return System(inertia, effective, lower, force, velocity, step, motion)


def new_point(change, geoms) -> Point:
    """Return a point of the search with a change (n,), to be evaluated."""
    return Point(change, np.zeros((geoms, 6)), np.zeros(len(change)))


def evaluate(system, rows, grains, rounding, point) -> float:
    """Write wrenches and residual of a point and return |r|^2."""
    end = system.velocity + system.step * point.change
    twists = geom_twists(system.motion, end)
    write_wrenches(grains, system.motion.members, rounding, twists, point.wrenches)
    return _write_residual(system, rows, point)


def _write_residual(system, rows, point) -> float:
    r = multiply(system.effective, point.change) - system.force
    r -= joint_forces(system.motion, point.wrenches)
    if len(rows.weight) > 0:
        u = multiply(rows.by_change, point.change) - rows.reference
        r -= multiply(rows.jacobian.T, row_forces(rows, u))
    point.residual[:] = r
    return inverse_norm2(system.lower, r)


def tangent(system, rows, grains, rounding, point) -> np.ndarray:
    """Return the slopes (n, n) of the residual by the change."""
    end = system.velocity + system.step * point.change
    twists = geom_twists(system.motion, end)
    slopes = np.zeros((len(point.wrenches), 6, 6))
    write_slopes(grains, system.motion.members, rounding, twists, slopes)
    matrix = system.effective.copy()
    add_projected(matrix, -system.step, system.motion, slopes)
    if len(rows.weight) > 0:
        u = multiply(rows.by_change, point.change) - rows.reference
        add_row_slopes(matrix, rows, u)
    return matrix


def newton(system, rows, grains, rounding, point, tolerance) -> tuple[float, int]:
    """Solve at one rounding from the change of a point, which becomes the best point of
    the search; return |r|^2 there and the number of iterations."""
    residual2 = evaluate(system, rows, grains, rounding, point)
    trial = new_point(point.change.copy(), len(point.wrenches))
    best = new_point(point.change.copy(), len(point.wrenches))
    best_residual2 = residual2
    copy_point(point, best)
    for iteration in range(MAX_ITERATIONS):
        if residual2 <= tolerance:
            return residual2, iteration
        # Within this function: calls with all these arrays take 3 % of a step
        # (measured).
        matrix = tangent(system, rows, grains, rounding, point)
        step = solve_linear(matrix.copy(), -point.residual)
        trial.change[:] = point.change + step
        after = evaluate(system, rows, grains, rounding, trial)
        if not (after <= FULL_STEP_RATIO * residual2 or after <= tolerance):
            after = search_line(
                system, rows, grains, rounding, point, step, after, trial
            )
            if not after <= (1.0 - LEAST_DECREASE) * residual2:
                # Newton's step does not go downhill far enough.
                step = downhill_step(system, grains, rounding, point, matrix)
                trial.change[:] = point.change + step
                after = evaluate(system, rows, grains, rounding, trial)
                if not after <= FULL_STEP_RATIO * residual2:
                    after = search_line(
                        system, rows, grains, rounding, point, step, after, trial
                    )
        copy_point(trial, point)
        residual2 = after
        if residual2 < best_residual2:
            copy_point(point, best)
            best_residual2 = residual2
    copy_point(best, point)
    return best_residual2, MAX_ITERATIONS


def copy_point(source, target) -> None:
    """Write a point into another."""
    target.change[:] = source.change
    target.wrenches[:] = source.wrenches
    target.residual[:] = source.residual


def search_line(system, rows, grains, rounding, point, step, full, trial) -> float:
    """Set a trial, which is at the end of a step from a point, to where step . r
    changes its sign, and return its |r|^2; it stays at the end where there is no such
    place.

    full: |r|^2 at the end. The method is false position, halved on the side that stays
    (the Illinois method)."""
    start_slope = dot(step, point.residual)
    low = 0.0
    high = 1.0
    slope_low = start_slope
    slope_high = dot(step, trial.residual)
    residual2 = full
    if not slope_low < 0.0 < slope_high:
        return residual2
    last_side = 0
    for _ in range(MAX_TRIALS):
        share = low - slope_low * (high - low) / (slope_high - slope_low)
        edge = 0.05 * (high - low)
        share = min(max(share, low + edge), high - edge)
        trial.change[:] = point.change + share * step
        residual2 = evaluate(system, rows, grains, rounding, trial)
        slope = dot(step, trial.residual)
        if abs(slope) < -FLAT_SLOPE * start_slope or high - low < NARROW_BRACKET:
            break
        if slope < 0.0:
            if last_side == -1:
                slope_high *= 0.5
            low = share
            slope_low = slope
            last_side = -1
        else:
            if last_side == 1:
                slope_low *= 0.5
            high = share
            slope_high = slope
            last_side = 1
    return residual2


def downhill_step(system, grains, rounding, point, matrix) -> np.ndarray:
    """Return a step (n,) with step . r < 0: Newton's, with the weakest dampers that
    make it so."""
    end = system.velocity + system.step * point.change
    dampers = np.zeros((len(point.wrenches), 6, 6))
    twists = geom_twists(system.motion, end)
    add_dampers(grains, system.motion.members, rounding, twists, dampers)
    damping = FIRST_DAMPING
    step = np.zeros(len(point.residual))
    while damping < MAX_DAMPING:
        damped = matrix.copy()
        add_projected(damped, system.step * damping, system.motion, dampers)
        step = solve_linear(damped, -point.residual)
        if dot(step, point.residual) < 0.0:
            break
        damping *= DAMPING_GROWTH
    return step


def solve_block(system, rows, grains, rounding, accuracy, point) -> Result:
    """Return the result of `solve`; for compiled code it is a C function of its own
    (`rft.mujoco.step.compiled_solver`)."""
    return solve(system, rows, grains, rounding, accuracy, point)


def solve(system, rows, grains, rounding, accuracy, point) -> Result:
    """Solve a step from the change of a point, which becomes the solution, or the best
    point of the search."""
    scale = multiply(system.inertia, system.velocity) / system.step + system.force
    size2 = inverse_norm2(system.lower, scale) + 1e-12
    tolerance = accuracy * accuracy * size2
    loose_tolerance = LOOSE_RATIO * LOOSE_RATIO * tolerance
    best = new_point(point.change.copy(), len(point.wrenches))
    best_residual2 = np.inf
    status = UNSOLVED
    reached = rounding
    wide = rounding
    total = 0
    # At the required rounding; then at a wider one and from its solution at the
    # required one, and so on.
    for level in range(2 * WIDER_LEVELS + 1):
        is_wide = level % 2 == 1
        level_rounding = rounding
        if is_wide:
            wide *= ROUNDING_GROWTH
            level_rounding = wide
        residual2, count = newton(
            system, rows, grains, level_rounding, point, tolerance
        )
        total += count
        if residual2 <= tolerance and not is_wide:
            return Result((residual2 / size2) ** 0.5, SOLVED, rounding, total)
        if residual2 <= loose_tolerance and not is_wide:
            return Result((residual2 / size2) ** 0.5, COARSER, rounding, total)
        is_better = residual2 <= tolerance or residual2 < best_residual2
        if status == UNSOLVED and is_better:
            copy_point(point, best)
            best_residual2 = residual2
            if is_wide and residual2 <= tolerance:
                status = COARSER
                reached = wide
    copy_point(best, point)
    return Result((best_residual2 / size2) ** 0.5, status, reached, total)


COMPILED = (
    block_system,
    new_point,
    evaluate,
    _write_residual,
    tangent,
    newton,
    copy_point,
    search_line,
    downhill_step,
    solve,
)
