"""An ascent as a problem of nonlinear programming: a number to be minimised, and
constraints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.studies.optimisation.cycles import CycleValues
from geomech.studies.optimisation.local.objectives import Objective
from geomech.studies.optimisation.local.stroke import Stroke

# Of the value: weight of uneven pacing and length. It decides between loops of equal
# value.
EVEN = 1e-3
LEAST_VALUE = 0.01  # of which EVEN is a share at least; assumed
STRAIGHT = 1e-3  # rad: below it a gait does not turn
FEASIBLE = 5e-3  # rad, and relative to a limit: largest violation of a feasible loop
SINGULARITY_STEP = 1e-6  # rad: of central differences of the singularity


class Enough(Exception):
    """A search takes more cycles than it may."""


class Problem:
    """The objective near the loop p as a function of numbers x: the parameters of a
    loop over its unit and, where a limit of rate sets the pace, the time of a rad of
    phase over that of p.

    cycles: `Phases` or `Runs`; `Enough` is raised after ``max_cycles``. on_cycle:
    called after every cycle. even: weight of the penalty of uneven pacing and long
    loops, as a share of the value."""

    def __init__(
        self,
        cycles,
        objective: Objective,
        p: np.ndarray,
        on_cycle: Callable,
        max_cycles: float,
        even: float = EVEN,
    ):
        self.cycles = cycles
        self.objective = objective
        self.loops = cycles.loops
        self.on_cycle = on_cycle
        self.last = cycles.count + max_cycles
        self.unit = cycles.loops.unit
        self.shape = p.shape
        self.count = p.size
        self.paced = objective.timed and objective.rate is not None
        self._last_x = None
        self._last_values = None

        self.first = p.ravel() / self.unit
        if self.paced:
            self.first = np.append(self.first, 1.0)

        cycle = self.values_at(self.first)
        self.time = 1.0
        if objective.timed:
            fastest = np.abs(self.loops.cycle(p)[1]).max()
            power = None
            if cycle.power:
                power, _ = cycle.power
            self.time, _ = objective.time(fastest, power, cycles.degree)
        self.weight = 0.0
        if not self.paced:
            value, _ = objective.value(cycle, 1.0)
            self.weight = even * max(value, LEAST_VALUE)

    def loop(self, x: np.ndarray) -> np.ndarray:
        """Return p of numbers x."""
        return np.reshape(x[: self.count] * self.unit, self.shape)

    def slopes(self, by_p: np.ndarray) -> np.ndarray:
        """Return slopes (..., len(x)) in x of slopes (..., *shape) in p; 0 in the
        time."""
        leading = np.shape(by_p)[: np.ndim(by_p) - len(self.shape)]
        rows = self.unit * np.reshape(by_p, (*leading, self.count))
        zeros = np.zeros((*leading, len(self.first) - self.count))
        return np.concatenate([rows, zeros], -1)

    def values_at(self, x: np.ndarray) -> CycleValues:
        """Return the cycle of x, computed once for the number to be minimised and all
        constraints."""
        x = x[: self.count]
        if self._last_x is None or not np.array_equal(self._last_x, x):
            if self.cycles.count >= self.last:
                raise Enough
            self._last_values = self.cycles(self.loop(x))
            self._last_x = np.array(x)
            self.on_cycle()
        return self._last_values

    def minimised(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the number to be minimised, and its slopes."""
        cycle = self.values_at(x)
        value, by_p = self.objective.value(cycle, 1 / (2 * np.pi))

        # The value is for the pace of p; a slower pace divides it.
        slower = 1.0
        if self.paced:
            slower = x[-1]
        elif self.objective.timed:
            slower, slower_by_p = self.relative_time(cycle)
            by_p = by_p - value / slower * slower_by_p

        penalty, penalty_by_p = cycle.uneven
        slopes = self.slopes(self.weight * penalty_by_p - by_p / slower)
        if self.paced:
            slopes[-1] = value / slower**2
        return self.weight * penalty - value / slower, slopes

    def relative_time(self, cycle: CycleValues) -> tuple[float, np.ndarray]:
        """Return the time of a rad of phase by the limit of power, over that of p, and
        its slopes in p."""
        P, dP = cycle.power
        degree = self.cycles.degree
        slower = (P / self.objective.power) ** (1 / degree) / self.time
        return slower, slower / P / degree * dP

    def constraints(
        self,
        turn: float,
        stroke: Stroke | None,
        singularity: Callable | None,
        away: float,
        dense: bool = False,
    ) -> list[dict]:
        """Return the constraints, as `scipy.optimize.minimize` takes them.

        turn (rad): largest net turn of a cycle. stroke: the stroke that the loop stays.
        singularity: a function of shapes, at least ``away`` from 0. dense: limits hold
        between phases as well."""
        rules = [_limits(self, dense)]
        if self.paced:
            rules.append(_rates(self))
            if self.objective.power is not None:
                rules.append(_power(self))
        turn_by_p = self.values_at(self.first).net[1][2]
        # Where the slopes are 0 no loop near turns, as with sines.
        if self.objective.straight and np.abs(turn_by_p).max() > STRAIGHT**2:
            rules += _straight(self, turn)
        if stroke is not None:
            rules.append(_one_stroke(self, stroke))
        if singularity is not None:
            rules.append(_away(self, singularity, away))
        return rules


