"""What a cycle of a loop brings and costs, with its slopes in the numbers of the loop.

Where the velocity follows from shape alone its derivatives by shape and rate are taken at every phase, by central differences
of one batch of velocities, 4 d + 1 of them whatever the number of harmonics; the chain through the reconstruction
(`geomech.geometry.reconstruct.slopes`) and the series is exact. Where a gait must be run as a whole the differences are those
of whole gaits, run side by side.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geomech.geometry.reconstruct import slopes, turning
from geomech.optimise.loops import Loops

STEP = 1e-5  # of differences: rad, and of the rate
STEP_OF_RUNS = 1e-3  # rad: cycles repeat to 1e-6 only


class Brought(NamedTuple):
    """Numbers of a cycle, each with its slopes (..., *shape of p). net: (3,), pose. swing: heading at the start beyond its
    mean, rad. length: of the path. power: mean over phases, at one rad of phase per unit of time. uneven: of the pacing, least
    where |alphadot| is constant, and more for a longer way: there are spurs that bring nothing."""

    net: tuple
    swing: tuple
    length: tuple | None
    power: tuple | None
    uneven: tuple


class Phases:
    """Cycles of loops by their velocity(alpha, alphadot) -> (..., 3) and power(alpha, alphadot) -> (...), which is of degree
    ``degree`` in alphadot; power None where its cost is not asked for."""

    exact = 1e-10  # rad: what a turn of none may be

    def __init__(self, loops: Loops, velocity: Callable, power: Callable | None = None, degree: float = 1.0):
        self.loops, self.velocity, self.power, self.degree = loops, velocity, power, degree
        self.count, self.last, self.warm = 0, None, _begins(velocity)

    def __call__(self, p: np.ndarray) -> Brought:
        loops, d = self.loops, self.loops.joints
        alpha, alphadot = loops.cycle(p)
        speed = np.sqrt((alphadot**2).sum(-1).mean()) or 1.0
        ways, steps = np.eye(2 * d), np.repeat([STEP, STEP * speed], d)
        moves = np.concatenate([np.zeros((1, 2 * d)), steps * ways, -steps * ways])[:, None]
        every = alpha + moves[..., :d], alphadot + moves[..., d:]
        spans = 2 * steps[:, None]
        self.count += 1
        xi = self._velocities(*every)
        if not np.isfinite(xi).all():
            raise RuntimeError("a loop that has no velocity somewhere")
        net, by_xi = slopes(xi[0])
        swing_by = _first_of_turning(len(alpha))
        dxi = (xi[1 : 2 * d + 1] - xi[2 * d + 1 :]) / spans[..., None]  # (2 d, N, 3)
        chain = lambda by: self._in_p(np.einsum("...nc,jnc->...nj", by, dxi))
        zero = np.zeros((len(alpha), 3))
        zero[:, 2] = swing_by
        length = power = None
        if self.power:
            P = np.maximum(self.power(*every, xi), 0.0)
            dP = ((P[1 : 2 * d + 1] - P[2 * d + 1 :]) / spans).T  # (N, 2 d)
            mean, q, n = P[0].mean(), self.degree, len(alpha)
            power = mean, self._in_p(dP / n)
            root = np.maximum(P[0], 1e-12 * mean + 1e-300) ** (1 / q)
            by_P = root / np.maximum(P[0], 1e-12 * mean + 1e-300) / q
            length = 2 * np.pi * root.mean(), self._in_p(2 * np.pi / n * by_P[:, None] * dP)
        swing = float(swing_by @ xi[0][:, 2])
        return Brought((net, chain(by_xi)), (swing, chain(zero)), length, power, uneven(loops, alphadot))

    def _velocities(self, alpha, alphadot) -> np.ndarray:
        """xi (1 + 4 d, N, 3) of a loop and of those beside it; balances begin from the last loop and from this."""
        if not self.warm:
            return self.velocity(alpha, alphadot)
        here = self.velocity(alpha[:1], alphadot[:1], start=self.last)
        self.last = here
        return np.concatenate([here, self.velocity(alpha[1:], alphadot[1:], start=here)])

    def _in_p(self, by: np.ndarray) -> np.ndarray:
        """Slopes (..., 2 K + 1, d) from those by shape and rate at every phase, (..., N, 2 d)."""
        d = self.loops.joints
        return self.loops.basis.T @ by[..., :d] + self.loops.rates.T @ by[..., d:]


class Runs:
    """Cycles of gaits run as a whole, by `System.run`; loops: whatever has ``cycle(p)`` for rows of p. length: of the body."""

    exact = 1e-6  # rad: that to which they repeat

    def __init__(
        self, loops, run: Callable, work: bool = False, degree: float = 1.0, length: float = 1.0,
        step: float = STEP_OF_RUNS,
    ):  # fmt: skip
        self.loops, self.run, self.work, self.degree, self.length, self.step = loops, run, work, degree, length, step
        self.count = 0

    def __call__(self, p: np.ndarray) -> Brought:
        moves = self.step * self.loops.unit * np.eye(p.size).reshape(-1, *p.shape)
        every = np.concatenate([p[None], p + moves, p - moves])
        self.count += 1
        done = self.run(*self.loops.cycle(every), self.work)
        power = None if done.work is None else done.work.power / self.length
        found = brought(done, power, self.degree)
        return Brought(*(None if x is None else self._with_slopes(x, p.shape) for x in found))

    def _with_slopes(self, x: np.ndarray, shape: tuple) -> tuple:
        """(value, slopes) from those of the gait, then of all moved one way and the other, (2 n + 1, ...)."""
        n = len(x) // 2
        rise = (x[1 : n + 1] - x[n + 1 :]) / (2 * self.step * self.loops.unit)
        return x[0], np.moveaxis(rise, 0, -1).reshape(*x.shape[1:], *shape)


def _begins(velocity: Callable) -> bool:
    """Whether a velocity may be told where to begin."""
    try:
        return "start" in inspect.signature(velocity).parameters
    except (TypeError, ValueError):  # of compiled code
        return False


def brought(run, power, degree: float) -> tuple:
    """The numbers of `Brought`, without slopes, of a `Cycle` of gaits (...,) that take ``power`` (..., N), or None: pose,
    swing, length, power, 0."""
    length = mean = None
    if power is not None:
        P = np.maximum(power, 0.0)
        length, mean = 2 * np.pi * (P ** (1 / degree)).mean(-1), P.mean(-1)
    return run.net, turning(run.xi)[..., 0], length, mean, np.zeros(np.shape(run.net)[:-1])


def _first_of_turning(n: int) -> np.ndarray:
    """(N,): heading at phase 0 beyond its mean by the turning velocity at every phase."""
    unit = np.zeros((n, n, 3))
    unit[..., 2] = np.eye(n)
    return turning(unit)[:, 0]


def uneven(loops: Loops, alphadot: np.ndarray) -> tuple:
    """mean |alphadot|^2 / (mean |alphadot|)^2 - 1, and mean |alphadot|^2 in the unit of the loops; and its slopes."""
    n, speed = len(alphadot), np.sqrt((alphadot**2).sum(-1)) + 1e-300
    mean, square = speed.mean(), (speed**2).mean()
    by = (2 * alphadot / mean**2 - 2 * square / mean**3 * alphadot / speed[:, None] + 2 * alphadot / loops.unit**2) / n
    return square / mean**2 - 1 + square / loops.unit**2, loops.rates.T @ by
