"""A way up as a problem of nonlinear programming: what is made small, and the rules that a loop keeps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.optimise.aims import Aim
from geomech.optimise.stroke import Stroke

EVEN = 1e-3  # of the value: what uneven pacing and a long way cost; it decides among loops that bring the same
STRAIGHT = 1e-3  # rad: below it a gait does not turn
KEPT = 5e-3  # rad, and of a limit: how far beyond a rule a loop may be that counts as keeping it


class Enough(Exception):
    """Leaves a search that takes too many cycles."""


class Problem:
    """``aim`` near the loop p, in numbers x: those of a loop over its unit and, where a limit of rate paces it, the time of a
    rad of phase over that of p. cycles: `Phases` or `Runs`; `Enough` after ``most``. told: whenever one is done. even: what
    uneven pacing and a long way cost, of the value."""

    def __init__(self, cycles, aim: Aim, p: np.ndarray, told: Callable, most: float, even: float = EVEN):
        self.cycles, self.aim, self.loops, self.told, self.last = cycles, aim, cycles.loops, told, cycles.count + most
        self.unit, self.shape, self.count = cycles.loops.unit, p.shape, p.size
        self.paced = aim.timed and aim.rate is not None
        self.first = np.append(p.ravel() / self.unit, 1.0) if self.paced else p.ravel() / self.unit
        self._at, self._found = None, None
        b = self.brought(self.first)
        power = b.power[0] if b.power else None
        self.time = aim.time(np.abs(self.loops.cycle(p)[1]).max(), power, cycles.degree)[0] if aim.timed else 1.0
        self.weight = 0.0 if self.paced else even * max(aim.value(b, 1.0)[0], 0.01)

    def loop(self, x: np.ndarray) -> np.ndarray:
        """p of numbers x."""
        return np.reshape(x[: self.count] * self.unit, self.shape)

    def slopes(self, by: np.ndarray) -> np.ndarray:
        """(..., len(x)) of slopes (..., *shape) in p; the pace has none."""
        rows = self.unit * np.reshape(by, (*np.shape(by)[: np.ndim(by) - len(self.shape)], self.count))
        return np.concatenate([rows, np.zeros((*rows.shape[:-1], len(self.first) - self.count))], -1)

    def brought(self, x: np.ndarray):
        """The cycle of x, for which the value and all rules ask."""
        x = x[: self.count]
        if self._at is None or not np.array_equal(self._at, x):
            if self.cycles.count >= self.last:
                raise Enough
            self._found, self._at = self.cycles(self.loop(x)), np.array(x)
            self.told()
        return self._found

    def down(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """What is made small, and its slopes."""
        b = self.brought(x)
        value, by = self.aim.value(b, 1 / (2 * np.pi))
        slower = 1.0
        if self.paced:
            slower = x[-1]
        elif self.aim.timed:
            slower, by_slower = self.by_power(b)
            by = by - value / slower * by_slower
        slopes = self.slopes(self.weight * b.uneven[1] - by / slower)
        if self.paced:
            slopes[-1] = value / slower**2
        return self.weight * b.uneven[0] - value / slower, slopes

    def by_power(self, b) -> tuple[float, np.ndarray]:
        """Time of a rad of phase by the limit of power, over that of p, and its slopes."""
        P, dP = b.power
        slower = (P / self.aim.power) ** (1 / self.cycles.degree) / self.time
        return slower, slower / P / self.cycles.degree * dP

    def rules(
        self, turn: float, once: Stroke | None, singularity: Callable | None, away: float, dense: bool = False
    ) -> list[dict]:
        """turn (rad): of a cycle, at most. once: the stroke that a loop stays. singularity: of shapes, no nearer to 0 than
        ``away``. dense: limits at so many phases that they hold between them."""
        found = [_limits(self, dense)]
        if self.paced:
            found.append(_rates(self))
            found += [_power(self)] if self.aim.power is not None else []
        theta = self.brought(self.first).net[1][2]
        if self.aim.straight and np.abs(theta).max() > STRAIGHT**2:  # else, as in sines, none of them turns
            found += _straight(self, turn)
        found += [] if once is None else [_once(self, once)]
        return found + ([] if singularity is None else [_away(self, singularity, away)])


def kept(rule: dict, x: np.ndarray) -> bool:
    """Whether numbers x keep a rule, nearly."""
    slack = rule["fun"](x)
    return bool((np.abs(slack) if rule["type"] == "eq" else -slack).max() <= KEPT)


def _linear(A: np.ndarray, limit) -> dict:
    return {"type": "ineq", "fun": lambda x: limit - A @ x, "jac": lambda x: -A}


def _limits(of: Problem, dense: bool) -> dict:
    """No shape beyond them."""
    A, limit = of.loops.limits(dense)
    return _linear(of.slopes(A.reshape(-1, *of.shape)), limit)


def _rates(of: Problem) -> dict:
    """No shape variable faster than the limit: the last of x times that in the time of p."""
    A = np.concatenate([np.kron(of.loops.rates, one) for one in np.eye(of.loops.joints)[:, None]])
    A = of.slopes(np.concatenate([A, -A]).reshape(-1, *of.shape))
    A[:, -1] = -of.aim.rate * of.time
    return _linear(A, 0.0)


def _power(of: Problem) -> dict:
    def slopes(x):
        found = -of.slopes(of.by_power(of.brought(x))[1])[None]
        found[:, -1] = 1.0
        return found

    return {"type": "ineq", "fun": lambda x: np.array([x[-1] - of.by_power(of.brought(x))[0]]), "jac": slopes}


def _straight(of: Problem, turn: float) -> list[dict]:
    """Net turn of at most ``turn`` either way, or of none."""
    theta = lambda x: np.array([of.brought(x).net[0][2]])
    slopes = lambda x: of.slopes(of.brought(x).net[1][2])[None]
    if turn < STRAIGHT:
        return [{"type": "eq", "fun": theta, "jac": slopes}]
    return [
        {"type": "ineq", "fun": lambda x, s=s: turn - s * theta(x), "jac": lambda x, s=s: -s * slopes(x)}
        for s in (1.0, -1.0)
    ]


def _once(of: Problem, stroke: Stroke) -> dict:
    """Never back."""
    swept, slopes = lambda x: stroke.swept(of.loop(x)), lambda x: of.slopes(stroke.slopes(of.loop(x)))
    return {"type": "ineq", "fun": swept, "jac": slopes}


def _away(of: Problem, singularity: Callable, least: float) -> dict:
    """On this side of the singular shapes, and no nearer."""
    shapes, h = lambda x: of.loops.cycle(of.loop(x))[0], 1e-6
    side, ways = np.sign(singularity(shapes(of.first))[0]), h * np.eye(of.loops.joints)

    def slopes(x):
        there = shapes(x)
        by = [(singularity(there + e) - singularity(there - e)) / (2 * h) for e in ways]
        return of.slopes(side * np.einsum("nk,nj->nkj", of.loops.basis, np.stack(by, -1)))

    return {"type": "ineq", "fun": lambda x: side * singularity(shapes(x)) - least, "jac": slopes}