def is_feasible(rule: dict, x: np.ndarray) -> bool:
    """Return whether numbers x satisfy a constraint, nearly."""
    values = rule["fun"](x)
    violation = -values
    if rule["type"] == "eq":
        violation = np.abs(values)
    return bool(violation.max() <= FEASIBLE)


def _linear(A: np.ndarray, limit) -> dict:
    """Return the constraint A x <= limit."""
    return {"type": "ineq", "fun": lambda x: limit - A @ x, "jac": lambda x: -A}


def _limits(problem: Problem, dense: bool) -> dict:
    """Return the constraint that no shape exceeds its limits."""
    A, limit = problem.loops.limits(dense)
    return _linear(problem.slopes(A.reshape(-1, *problem.shape)), limit)


def _rates(problem: Problem) -> dict:
    """Return the constraint that no shape variable is faster than the limit, in the
    time that the last of x sets."""
    units = np.eye(problem.loops.joints)[:, None]
    A = np.concatenate([np.kron(problem.loops.rates, unit) for unit in units])
    A = problem.slopes(np.concatenate([A, -A]).reshape(-1, *problem.shape))
    A[:, -1] = -problem.objective.rate * problem.time
    return _linear(A, 0.0)


def _power(problem: Problem) -> dict:
    """Return the constraint that the time, the last of x, is what the power allows."""

    def slack(x):
        slower, _ = problem.relative_time(problem.values_at(x))
        return np.array([x[-1] - slower])

    def slopes(x):
        _, slower_by_p = problem.relative_time(problem.values_at(x))
        by_x = -problem.slopes(slower_by_p)[None]
        by_x[:, -1] = 1.0
        return by_x

    return {"type": "ineq", "fun": slack, "jac": slopes}


def _straight(problem: Problem, turn: float) -> list[dict]:
    """Return the constraints of a net turn of at most ``turn`` in either sense, or of
    no net turn for a small one."""

    def theta(x):
        return np.array([problem.values_at(x).net[0][2]])

    def slopes(x):
        return problem.slopes(problem.values_at(x).net[1][2])[None]

    if turn < STRAIGHT:
        return [{"type": "eq", "fun": theta, "jac": slopes}]
    return [
        {
            "type": "ineq",
            "fun": lambda x: turn - theta(x),
            "jac": lambda x: -slopes(x),
        },
        {
            "type": "ineq",
            "fun": lambda x: turn + theta(x),
            "jac": slopes,
        },
    ]


def _one_stroke(problem: Problem, stroke: Stroke) -> dict:
    """Return the constraint that the loop never goes back."""

    def swept(x):
        return stroke.swept(problem.loop(x))

    def slopes(x):
        return problem.slopes(stroke.slopes(problem.loop(x)))

    return {"type": "ineq", "fun": swept, "jac": slopes}


def _away(problem: Problem, singularity: Callable, distance: float) -> dict:
    """Return the constraint that shapes stay on one side of the singular ones, at a
    distance."""
    h = SINGULARITY_STEP
    steps = h * np.eye(problem.loops.joints)

    def shapes(x):
        return problem.loops.cycle(problem.loop(x))[0]

    side = np.sign(singularity(shapes(problem.first))[0])

    def excess(x):
        return side * singularity(shapes(x)) - distance

    def slopes(x):
        alpha = shapes(x)
        differences = [singularity(alpha + e) - singularity(alpha - e) for e in steps]
        by_shape = np.stack([difference / (2 * h) for difference in differences], -1)
        by_p = np.einsum("nk,nj->nkj", problem.loops.basis, by_shape)
        return problem.slopes(side * by_p)

    return {"type": "ineq", "fun": excess, "jac": slopes}
