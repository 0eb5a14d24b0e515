"""The way up: sequential quadratic programming from one loop to the best one near, inside its limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.optimise.aims import Aim
from geomech.optimise.problem import Enough, Problem, kept
from geomech.optimise.stroke import Stroke

STRIDE = 0.5  # rad, if joints have 2.5: how far the numbers go in so many steps, from one loop to one near
TOGETHER = 50
TRIES = 2.5  # cycles that a step takes, at most in the mean
SHORTER, SHORTEST = 0.25, 0.01  # of the stride: after a loop that cannot be run, or no way up; and at the end


def climb(
    cycles: Callable, aim: Aim, p: np.ndarray, *, turn: float = 0.0, most: int = 100, tolerance: float = 1e-6,
    stroke: bool = False, singularity: Callable | None = None, away: float = 0.0, told: Callable = lambda: None,
) -> np.ndarray:  # fmt: skip
    """The loop that ``aim`` leads to from ``p``; cycles: `Phases` or `Runs`. turn (rad): of a cycle, at most, where the aim is
    to get along. stroke: the loop is a `Stroke`, and stays one. singularity: of shapes, nowhere nearer to 0 than ``away``."""
    problem, once = Problem(cycles, aim, p, told, TRIES * most), Stroke(cycles.loops, p) if stroke else None
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
            found = minimize(
                self.down, x, jac=True, method="SLSQP", constraints=self.rules,
                bounds=np.stack([x - room, x + room], -1), options={"maxiter": most, "ftol": tolerance}, callback=self,
            )  # fmt: skip
        except Enough:
            return "spent"
        except RuntimeError:
            return "stuck"
        return "there" if found.success else "short"
