"""The way up: sequential quadratic programming from one loop to the best one near, inside its limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.optimise.aims import Aim
from geomech.optimise.stroke import Stroke

EVEN = 1e-3  # of the value: what uneven pacing and a long way cost; it decides among loops that bring the same
STRAIGHT = 1e-3  # rad: below it a gait does not turn
STRIDE = 0.5  # rad, if joints have 2.5: how far the numbers go in so many steps, from one loop to one near
TOGETHER = 50
TRIES = 2.5  # cycles that a step takes, at most in the mean
KEPT = 5e-3  # rad, and of a limit: how far beyond a rule a loop may be that counts as keeping it
SHORTER, SHORTEST = 0.25, 0.01  # of the stride: after a loop that cannot be run, or no way up; and at the end


def climb(
    cycles: Callable, aim: Aim, p: np.ndarray, *, turn: float = 0.0, most: int = 100, tolerance: float = 1e-6,
    stroke: bool = False, singularity: Callable | None = None, away: float = 0.0, told: Callable = lambda: None,
) -> np.ndarray:  # fmt: skip
    """The loop that ``aim`` leads to from ``p``; cycles: `Phases` or `Runs`. turn (rad): of a cycle, at most, where the aim is
    to get along. stroke: the loop is a `Stroke`, and stays one. singularity: of shapes, nowhere nearer to 0 than ``away``."""
    from scipy.optimize import minimize

    seen = _Seen(cycles, p.shape, told, TRIES * most)
    loops, unit, shape = cycles.loops, cycles.loops.unit, p.shape
    paced = aim.timed and aim.rate is not None
    time = _time(cycles, aim, p, seen(p.ravel() / unit)) if aim.timed else 1.0
    first = aim.value(seen(p.ravel() / unit), 1.0)[0]
    weight = 0.0 if paced else EVEN * max(first, 0.01)
    split = lambda x: (x[:-1], x[-1]) if paced else (x, 1.0)

    def down(x):
        x, slower = split(x)
        b = seen(x)
        value, slopes = aim.value(b, 1 / (2 * np.pi))
        if aim.timed and not paced:
            slower, d_slower = _by_power(cycles, aim, b, time)
            slopes = slopes / slower - value / slower**2 * d_slower
            f, df = value / slower, slopes
        else:
            f, df = value / slower, slopes / slower
        df = unit * np.ravel(weight * b.uneven[1] - df)
        return weight * b.uneven[0] - f, np.append(df, f / slower) if paced else df

    A, limit = loops.limits()
    rules = [_linear(A * unit, limit, paced)]
    if paced:
        rules.append(_rates(loops, aim.rate * time, unit))
        if aim.power is not None:
            rules.append(_power(cycles, aim, seen, time, unit))
    theta = seen(p.ravel() / unit).net[1][2]
    if aim.straight and np.abs(theta).max() > STRAIGHT**2:  # else, as in sines, none of them turns
        rules += _straight(seen, turn, unit, paced)
    if stroke:
        once = Stroke(loops, p)
        rules.append(_once(once, unit, paced, shape))
    if singularity is not None:
        rules.append(_away(loops, singularity, away, p, unit, paced))
    x, left, stride = np.append(p.ravel() / unit, 1.0) if paced else p.ravel() / unit, most, STRIDE
    while left > 0 and stride > SHORTEST * STRIDE:
        room = np.where(np.arange(len(x)) < p.size, stride, np.inf)
        begun, way, found = (
            x,
            _Way(down, rules, lambda x: not stroke or once.winding(_loop(x, unit, paced, shape)) == 1),
            None,
        )
        try:
            way(x)
            found = minimize(
                down, x, jac=True, method="SLSQP", constraints=rules, bounds=np.stack([x - room, x + room], -1),
                options={"maxiter": min(left, TOGETHER), "ftol": tolerance}, callback=way,
            )  # fmt: skip
        except _Enough:
            left = 0
        except RuntimeError:  # of a loop on the way that cannot be run, or is another stroke
            stride *= SHORTER
        x = x if way.best is None else way.best
        left -= max(way.steps, 1)
        gone = np.abs(x - begun)[: p.size].max()
        if found is not None and found.success and gone < stride * (1 - 1e-6):
            break
        stride *= SHORTER if gone == 0 else 1.0
    return np.reshape(split(x)[0] * unit, shape)


def _loop(x: np.ndarray, unit: float, paced: bool, shape) -> np.ndarray:
    """p from what the search moves."""
    return np.reshape((x[:-1] if paced else x) * unit, shape)


class _Way:
    """Where a search has been: the best place that keeps the rules, or the last where none did."""

    def __init__(self, down: Callable, rules: list[dict], same: Callable):
        self.down, self.rules, self.same, self.best, self.least, self.steps = down, rules, same, None, np.inf, -1

    def __call__(self, x: np.ndarray) -> None:
        self.steps += 1
        if not self.same(x):
            raise RuntimeError("a loop of another number of strokes")
        value = self.down(x)[0] if np.isfinite(x).all() and all(_kept(rule, x) for rule in self.rules) else np.inf
        if value < self.least or (self.least == np.inf and np.isfinite(x).all()):
            self.best, self.least = np.array(x), value


def _kept(rule: dict, x: np.ndarray) -> bool:
    slack = rule["fun"](x)
    return bool((np.abs(slack) if rule["type"] == "eq" else -slack).max() <= KEPT)


class _Enough(Exception):
    """Leaves a search that takes too many cycles."""


class _Seen:
    """The last cycle, which the value and all rules ask for; `_Enough` after ``most``."""

    def __init__(self, cycles, shape, told, most: float):
        self.cycles, self.shape, self.told, self.x, self.found = cycles, shape, told, None, None
        self.last = cycles.count + most

    def __call__(self, x: np.ndarray):
        if self.x is None or not np.array_equal(self.x, x):
            if self.cycles.count >= self.last:
                raise _Enough
            self.found = self.cycles(np.reshape(x * self.cycles.loops.unit, self.shape))
            self.x = np.array(x)
            self.told()
        return self.found


def _time(cycles, aim: Aim, p, b) -> float:
    power = b.power[0] if b.power else None
    return aim.time(np.abs(cycles.loops.cycle(p)[1]).max(), power, cycles.degree)[0]


def _by_power(cycles, aim: Aim, b, time: float) -> tuple:
    """Time of a rad of phase by the limit of power, over ``time``, and its slopes."""
    P, dP = b.power
    slower = (P / aim.power) ** (1 / cycles.degree) / time
    return slower, slower / P / cycles.degree * dP


def _linear(A, limit, paced: bool) -> dict:
    A = np.column_stack([A, np.zeros(len(A))]) if paced else A
    return {"type": "ineq", "fun": lambda x: limit - A @ x, "jac": lambda x: -A}


def _rates(loops, fastest: float, unit: float) -> dict:
    """No shape variable faster than the limit: the last of x times ``fastest``."""
    A = np.concatenate([np.kron(loops.rates, one) for one in np.eye(loops.joints)[:, None]]) * unit
    A = np.column_stack([np.concatenate([A, -A]), np.full(2 * len(A), -fastest)])
    return {"type": "ineq", "fun": lambda x: -A @ x, "jac": lambda x: -A}


def _power(cycles, aim: Aim, seen, time: float, unit: float) -> dict:
    def slack(x):
        return np.array([x[-1] - _by_power(cycles, aim, seen(x[:-1]), time)[0]])

    def slopes(x):
        return np.append(-unit * np.ravel(_by_power(cycles, aim, seen(x[:-1]), time)[1]), 1.0)[None]

    return {"type": "ineq", "fun": slack, "jac": slopes}


def _straight(seen, turn: float, unit: float, paced: bool) -> list[dict]:
    """Net turn of at most ``turn`` either way, or of none."""
    own = lambda x: x[:-1] if paced else x
    theta = lambda x: seen(own(x)).net[0][2]
    slopes = lambda x: np.append(unit * np.ravel(seen(own(x)).net[1][2]), np.zeros(int(paced)))[None]
    if turn < STRAIGHT:
        return [{"type": "eq", "fun": lambda x: np.array([theta(x)]), "jac": slopes}]
    return [
        {"type": "ineq", "fun": lambda x, s=s: np.array([turn - s * theta(x)]), "jac": lambda x, s=s: -s * slopes(x)}
        for s in (1.0, -1.0)
    ]


def _once(stroke: Stroke, unit: float, paced: bool, shape) -> dict:
    """Never back."""

    def slopes(x):
        rows = unit * stroke.slopes(_loop(x, unit, paced, shape)).reshape(-1, int(np.prod(shape)))
        return np.column_stack([rows, np.zeros(len(rows))]) if paced else rows

    return {"type": "ineq", "fun": lambda x: stroke.swept(_loop(x, unit, paced, shape)), "jac": slopes}


def _away(loops, singularity, least: float, p, unit: float, paced: bool) -> dict:
    """On this side of the singular shapes, and no nearer."""
    side, joints, h = np.sign(singularity(loops.cycle(p)[0])[0]), p.shape[-1], 1e-6

    def slack(x):
        shapes = loops.cycle(_loop(x, unit, paced, p.shape))[0]
        return side * singularity(shapes) - least

    def slopes(x):
        shapes = loops.cycle(_loop(x, unit, paced, p.shape))[0]
        by = [singularity(shapes + h * e) - singularity(shapes - h * e) for e in np.eye(joints)]
        rows = side * unit * np.einsum("nk,nj->nkj", loops.basis, np.stack(by, -1) / (2 * h)).reshape(len(shapes), -1)
        return np.column_stack([rows, np.zeros(len(rows))]) if paced else rows

    return {"type": "ineq", "fun": slack, "jac": slopes}
