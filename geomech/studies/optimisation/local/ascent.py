"""Ascent from one loop to the best one near it, within its constraints.

The method is sequential quadratic programming (`scipy.optimize.minimize`, SLSQP) in a
region of trust that shrinks where a loop cannot be run."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from geomech.studies.optimisation.local.objectives import Objective
from geomech.studies.optimisation.local.problem import (
    EVEN,
    Enough,
    Problem,
    is_feasible,
)
from geomech.studies.optimisation.local.stroke import Stroke

# Rad, if joints have 2.5: largest change of x in STEPS_PER_RUN steps.
TRUST_RADIUS = 0.5
STEPS_PER_RUN = 50
TRIES = 2.5  # cycles per step, at most on average
NEWTON_STEPS = 8  # of the projection onto the constraints
NEWTON_MARGIN = 1e-9  # by which a step of it stays inside the constraints
SHRINKING = 0.25  # of the trust radius, after an infeasible loop or no progress
SHORTEST = 0.01  # of the first trust radius: the ascent ends there


def ascend(
    cycles: Callable,
    objective: Objective,
    p: np.ndarray,
    *,
    turn: float = 0.0,
    max_steps: int = 100,
    tolerance: float = 1e-6,
    stroke: bool = False,
    singularity: Callable | None = None,
    away: float = 0.0,
    on_cycle: Callable = lambda: None,
    even: float = EVEN,
) -> np.ndarray:
    """Return the loop with the locally largest ``objective`` that an ascent from p
    reaches.

    cycles: `Phases` or `Runs`. turn (rad): largest net turn of a cycle, for objectives
    that are distances. max_steps: number of steps. stroke: the loop is a `Stroke`, and
    stays one. singularity: a function of shapes that is 0 at singular ones; it stays at
    least ``away`` from 0. on_cycle: called after every cycle. even: see `Problem`."""
    problem = Problem(cycles, objective, p, on_cycle, TRIES * max_steps, even)
    first_stroke = None
    if stroke:
        first_stroke = Stroke(cycles.loops, p)
    constraints = problem.constraints(turn, first_stroke, singularity, away)

    def is_same_stroke(x):
        return first_stroke is None or first_stroke.winding(problem.loop(x)) == 1

    x = problem.first
    remaining = max_steps
    trust_radius = TRUST_RADIUS
    while remaining > 0 and trust_radius > SHORTEST * TRUST_RADIUS:
        ascent = _Ascent(problem.minimised, constraints, is_same_stroke)
        steps = min(remaining, STEPS_PER_RUN)
        end = ascent.run(x, trust_radius, p.size, steps, tolerance)

        previous = x
        if ascent.best is not None:
            x = ascent.best
        change = np.abs(x - previous)[: p.size].max()

        if end == "spent":
            break
        if end == "converged" and change < trust_radius * (1 - 1e-6):
            break
        remaining -= max(ascent.steps, 1)
        if end == "infeasible":
            trust_radius *= SHRINKING
        if change == 0:
            trust_radius *= SHRINKING
    return problem.loop(x)


def project(
    cycles: Callable,
    objective: Objective,
    p: np.ndarray,
    *,
    turn: float = 0.0,
    stroke: bool = False,
    singularity: Callable | None = None,
    away: float = 0.0,
) -> np.ndarray:
    """Return a loop near p that satisfies the constraints of `ascend` up to roundoff,
    between its phases as well.

    Newton's method: each step is the shortest that satisfies the linearised
    constraints."""
    problem = Problem(cycles, objective, p, lambda: None, np.inf)
    first_stroke = None
    if stroke:
        first_stroke = Stroke(cycles.loops, p)
    constraints = problem.constraints(turn, first_stroke, singularity, away, dense=True)
    x = problem.first
    for _ in range(NEWTON_STEPS):
        values = [rule["fun"](x) for rule in constraints]
        satisfied = [
            _is_satisfied(rule["type"], value, cycles.exact)
            for rule, value in zip(constraints, values)
        ]
        if all(satisfied):
            break
        linearised = [
            (rule["type"], value, rule["jac"](x))
            for rule, value in zip(constraints, values)
        ]
        x = x + _shortest(linearised)
    return problem.loop(x)


def _is_satisfied(kind: str, value: np.ndarray, tolerance: float) -> bool:
    """Return whether the values (n,) of a constraint are 0 ("eq"), or not negative."""
    if kind == "eq":
        return bool(np.abs(value).max() <= tolerance)
    return bool(value.min() >= 0)


def _shortest(constraints: list[tuple]) -> np.ndarray:
    """Return the shortest step that satisfies linearised constraints, or zeros where no
    step does. Each constraint is (type, value, slopes)."""
    from scipy.optimize import minimize

    shifted = []
    violations = []
    for kind, y, A in constraints:
        if kind == "ineq":
            y = y - NEWTON_MARGIN
            violations.append(-y.min())
        else:
            violations.append(np.abs(y).max())
        shifted.append((kind, y, A))

    # In this unit the solver's tolerance is relative.
    unit = max(violations)
    linear = [_linear(kind, y / unit, A) for kind, y, A in shifted]
    rest = np.zeros(constraints[0][2].shape[1])
    solution = minimize(
        lambda x: (x @ x / 2, x), rest, jac=True, method="SLSQP", constraints=linear
    )
    if not solution.success:
        return rest
    return unit * solution.x


def _linear(kind: str, y: np.ndarray, A: np.ndarray) -> dict:
    """Return the constraint y + A x = 0, or >= 0, as SciPy takes it."""
    return {"type": kind, "fun": lambda x: y + A @ x, "jac": lambda x: A}


class _Ascent:
    """A recorder of iterates, which stores the best feasible one, or the last one where
    none was feasible."""

    def __init__(
        self, minimised: Callable, constraints: list[dict], is_same_stroke: Callable
    ):
        self.minimised = minimised
        self.constraints = constraints
        self.is_same_stroke = is_same_stroke
        self.best = None
        self.least = np.inf
        self.steps = -1  # the first call is that of the start

    def __call__(self, x: np.ndarray) -> None:
        self.steps += 1
        if not self.is_same_stroke(x):
            raise RuntimeError("a loop with a different number of strokes")
        if not np.isfinite(x).all():
            return
        value = np.inf
        if all(is_feasible(rule, x) for rule in self.constraints):
            value = self.minimised(x)[0]
        if value < self.least or self.least == np.inf:
            self.best = np.array(x)
            self.least = value

    def run(
        self,
        x: np.ndarray,
        trust_radius: float,
        moving: int,
        max_steps: int,
        tolerance: float,
    ) -> str:
        """Run at most ``max_steps`` steps from x, with its first ``moving`` numbers
        within ``trust_radius`` of their first values.

        Return how they end: "converged"; "unfinished"; "infeasible" at a loop that
        cannot be run or is another stroke; or "spent", after too many cycles."""
        from scipy.optimize import minimize

        radius = np.where(np.arange(len(x)) < moving, trust_radius, np.inf)
        try:
            self(x)
            with warnings.catch_warnings():
                # SciPy before 1.13 warns where it clips its own steps to the bounds.
                warnings.filterwarnings(
                    "ignore", "Values in x were outside bounds", RuntimeWarning
                )
                solution = minimize(
                    self.minimised,
                    x,
                    jac=True,
                    method="SLSQP",
                    constraints=self.constraints,
                    bounds=np.stack([x - radius, x + radius], -1),
                    options={"maxiter": max_steps, "ftol": tolerance},
                    callback=self,
                )
        except Enough:
            return "spent"
        except RuntimeError:
            return "infeasible"
        return "converged" if solution.success else "unfinished"
