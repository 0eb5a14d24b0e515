"""Body velocities of many samples: descents in the rounding, then walks along the curve
of solutions.

Samples that a descent (`rft.formulas.newton`) leaves unsolved are followed along their
curve of solutions, which may fold (`rft.balance.path`); samples that the walks leave
unsolved take slower descents."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from types import ModuleType
from typing import NamedTuple

import numpy as np

from rft.balance import arrays
from rft.balance.backend import solves_compiled
from rft.balance.listening import listener
from rft.balance.path import follow
from rft.core.threads import keep_freed_memory, run_shares, split, thread_count
from rft.effects.contact import Assembly, Problem
from rft.formulas.newton import (
    EVALUATIONS,
    RESIDUAL,
    RESULT_ROWS,
    Descent,
    Limits,
    is_possible,
)

# An element whose ends are slower than this many times the rounding is at rest.
STUCK_BELOW = 10.0
ELEMENTS_TOGETHER = 24576  # elements x nodes x samples in one batch of NumPy
COMPILED_WORTH = 4096  # samples a thread, below which another thread does not pay

QUICK = Descent(0.011, 0.32, 0.08, 4.0, 48.0)
WARM = Descent(0.0, 0.0, 0.0, np.inf, 12.0)  # from a guess, on the last level alone
# Walks along a curve: intended size of a step's first correction, most evaluations. A
# force law alone needs no more than these; the slow descents are for effects and
# quadrature rules whose kinks are not rounded off.
WALKS = ((0.2, 150), (0.02, 600), (0.005, 2000), (0.001, 5000))
SLOW = (
    Descent(0.1, 0.1, 1e-4, 1e3, 150.0),
    Descent(0.3, 0.3, 1e-6, np.inf, 500.0),
    Descent(1.0, 0.6, 1e-8, np.inf, 3000.0),
)

keep_freed_memory()


class Solutions(NamedTuple):
    """Solutions. xi: (3, B), body velocities. residual, iterations, stuck: (B,),
    residuals, evaluations, and whether an element is at rest. limit: largest residual
    of a solved sample."""

    xi: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    stuck: np.ndarray
    limit: float


class Accuracy(NamedTuple):
    """Required accuracy. rounding: speed, over the scale of speed, below which dry
    friction is linear. tolerance: residual of a solution."""

    rounding: float
    tolerance: float


def solve(
    problem_at: Callable[[np.ndarray], Problem],
    scale: np.ndarray,
    accuracy: Accuracy,
    assembly: Assembly,
    backend: str = "auto",
    threads: int | None = None,
    guess: np.ndarray | None = None,
) -> Solutions:
    """Return the body velocities of B samples, in body lengths.

    problem_at(index): the `Problem` of the samples ``index``. scale: (B,), its scale of
    speed. backend: as in `rft.balance.backend`. guess: (3, B), tried first except where
    it is nan, or beyond FASTEST."""
    size = scale.size
    report = listener()
    linear = assembly.linear
    batch = max(1, ELEMENTS_TOGETHER // assembly.n_law_points)
    descend_all, walk_all = arrays.solve, follow
    worth = 2 * batch  # samples that pay for a thread
    if solves_compiled(backend, assembly.law):
        compiled = compiled_driver()
        descend_all, walk_all = compiled.solve, compiled.follow
        worth = COMPILED_WORTH
        batch = 4 * batch
    methods: list = [QUICK, *WALKS, *SLOW]
    if guess is not None:
        methods.insert(0, WARM)
        with np.errstate(over="ignore"):
            guess = guess / scale
    unsolved = np.arange(size)
    starts = guess is None or is_possible(*guess).all()
    if starts and 0 < size <= min(batch, worth):
        # Few samples, which most often take one descent: nothing is shared out.
        problem = problem_at(unsolved)
        limits = problem_limits(problem, accuracy)
        descent = begin(methods.pop(0), linear, limits)
        results = descend_all(problem, descent, limits, guess)
        report(size, assembly.n_law_points, linear)
        solved = results[RESIDUAL] <= limits.residual
        if solved.all():
            limit = float(np.max(limits.residual))
            return _solutions(results, scale, limit, accuracy, linear)
        limit = np.full(size, limits.residual)
        unsolved = np.flatnonzero(~solved)
    else:
        results = np.zeros((RESULT_ROWS, size))
        results[RESIDUAL] = np.inf
        limit = np.zeros(size)

    def store(index, new, limits: Limits) -> None:
        new[EVALUATIONS] += results[EVALUATIONS, index]
        results[:, index] = new
        limit[index] = limits.residual

    def descend(share, stop) -> None:
        for index in split(share, math.ceil(share.size / batch)):
            if stop.is_set():
                return
            problem = problem_at(index)
            limits = problem_limits(problem, accuracy)
            if index.size == size:
                index = slice(None)  # a slice is quicker
            first = None
            if method is WARM:
                first = guess[:, index]
            n_new = problem.n_samples - np.count_nonzero(results[EVALUATIONS, index])
            descent = begin(method, linear, limits)
            store(index, descend_all(problem, descent, limits, first), limits)
            if n_new:
                report(n_new, assembly.n_law_points, linear)

    def walk(share) -> None:
        for index in split(share, math.ceil(share.size / batch)):
            for problem, run in problem_at(index).by_medium():
                walk_together(problem, index[run])

    def walk_together(problem, index) -> None:
        limits = problem_limits(problem, accuracy)
        for i, ended in walk_all(problem, limits, *method):
            solved = ended[RESIDUAL] <= limits.residual
            store(index[i[solved]], ended[:, solved], limits)
            results[EVALUATIONS, index[i[~solved]]] += ended[EVALUATIONS, ~solved]

    for method in methods:
        active = unsolved
        if method is WARM:
            active = unsolved[is_possible(*guess[:, unsolved])]
        if active.size and isinstance(method, Descent):
            count = thread_count(threads, active.size // worth)
            run_shares(descend, split(active, count))
        elif active.size:
            walk(active)
        solved = results[RESIDUAL] <= limit
        if solved.all():
            break
        unsolved = np.flatnonzero(~solved)
    else:
        # A sample that its own limit leaves unsolved is above the largest one, too.
        beyond = np.nextafter(limit.max(), np.inf)
        results[RESIDUAL, unsolved] = np.maximum(results[RESIDUAL, unsolved], beyond)
    limit = float(limit.max(initial=0.0))
    return _solutions(results, scale, limit, accuracy, linear)


def _solutions(
    results: np.ndarray,
    scale: np.ndarray,
    limit: float,
    accuracy: Accuracy,
    linear: bool,
) -> Solutions:
    """Return the solutions in the rows of results."""
    residual, evaluations, slowest = results[RESIDUAL:]
    stuck = (slowest < STUCK_BELOW * accuracy.rounding) & (not linear)
    return Solutions(
        results[:3] * scale, residual, evaluations.astype(int), stuck, limit
    )


@functools.cache
def compiled_driver() -> ModuleType:
    """Return the module of the compiled driver."""
    from rft.balance import compiled

    return compiled


def begin(descent: Descent, linear: bool, limits: Limits) -> Descent:
    """Return the descent with the rounding of its first level, which is also the last
    level in a linear medium."""
    first = limits.rounding
    if not linear:
        first = max(descent.first, first)
    return Descent(first, *descent[1:])


def problem_limits(problem: Problem, accuracy: Accuracy) -> Limits:
    """Return the limits of a problem, whose residual allows for roundoff of the largest
    forces."""
    rounding, residual, *_ = limits_of(problem, accuracy)
    if problem.momentum_rate is not None:
        frame = problem.frame
        m = problem.momentum_rate
        inertia = m.rate * m.strength * frame.speed_scale / frame.force_scale
        residual += 1e-14 * float(np.max(inertia))
    return Limits(rounding, residual)


def limits_of(drag: Problem | Assembly, accuracy: Accuracy) -> Limits:
    """Return the limits of a massless body with the largest forces of its drag."""
    ratio = drag.lateral_drag / drag.axial_drag
    if isinstance(ratio, np.ndarray):
        largest = np.maximum(1.0, ratio)  # of a batch of media
    else:
        largest = max(1.0, ratio)
    return Limits(float(accuracy.rounding), accuracy.tolerance + 1e-14 * largest)


def from_guess(
    problem: Problem,
    scale: np.ndarray,
    accuracy: Accuracy,
    assembly: Assembly,
    guess: np.ndarray,
    solve_once: Callable,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return xi, residual and limit as of `Solutions`, as Newton's method finds them
    from a guess: what `solve` does first, with less work around it, for a small batch.

    solve_once: the function ``solve`` of the driver."""
    limits = problem_limits(problem, accuracy)
    descent = begin(WARM, assembly.linear, limits)
    with np.errstate(over="ignore"):
        guess = guess / scale
    results = solve_once(problem, descent, limits, guess)
    solved = np.count_nonzero(results[RESIDUAL] <= limits.residual)
    listener()(solved, assembly.n_law_points, assembly.linear)
    return results[:3] * scale, results[RESIDUAL], limits.residual
