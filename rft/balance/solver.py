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
WALKS = ((0.2, 150), (0.02, 600))
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
    driver = arrays
    worth = 2 * batch  # samples that pay for a thread
    if solves_compiled(backend, assembly.law):
        driver = compiled_driver()
        worth = COMPILED_WORTH
        batch = 4 * batch
    results = np.zeros((RESULT_ROWS, size))
    limit = np.zeros(size)
    results[RESIDUAL] = np.inf

    def store(index, new, limits: Limits) -> None:
        new[EVALUATIONS] += results[EVALUATIONS, index]
        results[:, index] = new
        limit[index] = limits.residual

    def descend(share, stop) -> None:
        for index in split(share, math.ceil(share.size / batch)):
            if stop.is_set():
                return
            problem = problem_at(index)
            limits = _limits(problem, accuracy)
            if index.size == size:
                index = slice(None)  # a slice is quicker
            first = None
            if method is WARM:
                first = guess[:, index]
            n_new = problem.n_samples - np.count_nonzero(results[EVALUATIONS, index])
            descent = _begin(method, linear, limits)
            store(index, driver.solve(problem, descent, limits, first), limits)
            if n_new:
                report(n_new, assembly.n_law_points, linear)

    def walk(share) -> None:
        for index in split(share, math.ceil(share.size / batch)):
            for problem, run in problem_at(index).by_medium():
                walk_together(problem, index[run])

    def walk_together(problem, index) -> None:
        limits = _limits(problem, accuracy)
        for i, ended in follow(problem, limits, driver.nets, *method):
            solved = ended[RESIDUAL] <= limits.residual
            store(index[i[solved]], ended[:, solved], limits)
            results[EVALUATIONS, index[i[~solved]]] += ended[EVALUATIONS, ~solved]

    unsolved = np.arange(size)
    methods: list = [QUICK, *WALKS, *SLOW]
    if guess is not None:
        methods.insert(0, WARM)
        with np.errstate(over="ignore"):
            guess = guess / scale
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
    residual, evaluations, slowest = results[RESIDUAL:]
    stuck = (slowest < STUCK_BELOW * accuracy.rounding) & (not linear)
    return Solutions(
        results[:3] * scale,
        residual,
        evaluations.astype(int),
        stuck,
        float(limit.max(initial=0.0)),
    )


@functools.cache
def compiled_driver() -> ModuleType:
    """Return the module of the compiled driver."""
    from rft.balance import compiled

    return compiled


def _begin(descent: Descent, linear: bool, limits: Limits) -> Descent:
    """Return the descent with the rounding of its first level, which is also the last
    level in a linear medium."""
    if linear:
        return descent._replace(first=limits.rounding)
    return descent._replace(first=max(descent.first, limits.rounding))


def _limits(problem: Problem, accuracy: Accuracy) -> Limits:
    """Return the limits of a problem, whose residual allows for roundoff of the largest
    forces."""
    ratio = problem.lateral_drag / problem.axial_drag
    largest = (
        np.maximum(1.0, ratio) if isinstance(ratio, np.ndarray) else max(1.0, ratio)
    )
    residual = accuracy.tolerance + 1e-14 * largest
    if problem.momentum_rate is not None:
        frame = problem.frame
        m = problem.momentum_rate
        inertia = m.rate * m.strength * frame.speed_scale / frame.force_scale
        residual += 1e-14 * np.max(inertia)
    return Limits(float(accuracy.rounding), residual)
