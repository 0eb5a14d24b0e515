"""Body velocities of many samples: descents in the rounding, and where these fail walks along the curve of solutions.

Samples that need too many steps of `rft.balance.newton` are followed along their curve of solutions, which may turn
back on its way down (`rft.balance.path`); where that breaks, slower descents are tried."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rft.balance import arrays, backend
from rft.balance.listening import listener
from rft.balance.newton import Descent, Limits
from rft.balance.path import follow
from rft.contact import Problem
from rft.threads import each, keep_freed_memory, split, workers

STUCK_BELOW = 10.0  # an element whose ends are slower than this many times the rounding is at rest
ELEMENTS_TOGETHER = 24576  # elements x nodes x samples that NumPy solves side by side
COMPILED_WORTH = 4096  # samples a thread, below which another does not pay
FASTEST = 1e30  # velocity over the scale, of which none comes near: beyond it squares overflow, and drag reads as 0

QUICK = Descent(0.011, 0.32, 0.08, 4.0, 48.0)
WARM = Descent(0.0, 0.0, 0.0, np.inf, 12.0)  # from a good guess, at the wanted rounding at once
# Walks along a curve: size of a step's first correction, evaluations allowed. A force law alone needs no more than these;
# the slow descents are for effects, and quadrature rules, with kinks of their own that no rounding takes away.
WALKS = ((0.2, 150), (0.02, 600))
SLOW = (
    Descent(0.1, 0.1, 1e-4, 1e3, 150.0),
    Descent(0.3, 0.3, 1e-6, np.inf, 500.0),
    Descent(1.0, 0.6, 1e-8, np.inf, 3000.0),
)

keep_freed_memory()


class Solved(NamedTuple):
    """Body velocities xi (3, B), residuals, evaluations and whether an element is at rest, (B,) each; limit: of
    residuals."""

    xi: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    stuck: np.ndarray
    limit: float


class Accuracy(NamedTuple):
    """How finely to solve. rounding: speed, over the scale, below which dry friction is linear. tolerance: residual to
    reach."""

    rounding: float
    tolerance: float


def solve(
    problem_at: Callable[[np.ndarray], Problem],
    scale: np.ndarray,
    accuracy: Accuracy,
    law,
    points: int,
    method: str = "auto",
    threads: int | None = None,
    guess: np.ndarray | None = None,
) -> Solved:
    """Return the body velocities of B samples, in body lengths.

    problem_at(index): the balance of these samples. scale: (B,), the size of their velocities. law: its record. points:
    places of a sample at which the law is evaluated, by which samples are put together. method: a back end
    (`rft.balance.backend`). guess: (3, B), tried first but where it is nan, or beyond FASTEST."""
    size, tell = scale.size, listener()
    together = max(1, ELEMENTS_TOGETHER // points)
    driver, useful = arrays, 2 * together
    if backend.compiles(method, law):
        from rft.balance import compiled

        driver, useful, together = compiled, COMPILED_WORTH, 4 * together
    xi, stuck = np.zeros((3, size)), np.zeros(size, bool)
    residual, iterations, limit = np.full(size, np.inf), np.zeros(size, int), np.zeros(size)

    def take(index, found, limits: Limits, linear: bool) -> None:
        new, left, evaluations, slowest = found
        xi[:, index], residual[index] = new, np.where(is_possible(new), left, np.inf)
        stuck[index] = (slowest < STUCK_BELOW * accuracy.rounding) & (not linear)
        iterations[index] += evaluations
        limit[index] = limits.residual

    def descend(share, stop) -> None:
        for index in split(share, math.ceil(share.size / together)):
            if stop.is_set():
                return
            problem = problem_at(index)
            limits = _limits(problem, accuracy)
            new = int(np.count_nonzero(iterations[index] == 0))
            index = slice(None) if index.size == size else index  # which is quicker
            first = guess[:, index] if attempt is WARM else None
            found = driver.solve(problem, _begin(attempt, problem, limits), limits, first)
            take(index, found, limits, problem.linear)
            if new:
                tell(new, points, problem.linear)

    def walk(share) -> None:
        for index in split(share, math.ceil(share.size / together)):
            problem = problem_at(index)
            limits = _limits(problem, accuracy)
            for i, *found in follow(problem, limits, driver.nets, *attempt):
                solved = (found[1] <= limits.residual) & is_possible(found[0])
                take(index[i[solved]], [x[..., solved] for x in found], limits, problem.linear)
                iterations[index[i[~solved]]] += found[2][~solved]

    todo = np.arange(size)
    if guess is not None:
        with np.errstate(over="ignore"):
            guess = guess / scale
    for attempt in (WARM,) * (guess is not None) + (QUICK, *WALKS, *SLOW):
        some = todo[is_possible(guess[:, todo])] if attempt is WARM else todo
        if some.size and isinstance(attempt, Descent):
            each(descend, split(some, workers(threads, some.size // useful)))
        elif some.size:
            walk(some)
        solved = residual <= limit
        if solved.all():
            break
        todo = np.flatnonzero(~solved)
    return Solved(xi * scale, residual, iterations, stuck, float(limit.max(initial=0.0)))


def is_possible(xi: np.ndarray) -> np.ndarray:
    """Return whether velocities over the scale (3, B) are numbers that the solver can compute with, (B,)."""
    return (np.abs(xi) < FASTEST).all(0)


def _begin(descent: Descent, problem: Problem, limits: Limits) -> Descent:
    """Return the descent with its first rounding, which is the last one in a linear medium."""
    first = limits.last if problem.linear else max(descent.first, limits.last)
    return descent._replace(first=first)


def _limits(problem: Problem, accuracy: Accuracy) -> Limits:
    """Return the goals, with the roundoff of the largest forces."""
    residual = accuracy.tolerance + 1e-14 * max(1.0, problem.lateral / problem.unit)
    if problem.momenta is not None:
        frame, m = problem.frame, problem.momenta
        residual += 1e-14 * np.max(m.rate * m.strength * frame.speed / frame.force)
    return Limits(accuracy.rounding, residual)
