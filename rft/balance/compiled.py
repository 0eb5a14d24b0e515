"""The compiled driver: problems as arguments of kernels, which are built ahead of time
for closed laws where a wheel brings them, and compiled by numba else."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rft.balance import ahead
from rft.effects.contact import NO_FACTOR, Problem, mapped
from rft.formulas.momentum import frame_inertia
from rft.formulas.newton import RESULT_ROWS, Descent, Limits, Net, with_momentum
from rft.laws.batch import MediumBatch

NET_ROWS = 15  # of the sums of forces: the numbers of a `Net`
DOUBLE = np.dtype(float)
NO_GUESS = np.zeros((3, 0))
NO_ROWS = np.zeros((0, 1, 1))
NO_POINTS = np.zeros((9, 0, 1))
NO_TERMS = np.zeros((0, 0, 3))


class Kernels(NamedTuple):
    """Compiled functions for one class of law records: the solver, and the sum of
    forces at given velocities (`rft.balance.kernels`)."""

    solve: Callable
    net_at: Callable


@functools.cache
def kernels_of(Law: type) -> Kernels:
    """Return the kernels for one class of law records; where they are not built yet,
    numba is loaded, and compiles each when it is called first."""
    if ahead.has(Law):
        built = ahead.library()
        return Kernels(built.solve, built.net_at)

    from rft.balance import kernels

    return Kernels(kernels.kernel(Law), kernels.net_kernel(Law))


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


def nets(
    problem: Problem, v: np.ndarray, rounding: np.ndarray, xi: np.ndarray
) -> np.ndarray:
    """Return the entries of `Net` as `rft.balance.arrays.nets` does."""
    p = problem
    out = np.empty((NET_ROWS, problem.n_samples))
    kernels_of(type(p.law)).net_at(load_arguments(p), plain(v), rounding, out)
    out = out.reshape(5, 3, -1)
    if p.momentum_rate is None:
        return out
    mass = mapped(lambda x: x[0], frame_inertia(p.sides.elements, p.momentum_rate))
    net = Net(*map(tuple, out))
    return np.array(with_momentum(net, *xi, mass, p.law_speed_scale[0]))


def solve(
    problem: Problem, descent: Descent, limits: Limits, guess: np.ndarray | None
) -> np.ndarray:
    """Solve all samples by one descent as `rft.balance.arrays.solve` does."""
    if isinstance(problem.medium, MediumBatch):
        return _solve_media(problem, descent, limits, guess)
    p = problem
    out = np.empty((RESULT_ROWS, problem.n_samples))
    mass = NO_ROWS
    if p.momentum_rate is not None:
        mass = stacked(frame_inertia(p.sides.elements, p.momentum_rate))
    if guess is None:
        guess = NO_GUESS
    guess = plain(guess)
    arguments = load_arguments(p)
    kernels_of(type(p.law)).solve(arguments, mass, guess, descent, limits, out)
    return out


def _solve_media(
    problem: Problem, descent: Descent, limits: Limits, guess: np.ndarray | None
) -> np.ndarray:
    """Solve the samples of a batch of media, one medium after the other, for a kernel
    takes the numbers of one law."""
    out = np.empty((RESULT_ROWS, problem.n_samples))
    first = None
    for of_medium, run in problem.by_medium():
        if guess is not None:
            first = guess[:, run]
        of_run = limits._replace(residual=float(limits.residual[run.start]))
        out[:, run] = solve(of_medium, descent, of_run, first)
    return out
