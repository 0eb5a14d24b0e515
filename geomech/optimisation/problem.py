"""An ascent as a problem of nonlinear programming: a number to be minimised, and constraints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.optimisation.objectives import Objective
from geomech.optimisation.stroke import Stroke

EVEN = 1e-3  # of the value: weight of uneven pacing and length; it decides between loops of equal value
STRAIGHT = 1e-3  # rad: below it a gait does not turn
FEASIBLE = 5e-3  # rad, and relative to a limit: violation of a constraint up to which a loop counts as feasible


class Enough(Exception):
    """A search takes more cycles than it may."""


class Problem:
    """The objective near the loop p as a function of numbers x: the parameters of a loop over its unit and, where a limit of
    rate sets the pace, the time of a rad of phase over that of p.

    cycles: `Phases` or `Runs`; `Enough` is raised after ``most``. on_cycle: called after every cycle. even: weight of
    the penalty of uneven pacing and long loops, as a share of the value."""

    def __init__(
        self,
        cycles,
        objective: Objective,
        p: np.ndarray,
        on_cycle: Callable,
        max_cycles: float,
        even: float = EVEN,
    ):
        self.cycles, self.objective, self.loops, self.on_cycle, self.last = (
            cycles,
            objective,
            cycles.loops,
            on_cycle,
            cycles.count + max_cycles,
        )
        self.unit, self.shape, self.count = cycles.loops.unit, p.shape, p.size
        self.paced = objective.timed and objective.rate is not None
        self.first = (
            np.append(p.ravel() / self.unit, 1.0)
            if self.paced
            else p.ravel() / self.unit
        )
        self._at, self._values = None, None
        b = self.values_at(self.first)
        power = b.power[0] if b.power else None
        self.time = (
            objective.time(np.abs(self.loops.cycle(p)[1]).max(), power, cycles.degree)[
                0
            ]
            if objective.timed
            else 1.0
        )
        self.weight = (
            0.0 if self.paced else even * max(objective.value(b, 1.0)[0], 0.01)
        )

    def loop(self, x: np.ndarray) -> np.ndarray:
        """Return p of numbers x."""
        return np.reshape(x[: self.count] * self.unit, self.shape)

    def slopes(self, by: np.ndarray) -> np.ndarray:
        """Return slopes (..., len(x)) in x of slopes (..., *shape) in p; those in the time are 0."""
        rows = self.unit * np.reshape(
            by, (*np.shape(by)[: np.ndim(by) - len(self.shape)], self.count)
        )
        return np.concatenate(
            [rows, np.zeros((*rows.shape[:-1], len(self.first) - self.count))], -1
        )

    def values_at(self, x: np.ndarray):
        """Return the cycle of x, computed once for the number to be minimised and all constraints."""
        x = x[: self.count]
        if self._at is None or not np.array_equal(self._at, x):
            if self.cycles.count >= self.last:
                raise Enough
            self._values, self._at = self.cycles(self.loop(x)), np.array(x)
            self.on_cycle()
        return self._values

    def minimised(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the number to be minimised, and its slopes."""
        b = self.values_at(x)
        value, by = self.objective.value(b, 1 / (2 * np.pi))
        slower = 1.0
        if self.paced:
            slower = x[-1]
        elif self.objective.timed:
            slower, by_slower = self.by_power(b)
            by = by - value / slower * by_slower
        slopes = self.slopes(self.weight * b.uneven[1] - by / slower)
        if self.paced:
            slopes[-1] = value / slower**2
        return self.weight * b.uneven[0] - value / slower, slopes

    def by_power(self, b) -> tuple[float, np.ndarray]:
        """Return the time of a rad of phase by the limit of power, over that of p, and its slopes."""
        P, dP = b.power
        slower = (P / self.objective.power) ** (1 / self.cycles.degree) / self.time
        return slower, slower / P / self.cycles.degree * dP

    def constraints(
        self,
        turn: float,
        stroke: Stroke | None,
        singularity: Callable | None,
        away: float,
        dense: bool = False,
    ) -> list[dict]:
        """Return the constraints, as `scipy.optimize.minimize` takes them.

        turn (rad): largest net turn of a cycle. stroke: the stroke that the loop stays. singularity: a function of
        shapes, at least ``away`` from 0. dense: limits hold between phases, too."""
        out = [_limits(self, dense)]
        if self.paced:
            out.append(_rates(self))
            out += [_power(self)] if self.objective.power is not None else []
        theta = self.values_at(self.first).net[1][2]
        if (
            self.objective.straight and np.abs(theta).max() > STRAIGHT**2
        ):  # else no loop near turns, as with sines
            out += _straight(self, turn)
        out += [] if stroke is None else [_one_stroke(self, stroke)]
        return out + ([] if singularity is None else [_away(self, singularity, away)])


