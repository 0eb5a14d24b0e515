"""The way up: sequential quadratic programming from one loop to the best one near, inside its limits."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from geomech.optimise.aims import Aim
from geomech.optimise.problem import EVEN, Enough, Problem, kept
from geomech.optimise.stroke import Stroke

STRIDE = 0.5  # rad, if joints have 2.5: how far the numbers go in so many steps, from one loop to one near
TOGETHER = 50
TRIES = 2.5  # cycles that a step takes, at most in the mean
SETTLING, INSIDE = 8, 1e-9  # steps of Newton's method, and how far inside of a rule they aim
SHORTER, SHORTEST = 0.25, 0.01  # of the stride: after a loop that cannot be run, or no way up; and at the end


def climb(
    cycles: Callable, aim: Aim, p: np.ndarray, *, turn: float = 0.0, most: int = 100, tolerance: float = 1e-6,
    stroke: bool = False, singularity: Callable | None = None, away: float = 0.0, told: Callable = lambda: None,
    even: float = EVEN,
) -> np.ndarray:  # fmt: skip
    """The loop that ``aim`` leads to from ``p``; cycles: `Phases` or `Runs`. turn (rad): of a cycle, at most, where the aim is
    to get along. stroke: the loop is a `Stroke`, and stays one. singularity: of shapes, nowhere nearer to 0 than ``away``.
    even: as of `Problem`."""
    problem, once = Problem(cycles, aim, p, told, TRIES * most, even), Stroke(cycles.loops, p) if stroke else None
    rules = problem.rules(turn, once, singularity, away)
    same = lambda x: once is None or once.winding(problem.loop(x)) == 1
    x, left, stride = problem.first, most, STRIDE
    while left > 0 and stride > SHORTEST * STRIDE:
        way = _Way(problem.down, rules, same)
        ended = way.followed(x, stride, p.size, min(left, TOGETHER), tolerance)
        begun, x = x, x if way.best is None else way.best
        left = 0 if ended == "spent" else left - max(way.steps, 1)
        gone = np.abs(x - begun)[: p.size].max()
        if ended == "there" and gone < stride * (1 - 1e-6):
            break
        stride *= (SHORTER if ended == "stuck" else 1.0) * (SHORTER if gone == 0 else 1.0)
    return problem.loop(x)


def settled(
    cycles: Callable, aim: Aim, p: np.ndarray, *, turn: float = 0.0, stroke: bool = False,
    singularity: Callable | None = None, away: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """The loop next to ``p`` that keeps all rules of `climb` to rounding, and between its phases: by Newton's method, each
    step the shortest that keeps them by their slopes."""
    problem = Problem(cycles, aim, p, lambda: None, np.inf)
    rules = problem.rules(turn, Stroke(cycles.loops, p) if stroke else None, singularity, away, dense=True)
    x = problem.first
    for _ in range(SETTLING):
        at = [(rule["type"], rule["fun"](x)) for rule in rules]
        if all(np.abs(y).max() <= cycles.exact if kind == "eq" else y.min() >= 0 for kind, y in at):
            break
        x = x + _shortest([(kind, y, rule["jac"](x)) for (kind, y), rule in zip(at, rules)])
    return problem.loop(x)


def _shortest(rules: list[tuple]) -> np.ndarray:
    """The shortest step that keeps rules (type, value, slopes), as far as they are linear; none where no step does."""
    from scipy.optimize import minimize

    rules = [(kind, y - INSIDE * (kind == "ineq"), A) for kind, y, A in rules]
    unit = max(
        np.abs(y).max() if kind == "eq" else -y.min() for kind, y, _ in rules
    )  # so that a tolerance is one of it
    linear = [
        {"type": kind, "fun": lambda x, y=y / unit, A=A: y + A @ x, "jac": lambda x, A=A: A} for kind, y, A in rules
    ]
    still = np.zeros(rules[0][2].shape[1])
    found = minimize(lambda x: (x @ x / 2, x), still, jac=True, method="SLSQP", constraints=linear)
    return unit * found.x if found.success else still


class _Way:
    """Where a search has been: the best place that keeps the rules, or the last where none did."""

    def __init__(self, down: Callable, rules: list[dict], same: Callable):
        self.down, self.rules, self.same, self.best, self.least, self.steps = down, rules, same, None, np.inf, -1

    def __call__(self, x: np.ndarray) -> None:
        self.steps += 1
        if not self.same(x):
            raise RuntimeError("a loop of another number of strokes")
        value = self.down(x)[0] if np.isfinite(x).all() and all(kept(rule, x) for rule in self.rules) else np.inf
        if value < self.least or (self.least == np.inf and np.isfinite(x).all()):
            self.best, self.least = np.array(x), value

    def followed(self, x: np.ndarray, stride: float, moving: int, most: int, tolerance: float) -> str:
        """From x, of which the first ``moving`` numbers go no further than ``stride``, in ``most`` steps. How it ends: "there";
        "short" of it; "stuck" at a loop that cannot be run, or is another stroke; or "spent"."""
        from scipy.optimize import minimize

        room = np.where(np.arange(len(x)) < moving, stride, np.inf)
        try:
            self(x)
            with warnings.catch_warnings():  # SciPy before 1.13 says so where it clips its own steps to the bounds
                warnings.filterwarnings("ignore", "Values in x were outside bounds", RuntimeWarning)
                found = minimize(
                    self.down, x, jac=True, method="SLSQP", constraints=self.rules,
                    bounds=np.stack([x - room, x + room], -1), options={"maxiter": most, "ftol": tolerance}, callback=self,
                )  # fmt: skip
        except Enough:
            return "spent"
        except RuntimeError:
            return "stuck"
        return "there" if found.success else "short"
