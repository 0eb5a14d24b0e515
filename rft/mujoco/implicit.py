"""The force of the grains in a step, by the velocity at the end of the step.

In a step h from positions x and velocities v, with the inertia M, all other smooth forces tau and MuJoCo's constraints,

    r(b) = N b - tau - sum_g J_g^T w_g(x, v + h b) - J_c^T f(J_c a - a_ref) = 0,    M a = N b,

is solved for the change b of the velocities over h. w_g is the wrench of the grains on geom g, by its twist along its own
axes, rounded over a small speed; f are the forces of `rft.mujoco.rows`; N = M + h B, with what MuJoCo's integrator takes
implicitly itself, B: the damping of joints in Euler's, also the motors' in the implicit ones, nothing in RK4, whose stages
take h / 2. The w_g become passive forces. MuJoCo's own equations of the step then have the same b for their only solution,
so that nothing of MuJoCo changes: its motors, constraints and grains act together, and no force outlives the velocity that
it resists.

Newton's method, by slopes in closed form, starts at the last acceleration. A full step that does not lessen the
residual, |r|^2 = r . M^-1 r, goes to where the residual along it changes its sign, across the jump of the stress at rest.
If that fails, dampers that bear as much as the elements are added, which limits the step to a share of each element's
speed. If that fails, the equations are solved at wider and wider roundings, and from there back towards the required one
along the curve of solutions, by steps in the logarithm of the rounding. Compiled code takes these functions, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.mujoco.algebra import (
    add_projected,
    cholesky,
    dot,
    joint_forces,
    multiply,
    solve_linear,
    square_over,
    twists_of,
)
from rft.mujoco.parts import add_dampers, loads, loads_with_slopes
from rft.mujoco.rows import add_row_slopes, row_forces

ACCURACY = 1e-5  # residual, over the forces that act without the grains
MOST = 12  # iterations of Newton's method at one rounding
ENOUGH = 0.25  # of the square of the residual, that a full step leaves at most
LEAST = 1e-3  # share of the square of the residual that any step must take away
TRIALS = 12  # along a line
FLAT = 0.1  # slope along a line, over that at its start, where the search ends
NARROW = 1e-7  # share of a line at which its search ends
DAMPING, STRONGER, STRONGEST = 0.1, 10.0, 1e5  # of the elements
WIDER = 10.0  # factor of the rounding from one level to the next
LEVELS = 4  # of rounding above the required one
SOLVED, COARSER, UNSOLVED = 0, 1, 2  # at the required rounding, at a wider one, at none


class Motion(NamedTuple):
    """How n degrees of freedom move the geoms of a block. jacobian: (G, 6, n), to the twists of all geoms along their own
    axes. members: (m,), the geoms of the block that are in the ground. dofs: degrees of freedom of each geom, one geom
    after the other; first: (G + 1,), where those of each begin."""

    jacobian: np.ndarray
    members: np.ndarray
    dofs: np.ndarray
    first: np.ndarray


class System(NamedTuple):
    """The equations of motion of a block without grains and constraints. inertia: (n, n), M. effective: (n, n), N. lower:
    (n, n), Cholesky factor of M. force: (n,), tau. velocity: (n,), v. step: h, s. motion: of its geoms."""

    inertia: np.ndarray
    effective: np.ndarray
    lower: np.ndarray
    force: np.ndarray
    velocity: np.ndarray
    step: float
    motion: Motion


class Point(NamedTuple):
    """A point of the search, arrays that are written. change: (n,), b. wrenches: (G, 6), w. residual: (n,), r."""

    change: np.ndarray
    wrenches: np.ndarray
    residual: np.ndarray


class Result(NamedTuple):
    """How well a step is solved. residual: |r| over the forces without grains. status: `SOLVED`, `COARSER` or `UNSOLVED`.
    rounding: m/s, at which it is. iterations: of Newton's method."""

    residual: float
    status: int
    rounding: float
    iterations: int


def system_of(inertia, effective, force, velocity, step, motion) -> System:
    """Return the equations of motion of a block."""
    lower = cholesky(inertia)
    return System(inertia, effective, lower, force, velocity, step, motion)


