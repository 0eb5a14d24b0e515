"""The force of the grains in a step, by the velocity at the end of the step.

In a step h from positions x and velocities v, with the inertia M, all other smooth forces tau and MuJoCo's constraints,

    r(b) = N b - tau - sum_g J_g^T w_g(x, v + h b) - J_c^T f(J_c a - a_ref) = 0,    M a = N b,

is solved for the change b of the velocities over h. w_g is the wrench of the grains on geom g, by its twist along its own
axes, rounded over a small speed; f are the forces of `rft.mujoco.rows`; N = M + h B, with what MuJoCo's integrator takes
implicitly itself, B: the damping of joints in Euler's, also the motors' in the implicit ones, nothing in RK4, whose stages
take h / 2. The w_g become passive forces. MuJoCo's own equations of the step then have the same b for their only solution,
so that nothing of MuJoCo changes: its motors, constraints and grains act together, and no force outlives the velocity that
it resists.

Newton's method, by slopes in closed form, starts at the last acceleration. Where a full step does not lessen the residual,
|r|^2 = r . M^-1 r, a step d goes downhill instead: to where d . r, negative at its start, changes its sign. Were the
grains' forces the slopes of a potential, as those of dry friction nearly are, this would be its least value along d. So the
search crosses the jump of the stress at rest, and it leaves folds behind, where a face that begins to lead is pulled along
and the residual has a least value that is no solution: there the tangent is not positive, and dampers that bear as much as
the elements are added to it until d goes downhill. If that fails, the equations are solved at a wider rounding first.
Compiled code takes these functions, too.
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
MOST = 40  # iterations of Newton's method at one rounding
ENOUGH = 0.25  # of the square of the residual, that a full step leaves at most
LEAST = 1e-3  # share of the square of the residual that a step along Newton's line takes away
TRIALS = 12  # along a line
FLAT = 0.1  # slope along a line, over that at its start, where the search ends
NARROW = 1e-7  # share of a line at which its search ends
DAMPING, STRONGER, STRONGEST = 0.1, 10.0, 1e6  # of the elements
WIDER, LEVELS = (
    10.0,
    4,
)  # factor of the rounding from one level to the next, where the method fails
LOOSE = 30.0  # residual, over the accuracy, that is taken where the search goes round in a fold
SOLVED, COARSER, UNSOLVED = 0, 1, 2  # as required; loosely, or at a wider rounding; not


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


def newton(system, rows, grains, rounding, point, tolerance) -> tuple[float, int]:
    """Solve at one rounding from the change of a point, which is left at the best that was found; return |r|^2 there and
    the number of iterations."""
    left = evaluate(system, rows, grains, rounding, point)
    trial = point_at(point.change.copy(), len(point.wrenches))
    best, least = point_at(point.change.copy(), len(point.wrenches)), left
    copy_point(point, best)
    for iteration in range(MOST):
        if left <= tolerance:
            return left, iteration
        matrix = tangent_at(system, rows, grains, rounding, point)
        step = solve_linear(matrix.copy(), -point.residual)
        trial.change[:] = point.change + step
        now = evaluate(system, rows, grains, rounding, trial)
        if not (now <= ENOUGH * left or now <= tolerance):
            now = along_line(system, rows, grains, rounding, point, step, now, trial)
            if not now <= (1.0 - LEAST) * left:
                step = downhill(system, grains, rounding, point, matrix)
                trial.change[:] = point.change + step
                now = evaluate(system, rows, grains, rounding, trial)
                if not now <= ENOUGH * left:
                    now = along_line(
                        system, rows, grains, rounding, point, step, now, trial
                    )
        copy_point(trial, point)
        left = now
        if left < least:
            copy_point(point, best)
            least = left
    copy_point(best, point)
    return least, MOST


def copy_point(source, target) -> None:
    """Write a point into another."""
    target.change[:] = source.change
    target.wrenches[:] = source.wrenches
    target.residual[:] = source.residual


def along_line(system, rows, grains, rounding, point, step, full, trial) -> float:
    """Set a trial, which is at the end of a step from a point, to where step . r changes its sign, and return its |r|^2; it
    stays at the end where there is no such place. full: |r|^2 at the end. False position, halved on the side that stays
    (the Illinois method)."""
    start = dot(step, point.residual)
    low, high = 0.0, 1.0
    slope_low, slope_high = start, dot(step, trial.residual)
    now, last = full, 0
    if not slope_low < 0.0 < slope_high:
        return now
    for _ in range(TRIALS):
        share = low - slope_low * (high - low) / (slope_high - slope_low)
        edge = 0.05 * (high - low)
        share = min(max(share, low + edge), high - edge)
        trial.change[:] = point.change + share * step
        now = evaluate(system, rows, grains, rounding, trial)
        slope = dot(step, trial.residual)
        if abs(slope) < -FLAT * start or high - low < NARROW:
            break
        if slope < 0.0:
            slope_high *= 0.5 if last == -1 else 1.0
            low, slope_low, last = share, slope, -1
        else:
            slope_low *= 0.5 if last == 1 else 1.0
            high, slope_high, last = share, slope, 1
    return now


def downhill(system, grains, rounding, point, matrix) -> np.ndarray:
    """Return a step (n,) with step . r < 0: Newton's, with the weakest dampers that make it so."""
    end = system.velocity + system.step * point.change
    dampers = np.zeros((len(point.wrenches), 6, 6))
    twists = twists_of(system.motion, end)
    add_dampers(grains, system.motion.members, rounding, twists, dampers)
    damping, step = DAMPING, np.zeros(len(point.residual))
    while damping < STRONGEST:
        damped = matrix.copy()
        add_projected(damped, system.step * damping, system.motion, dampers)
        step = solve_linear(damped, -point.residual)
        if dot(step, point.residual) < 0.0:
            break
        damping *= STRONGER
    return step


def solve_block(system, rows, grains, rounding, accuracy, point) -> Result:
    """Return what `solve` does; for compiled code a C function of its own (`rft.mujoco.compiled_solver`)."""
    return solve(system, rows, grains, rounding, accuracy, point)


def solve(system, rows, grains, rounding, accuracy, point) -> Result:
    """Solve a step from the change of a point, which is left at the solution, or at the best that was found."""
    scale = multiply(system.inertia, system.velocity) / system.step + system.force
    size = square_over(system.lower, scale) + 1e-12
    tolerance = accuracy * accuracy * size
    best = point_at(point.change.copy(), len(point.wrenches))
    known, left, status, reached = rounding, np.inf, UNSOLVED, rounding
    total = 0
    for level in range(2 * LEVELS + 1):
        # At the required rounding; then at a wider one and from its solution at the required one, and so on.
        is_wide = level % 2 == 1
        if is_wide:
            known *= WIDER
        now, count = newton(
            system, rows, grains, known if is_wide else rounding, point, tolerance
        )
        total += count
        if now <= tolerance and not is_wide:
            return Result((now / size) ** 0.5, SOLVED, rounding, total)
        if now <= LOOSE * LOOSE * tolerance and not is_wide:
            return Result((now / size) ** 0.5, COARSER, rounding, total)
        if status == UNSOLVED and (now <= tolerance or now < left):
            copy_point(point, best)
            left = now
            if is_wide and now <= tolerance:
                status, reached = COARSER, known
    copy_point(best, point)
    return Result((left / size) ** 0.5, status, reached, total)


COMPILED = (
    system_of,
    point_at,
    evaluate,
    _write_residual,
    tangent_at,
    newton,
    copy_point,
    along_line,
    downhill,
    solve,
)
