"""The compiled driver: problems as arguments of kernels, which are built ahead of time
for closed laws where a wheel brings them, and compiled by numba else."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rft.balance import ahead
from rft.bodies.base import Elements
from rft.effects.contact import NO_FACTOR, Problem
from rft.formulas.momentum import frame_inertia
from rft.formulas.newton import RESULT_ROWS, Descent, Limits
from rft.laws.batch import MediumBatch

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


@functools.cache
def joint_kernel(Law: type) -> Callable:
    """Return the compiled steps of joints that give way for one class of law records,
    and load numba where they are not built yet."""
    if ahead.has(Law):
        return ahead.library().joint_steps

    from rft.balance import joints

    return joints.step_kernel(Law)


@functools.cache
def velocity_kernel() -> Callable:
    """Return the compiled velocities of elements, and load numba where it is not built
    yet."""
    if ahead.library() is not None:
        return ahead.library().velocities_of_elements

    from rft.balance import kernels

    return kernels.velocity_kernel()


def element_velocities(elements: Elements, xi: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the velocities (v_t, v_n, v_w) of elements, (n, B) each, at a body
    velocity xi (3, B)."""
    out = np.empty((3, len(elements.c), xi.shape[1]))
    velocity_kernel()(plain_arrays(elements), plain(xi), out)
    return tuple(out)


@functools.cache
def element_kernel(formula: Callable) -> Callable:
    """Return the compiled update of numbers of elements by a formula, and load numba
    where it is not built yet."""
    built = ahead.element_kernel(formula)
    if built is not None:
        return built

    from rft.balance import kernels

    return kernels.element_kernel(formula)


def element_update(
    formula: Callable, arguments: tuple[np.ndarray, ...], shape: tuple[int, int, int]
) -> np.ndarray:
    """Return the k numbers of all elements, of shape (k, n, B), by a formula of arrays
    that broadcast to (n, B)."""
    out = np.empty(shape)
    element_kernel(formula)(plain_arrays(arguments), out)
    return out


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


class Known(NamedTuple):
    """Arguments of kernels by the ids of the records that they are made of, and the
    problem that these belong to and that keeps them."""

    problem: Problem
    arguments: dict[int, Any]


def known_arguments(problem: Problem) -> Known:
    """Return the arguments that a problem shares with those that effects make of it at
    each step."""
    sides = problem.sides.elements
    points = problem.points.elements
    terms = problem.point_terms
    arguments = {
        id(problem.law): law_numbers(problem.law),
        id(sides): plain_arrays(sides),
        id(points): stacked(points),
        id(terms): terms_by_point(terms),
    }
    return Known(problem, arguments)


def law_numbers(law) -> tuple:
    """Return the numbers of a law's record as kernels take them."""
    return tuple(map(kernel_number, law))


def terms_by_point(terms: np.ndarray) -> np.ndarray:
    """Return dry terms (T, 3, n, 1) of points as (n, T, 3)."""
    return plain(terms[..., 0].transpose(2, 0, 1))


def load_arguments(problem: Problem, known: Known | None = None) -> tuple:
    """Return the arguments of kernels that describe the loads of a problem: numbers of
    the law; elements, factors, quadratic drag and memory of the ground, and incline of
    sides and of points; dry terms of the points; the frame with the scale of speed;
    additions. Records that do not apply have no rows, for speed."""
    p = problem

    def made(function, record):
        if known is not None and id(record) in known.arguments:
            return known.arguments[id(record)]
        return function(record)

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
        elements = made(stacked, p.points.elements)
        terms = made(terms_by_point, p.point_terms)

    sides = made(plain_arrays, p.sides.elements), factors[0], ground, inclines[0]
    points = elements, factors[1], NO_ROWS, inclines[1]
    frame = (*plain_arrays(p.frame), plain(p.law_speed_scale))
    return made(law_numbers, p.law), sides, points, terms, frame, additions


def solve(
    problem: Problem,
    descent: Descent,
    limits: Limits,
    guess: np.ndarray | None,
    known: Known | None = None,
) -> np.ndarray:
    """Solve all samples by one descent as `rft.balance.arrays.solve` does."""
    if isinstance(problem.medium, MediumBatch):
        return _solve_media(problem, descent, limits, guess)
    p = problem
    out = np.empty((RESULT_ROWS, problem.n_samples))
    if guess is None:
        guess = NO_GUESS
    guess = plain(guess)
    arguments = load_arguments(p, known)
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