def point_at(change, geoms) -> Point:
    """Return a point of the search with a change (n,), to be evaluated."""
    return Point(change, np.zeros((geoms, 6)), np.zeros(len(change)))


def evaluate(system, rows, grains, rounding, point) -> float:
    """Write wrenches and residual of a point and return |r|^2."""
    end = system.velocity + system.step * point.change
    twists = twists_of(system.motion, end)
    loads(grains, system.motion.members, rounding, twists, point.wrenches)
    return _write_residual(system, rows, point)


def _write_residual(system, rows, point) -> float:
    r = multiply(system.effective, point.change) - system.force
    r -= joint_forces(system.motion, point.wrenches)
    if len(rows.weight) > 0:
        u = multiply(rows.by_change, point.change) - rows.reference
        r -= multiply(rows.jacobian.T, row_forces(rows, u))
    point.residual[:] = r
    return square_over(system.lower, r)


def tangent_at(system, rows, grains, rounding, point) -> np.ndarray:
    """Return the slopes (n, n) of the residual by the change."""
    end = system.velocity + system.step * point.change
    twists = twists_of(system.motion, end)
    slopes = np.zeros((len(point.wrenches), 6, 6))
    loads_with_slopes(grains, system.motion.members, rounding, twists, slopes)
    matrix = system.effective.copy()
    add_projected(matrix, -system.step, system.motion, slopes)
    if len(rows.weight) > 0:
        u = multiply(rows.by_change, point.change) - rows.reference
        add_row_slopes(matrix, rows, u)
    return matrix


def newton(system, rows, grains, rounding, point, left, tolerance) -> tuple[float, int]:
    """Solve at one rounding from a point, whose |r|^2 is ``left``; return |r|^2 and the number of iterations."""
    trial = point_at(point.change.copy(), len(point.wrenches))
    for iteration in range(MOST):
        if left <= tolerance:
            return left, iteration
        matrix = tangent_at(system, rows, grains, rounding, point)
        step = solve_linear(matrix.copy(), -point.residual)
        now = move(system, rows, grains, rounding, point, step, 1.0, trial)
        if not (now <= ENOUGH * left or now <= tolerance):
            first = dot(step, point.residual), dot(step, trial.residual)
            now = along_line(
                system, rows, grains, rounding, point, step, first, now, trial
            )
        if not now <= (1.0 - LEAST) * left:
            now = damped(system, rows, grains, rounding, point, matrix, left, trial)
        if not now <= (1.0 - LEAST) * left:
            return left, iteration + 1
        copy_point(trial, point)
        left = now
    return left, MOST


def copy_point(source, target) -> None:
    """Write a point into another."""
    target.change[:] = source.change
    target.wrenches[:] = source.wrenches
    target.residual[:] = source.residual


def move(system, rows, grains, rounding, point, step, share, trial) -> float:
    """Set a trial to a share of a step from a point, and return its |r|^2."""
    trial.change[:] = point.change + share * step
    return evaluate(system, rows, grains, rounding, trial)


def along_line(
    system, rows, grains, rounding, point, step, first, full, trial
) -> float:
    """Set a trial to where the residual along a step changes its sign, and return its |r|^2.

    first: step . r at the start and at the end of the step. full: |r|^2 at its end. False position, halved on the side
    that stays (the Illinois method)."""
    low, high = 0.0, 1.0
    slope_low, slope_high = first
    best, best_share, share = full, 1.0, 1.0
    last = 0
    for _ in range(TRIALS):
        if slope_low < 0.0 < slope_high:
            share = low - slope_low * (high - low) / (slope_high - slope_low)
            edge = 0.05 * (high - low)
            share = min(max(share, low + edge), high - edge)
        else:
            share *= 0.25
        now = move(system, rows, grains, rounding, point, step, share, trial)
        slope = dot(step, trial.residual)
        if now < best or not np.isfinite(best):
            best, best_share = now, share
        if abs(slope) < -FLAT * first[0] or high - low < NARROW:
            break
        if slope < 0.0:
            slope_high *= 0.5 if last == -1 else 1.0
            low, slope_low, last = share, slope, -1
        else:
            slope_low *= 0.5 if last == 1 else 1.0
            high, slope_high, last = share, slope, 1
    if best_share != share:
        best = move(system, rows, grains, rounding, point, step, best_share, trial)
    return best


