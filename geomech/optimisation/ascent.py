"""Ascent from one loop to the best one near it, within its constraints, by sequential quadratic programming."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from geomech.optimisation.objectives import Objective
from geomech.optimisation.problem import EVEN, Enough, Problem, is_feasible
from geomech.optimisation.stroke import Stroke

TRUST_RADIUS = (
    0.5  # largest change of x (rad, if joints have 2.5) in STEPS_PER_RUN steps
)
STEPS_PER_RUN = 50
TRIES = 2.5  # cycles per step, at most on average
NEWTON_STEPS, INSIDE = (
    8,
    1e-9,
)  # steps of Newton's method, and their margin inside the constraints
SHORTER, SHORTEST = (
    0.25,
    0.01,
)  # of the trust radius: after an infeasible loop or no progress; and at the end


def ascend(
    cycles: Callable, objective: Objective, p: np.ndarray, *, turn: float = 0.0, max_steps: int = 100, tolerance: float = 1e-6,
    stroke: bool = False, singularity: Callable | None = None, away: float = 0.0, on_cycle: Callable = lambda: None,
    even: float = EVEN,
) -> np.ndarray:  # fmt: skip
    """Return the loop with the locally largest ``objective`` that an ascent from the loop ``p`` reaches.

    cycles: `Phases` or `Runs`. turn (rad): largest net turn of a cycle, for objectives that are distances. max_steps: steps.
    stroke: the loop is a `Stroke`, and stays one. singularity: a function of shapes that is 0 at singular ones; it
    stays at least ``away`` from 0. on_cycle: called after every cycle. even: see `Problem`."""
    problem, once_round = (
        Problem(cycles, objective, p, on_cycle, TRIES * max_steps, even),
        Stroke(cycles.loops, p) if stroke else None,
    )
    constraints = problem.constraints(turn, once_round, singularity, away)
    is_same_stroke = lambda x: (
        once_round is None or once_round.winding(problem.loop(x)) == 1
    )
    x, remaining, trust_radius = problem.first, max_steps, TRUST_RADIUS
    while remaining > 0 and trust_radius > SHORTEST * TRUST_RADIUS:
        ascent = _Ascent(problem.minimised, constraints, is_same_stroke)
        end = ascent.run(
            x, trust_radius, p.size, min(remaining, STEPS_PER_RUN), tolerance
        )
        previous, x = x, x if ascent.best is None else ascent.best
        remaining = 0 if end == "spent" else remaining - max(ascent.steps, 1)
        moved = np.abs(x - previous)[: p.size].max()
        if end == "converged" and moved < trust_radius * (1 - 1e-6):
            break
        trust_radius *= (SHORTER if end == "infeasible" else 1.0) * (
            SHORTER if moved == 0 else 1.0
        )
    return problem.loop(x)


def project(
    cycles: Callable, objective: Objective, p: np.ndarray, *, turn: float = 0.0, stroke: bool = False,
    singularity: Callable | None = None, away: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """Return a loop near ``p`` that satisfies all constraints of `ascend`, between its phases, too, up to roundoff.

    Newton's method: each step is the shortest that satisfies the linearised constraints."""
    problem = Problem(cycles, objective, p, lambda: None, np.inf)
    constraints = problem.constraints(
        turn, Stroke(cycles.loops, p) if stroke else None, singularity, away, dense=True
    )
    x = problem.first
    for _ in range(NEWTON_STEPS):
        at = [(rule["type"], rule["fun"](x)) for rule in constraints]
        if all(
            np.abs(y).max() <= cycles.exact if kind == "eq" else y.min() >= 0
            for kind, y in at
        ):
            break
        x = x + _shortest(
            [(kind, y, rule["jac"](x)) for (kind, y), rule in zip(at, constraints)]
        )
    return problem.loop(x)


def _shortest(constraints: list[tuple]) -> np.ndarray:
    """Return the shortest step that satisfies linearised constraints (type, value, slopes), or zeros where none does."""
    from scipy.optimize import minimize

    constraints = [
        (kind, y - INSIDE * (kind == "ineq"), A) for kind, y, A in constraints
    ]
    unit = max(
        np.abs(y).max() if kind == "eq" else -y.min() for kind, y, _ in constraints
    )  # so that the solver's tolerance is relative
    linear = [
        {
            "type": kind,
            "fun": lambda x, y=y / unit, A=A: y + A @ x,
            "jac": lambda x, A=A: A,
        }
        for kind, y, A in constraints
    ]
    still = np.zeros(constraints[0][2].shape[1])
    solution = minimize(
        lambda x: (x @ x / 2, x), still, jac=True, method="SLSQP", constraints=linear
    )
    return unit * solution.x if solution.success else still


class _Ascent:
    """A recorder of iterates: it stores the best feasible one, or the last where none was feasible."""

    def __init__(
        self, minimised: Callable, constraints: list[dict], is_same_stroke: Callable
    ):
        (
            self.minimised,
            self.constraints,
            self.is_same_stroke,
            self.best,
            self.least,
            self.steps,
        ) = (
            minimised,
            constraints,
            is_same_stroke,
            None,
            np.inf,
            -1,
        )

    def __call__(self, x: np.ndarray) -> None:
        self.steps += 1
        if not self.is_same_stroke(x):
            raise RuntimeError("a loop of another number of strokes")
        value = (
            self.minimised(x)[0]
            if np.isfinite(x).all()
            and all(is_feasible(rule, x) for rule in self.constraints)
            else np.inf
        )
        if value < self.least or (self.least == np.inf and np.isfinite(x).all()):
            self.best, self.least = np.array(x), value

    def run(
        self,
        x: np.ndarray,
        trust_radius: float,
        moving: int,
        max_steps: int,
        tolerance: float,
    ) -> str:
        """Run at most ``max_steps`` steps from x, with the first ``moving`` numbers within ``trust_radius`` of it, and
        return how they end: "converged"; "unfinished"; "infeasible" at a loop that cannot be run or is another stroke;
        or "spent"."""
        from scipy.optimize import minimize

        radius = np.where(np.arange(len(x)) < moving, trust_radius, np.inf)
        try:
            self(x)
            with (
                warnings.catch_warnings()
            ):  # SciPy before 1.13 warns where it clips its own steps to the bounds
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