def is_feasible(rule: dict, x: np.ndarray) -> bool:
    """Return whether numbers x satisfy a constraint, nearly."""
    slack = rule["fun"](x)
    return bool((np.abs(slack) if rule["type"] == "eq" else -slack).max() <= FEASIBLE)


def _linear(A: np.ndarray, limit) -> dict:
    return {"type": "ineq", "fun": lambda x: limit - A @ x, "jac": lambda x: -A}


def _limits(problem: Problem, dense: bool) -> dict:
    """Return the constraint that no shape exceeds its limits."""
    A, limit = problem.loops.limits(dense)
    return _linear(problem.slopes(A.reshape(-1, *problem.shape)), limit)


def _rates(problem: Problem) -> dict:
    """Return the constraint that no shape variable is faster than the limit, in the time that the last of x sets."""
    A = np.concatenate(
        [
            np.kron(problem.loops.rates, unit)
            for unit in np.eye(problem.loops.joints)[:, None]
        ]
    )
    A = problem.slopes(np.concatenate([A, -A]).reshape(-1, *problem.shape))
    A[:, -1] = -problem.objective.rate * problem.time
    return _linear(A, 0.0)


def _power(problem: Problem) -> dict:
    def slopes(x):
        out = -problem.slopes(problem.by_power(problem.values_at(x))[1])[None]
        out[:, -1] = 1.0
        return out

    return {
        "type": "ineq",
        "fun": lambda x: np.array([x[-1] - problem.by_power(problem.values_at(x))[0]]),
        "jac": slopes,
    }


def _straight(problem: Problem, turn: float) -> list[dict]:
    """Return the constraints of a net turn of at most ``turn`` in either sense, or of none."""
    theta = lambda x: np.array([problem.values_at(x).net[0][2]])
    slopes = lambda x: problem.slopes(problem.values_at(x).net[1][2])[None]
    if turn < STRAIGHT:
        return [{"type": "eq", "fun": theta, "jac": slopes}]
    return [
        {
            "type": "ineq",
            "fun": lambda x, s=s: turn - s * theta(x),
            "jac": lambda x, s=s: -s * slopes(x),
        }
        for s in (1.0, -1.0)
    ]


def _one_stroke(problem: Problem, stroke: Stroke) -> dict:
    """Return the constraint that the loop never goes back."""
    swept, slopes = (
        lambda x: stroke.swept(problem.loop(x)),
        lambda x: problem.slopes(stroke.slopes(problem.loop(x))),
    )
    return {"type": "ineq", "fun": swept, "jac": slopes}


def _away(problem: Problem, singularity: Callable, distance: float) -> dict:
    """Return the constraint that shapes stay on one side of the singular ones, at a distance."""
    shapes, h = lambda x: problem.loops.cycle(problem.loop(x))[0], 1e-6
    side, steps = (
        np.sign(singularity(shapes(problem.first))[0]),
        h * np.eye(problem.loops.joints),
    )

    def slopes(x):
        alpha = shapes(x)
        by = [
            (singularity(alpha + e) - singularity(alpha - e)) / (2 * h) for e in steps
        ]
        return problem.slopes(
            side * np.einsum("nk,nj->nkj", problem.loops.basis, np.stack(by, -1))
        )

    return {
        "type": "ineq",
        "fun": lambda x: side * singularity(shapes(x)) - distance,
        "jac": slopes,
    }