def damped(system, rows, grains, rounding, point, matrix, left, trial) -> float:
    """Set a trial to a step that dampers shorten, the weakest with which it lessens the residual; return its |r|^2."""
    end = system.velocity + system.step * point.change
    dampers = np.zeros((len(point.wrenches), 6, 6))
    twists = twists_of(system.motion, end)
    add_dampers(grains, system.motion.members, rounding, twists, dampers)
    damping, now = DAMPING, np.inf
    while damping < STRONGEST:
        stiffened = matrix.copy()
        add_projected(stiffened, system.step * damping, system.motion, dampers)
        step = solve_linear(stiffened, -point.residual)
        now = move(system, rows, grains, rounding, point, step, 1.0, trial)
        if now <= (1.0 - LEAST) * left:
            return now
        damping *= STRONGER
    return now


def solve_block(system, rows, grains, rounding, accuracy, point) -> Result:
    """Return what `solve` does; for compiled code a C function of its own (`rft.mujoco.compiled_solver`)."""
    return solve(system, rows, grains, rounding, accuracy, point)


def solve(system, rows, grains, rounding, accuracy, point) -> Result:
    """Solve a step from the change of a point, which is left at the solution, or at the best that was found."""
    scale = multiply(system.inertia, system.velocity) / system.step + system.force
    size = square_over(system.lower, scale) + 1e-12
    tolerance = accuracy * accuracy * size
    left = evaluate(system, rows, grains, rounding, point)
    left, iterations = newton(system, rows, grains, rounding, point, left, tolerance)
    if left <= tolerance:
        return Result((left / size) ** 0.5, SOLVED, rounding, iterations)
    best = point_at(point.change.copy(), len(point.wrenches))
    copy_point(point, best)
    wide, count = widened(system, rows, grains, rounding, point, tolerance)
    iterations += count
    narrow, count = narrowed(system, rows, grains, wide, rounding, point, tolerance)
    iterations += count
    now = evaluate(system, rows, grains, rounding, point)
    if now <= tolerance:
        return Result((now / size) ** 0.5, SOLVED, rounding, iterations)
    if narrow < np.inf:
        now = evaluate(system, rows, grains, narrow, point)
        return Result((now / size) ** 0.5, COARSER, narrow, iterations)
    copy_point(best, point)
    return Result((left / size) ** 0.5, UNSOLVED, rounding, iterations)


def widened(system, rows, grains, rounding, point, tolerance) -> tuple[float, int]:
    """Solve at wider roundings until that succeeds; return the rounding, infinite if none does, and the iterations."""
    total, wide = 0, rounding
    for _ in range(LEVELS):
        wide *= WIDER
        left = evaluate(system, rows, grains, wide, point)
        left, count = newton(system, rows, grains, wide, point, left, tolerance)
        total += count
        if left <= tolerance:
            return wide, total
    return np.inf, total


def narrowed(
    system, rows, grains, wide, rounding, point, tolerance
) -> tuple[float, int]:
    """Follow the solution at a wide rounding down to the required one; return the rounding that is reached."""
    if not wide < np.inf:
        return wide, 0
    factor, total = WIDER**0.5, 0
    known = point_at(point.change.copy(), len(point.wrenches))
    copy_point(point, known)
    reached = wide
    while reached > rounding and factor > 1.05:
        target = max(reached / factor, rounding)
        left = evaluate(system, rows, grains, target, point)
        left, count = newton(system, rows, grains, target, point, left, tolerance)
        total += count
        if left <= tolerance:
            reached = target
            copy_point(point, known)
            factor = min(factor * factor, WIDER)
        else:
            copy_point(known, point)
            factor = factor**0.5
    return reached, total


COMPILED = (
    system_of,
    point_at,
    evaluate,
    _write_residual,
    tangent_at,
    newton,
    copy_point,
    move,
    along_line,
    damped,
    solve,
    widened,
    narrowed,
)
