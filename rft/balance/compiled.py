"""The compiled driver: problems as arguments of kernels, which are built ahead of time
for closed laws where a wheel brings them, and compiled by numba else."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rft.balance import ahead
from rft.effects.contact import NO_FACTOR, Problem
from rft.formulas.momentum import frame_inertia
from rft.formulas.newton import RESULT_ROWS, Descent, Limits

DOUBLE = np.dtype(float)
NO_GUESS = np.zeros((3, 0))
NO_ROWS = np.zeros((0, 1, 1))
NO_POINTS = np.zeros((9, 0, 1))
NO_TERMS = np.zeros((0, 0, 3))


class Kernels(NamedTuple):
    """Compiled functions for one class of law records: a descent, a descent of chains
    (`rft.balance.kernels`), and walks (`rft.balance.walks`)."""

    solve: Callable
    velocities: Callable
    walk: Callable


@functools.cache
def kernels_of(Law: type) -> Kernels:
    """Return the kernels for one class of law records; where they are not built yet,
    numba is loaded, and compiles each when it is called first."""
    if ahead.has(Law):
        built = ahead.library()
        return Kernels(built.solve, built.velocities, built.walk)

    from rft.balance import kernels, walks

    return Kernels(
        kernels.kernel(Law), kernels.chain_kernel(Law), walks.walk_kernel(Law)
    )


def plain(x) -> np.ndarray:
    """Return an array as doubles in C order that may be written to, the only form that
    kernels are compiled for."""
    if x.dtype is DOUBLE and x.flags.carray:
        return x
    return np.array(x, float, order="C")


def plain_arrays(record) -> tuple[np.ndarray, ...]:
    """Return each array of a record as `plain` does."""
    return tuple([plain(x) for x in record])


def stacked(record) -> np.ndarray:
    """Return the arrays of a record as one array (rows, n, B)."""
    out = np.empty((len(record), *np.broadcast(*record).shape))
    for row, x in zip(out, record):
        row[:] = x
    return out


def kernel_number(x) -> np.ndarray | float:
    """Return a number of a law as a float, an array as two-dimensional, the nodes of a
    rule as a column."""
    if not isinstance(x, np.ndarray) or x.ndim == 0:
        return float(x)
    if x.ndim > 2:
        x = x.reshape(-1, 1)
    return plain(x)


def load_arguments(problem: Problem) -> tuple:
    """Return the arguments of kernels that describe the loads of a problem: numbers of
    the law; elements, factors, quadratic drag and memory of the ground, and incline of
    sides and of points; dry terms of the points; the frame with the scale of speed;
    additions. Records that do not apply have no rows, for speed."""
    p = problem
    additions = problem.additions
    has_points = len(p.points.station) > 0
    ground = NO_ROWS
    if additions.quadratic or additions.memory:
        ground = stacked((p.quadratic_drag, *p.memory))

    factors = [NO_ROWS, NO_ROWS]
    inclines = [NO_ROWS, NO_ROWS]
    for k, contact in enumerate((p.sides, p.points)):
        if contact.factor is not NO_FACTOR:
            factors[k] = stacked(contact.factor)
        if additions.incline:
            inclines[k] = stacked(contact.incline)

    elements = NO_POINTS
    terms = NO_TERMS
    if has_points:
        elements = stacked(p.points.elements)
        terms = plain(p.point_terms[..., 0].transpose(2, 0, 1))

    sides = plain_arrays(p.sides.elements), factors[0], ground, inclines[0]
    points = elements, factors[1], NO_ROWS, inclines[1]
    frame = (*plain_arrays(p.frame), plain(p.law_speed_scale))
    return tuple(map(kernel_number, p.law)), sides, points, terms, frame, additions


def solve(
    problem: Problem, descent: Descent, limits: Limits, guess: np.ndarray | None
) -> np.ndarray:
    """Solve all samples by one descent as `rft.balance.arrays.solve` does."""
    p = problem
    out = np.empty((RESULT_ROWS, problem.n_samples))
    if guess is None:
        guess = NO_GUESS
    guess = plain(guess)
    arguments = load_arguments(p)
    kernels_of(type(p.law)).solve(arguments, mass_of(p), guess, descent, limits, out)
    return out


def follow(
    problem: Problem, limits: Limits, correction: float, budget: int
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Solve all samples as `rft.balance.path.follow` does."""
    p = problem
    out = np.empty((RESULT_ROWS, problem.n_samples))
    walk = kernels_of(type(p.law)).walk
    arguments = load_arguments(p)
    walk(arguments, mass_of(p), p.is_scale_free, limits, correction, budget, out)
    return [(np.arange(problem.n_samples), out)]


def mass_of(problem: Problem) -> np.ndarray:
    """Return the rows of `Inertia` (13, 1, B) of a problem; none without mass."""
    if problem.momentum_rate is None:
        return NO_ROWS
    return stacked(frame_inertia(problem.sides.elements, problem.momentum_rate))
