"""Displacement and cost of a cycle, with their slopes in the numbers of the loop.

Where the velocity follows from shape alone, its derivatives by shape and rate are computed at every phase by central
differences: one batch of 4 d + 1 velocities, whatever the number of harmonics. The chain rule through the
reconstruction (`geomech.geometry.reconstruct.slopes`) and the series is exact. Where a gait can only be run cycle by
cycle, the differences are those of whole cycles, run in one batch."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geomech.geometry.reconstruct import slopes, turning
from geomech.optimisation.loops import Loops

STEP = 1e-5  # of differences: rad, and relative to the rate
STEP_OF_RUNS = 1e-3  # rad: cycles repeat to 1e-6 only


class CycleValues(NamedTuple):
    """Numbers of a cycle, each with its slopes (..., *shape of p).

    net: pose (3,). swing: heading at the start minus its mean, rad. length: of the path. power: mean over phases, at
    one rad of phase per unit of time. uneven: a penalty, least where |alphadot| is constant, which grows with the
    length of the loop, as loops may have spurs that yield nothing."""

    net: tuple
    swing: tuple
    length: tuple | None
    power: tuple | None
    uneven: tuple


class Phases:
    """Cycles of loops by velocities at phases.

    velocity(alpha, alphadot) -> (..., 3). power(alpha, alphadot, xi) -> (...), of degree ``degree`` in alphadot; None
    where no cost is needed."""

    exact = 1e-10  # rad: tolerance of a net turn of 0

    def __init__(
        self,
        loops: Loops,
        velocity: Callable,
        power: Callable | None = None,
        degree: float = 1.0,
    ):
        self.loops, self.velocity, self.power, self.degree = (
            loops,
            velocity,
            power,
            degree,
        )
        self.count, self.last, self.warm = 0, None, takes_start(velocity)

    def __call__(self, p: np.ndarray) -> CycleValues:
        loops, d = self.loops, self.loops.joints
        alpha, alphadot = loops.cycle(p)
        speed = np.sqrt((alphadot**2).sum(-1).mean()) or 1.0
        axes, steps = np.eye(2 * d), np.repeat([STEP, STEP * speed], d)
        moves = np.concatenate([np.zeros((1, 2 * d)), steps * axes, -steps * axes])[
            :, None
        ]
        samples = alpha + moves[..., :d], alphadot + moves[..., d:]
        spans = 2 * steps[:, None]
        self.count += 1
        xi = self._velocities(*samples)
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
            P = np.maximum(self.power(*samples, xi), 0.0)
            dP = ((P[1 : 2 * d + 1] - P[2 * d + 1 :]) / spans).T  # (N, 2 d)
            mean, q, n = P[0].mean(), self.degree, len(alpha)
            power = mean, self._in_p(dP / n)
            root = np.maximum(P[0], 1e-12 * mean + 1e-300) ** (1 / q)
            by_P = root / np.maximum(P[0], 1e-12 * mean + 1e-300) / q
            length = (
                2 * np.pi * root.mean(),
                self._in_p(2 * np.pi / n * by_P[:, None] * dP),
            )
        swing = float(swing_by @ xi[0][:, 2])
        return CycleValues(
            (net, chain(by_xi)),
            (swing, chain(zero)),
            length,
            power,
            uneven(loops, alphadot),
        )

    def _velocities(self, alpha, alphadot) -> np.ndarray:
        """Return xi (1 + 4 d, N, 3) of a loop and of its perturbations. Balances start from the last loop, then from
        this one."""
        if not self.warm:
            return self.velocity(alpha, alphadot)
        unmoved = self.velocity(alpha[:1], alphadot[:1], start=self.last)
        self.last = unmoved
        return np.concatenate(
            [unmoved, self.velocity(alpha[1:], alphadot[1:], start=unmoved)]
        )

    def _in_p(self, by: np.ndarray) -> np.ndarray:
        """Return slopes (..., 2 K + 1, d) in p from slopes by shape and rate at every phase, (..., N, 2 d)."""
        d = self.loops.joints
        return self.loops.basis.T @ by[..., :d] + self.loops.rates.T @ by[..., d:]


class Runs:
    """Cycles of gaits run as a whole, by `System.run`; loops: whatever has ``cycle(p)`` for rows of p. length: of the body."""

    exact = 1e-6  # rad: cycles repeat to this

    def __init__(
        self, loops, run: Callable, work: bool = False, degree: float = 1.0, length: float = 1.0,
        step: float = STEP_OF_RUNS,
    ):  # fmt: skip
        self.loops, self.run, self.work, self.degree, self.length, self.step = (
            loops,
            run,
            work,
            degree,
            length,
            step,
        )
        self.count = 0

    def __call__(self, p: np.ndarray) -> CycleValues:
        moves = self.step * self.loops.unit * np.eye(p.size).reshape(-1, *p.shape)
        samples = np.concatenate([p[None], p + moves, p - moves])
        self.count += 1
        run = self.run(*self.loops.cycle(samples), self.work)
        power = None if run.work is None else run.work.power / self.length
        values = cycle_values(run, power, self.degree)
        return CycleValues(
            *(None if x is None else self._with_slopes(x, p.shape) for x in values)
        )

    def _with_slopes(self, x: np.ndarray, shape: tuple) -> tuple:
        """Return value and slopes, from values (2 n + 1, ...) of the gait, of n perturbed ones, and of their opposites."""
        n = len(x) // 2
        rise = (x[1 : n + 1] - x[n + 1 :]) / (2 * self.step * self.loops.unit)
        return x[0], np.moveaxis(rise, 0, -1).reshape(*x.shape[1:], *shape)


def takes_start(velocity: Callable) -> bool:
    """Return whether a velocity accepts a start for its iterations."""
    try:
        return "start" in inspect.signature(velocity).parameters
    except (TypeError, ValueError):  # raised for compiled code
        return False


def cycle_values(run, power, degree: float) -> tuple:
    """Return the numbers of `CycleValues` without slopes: pose, swing, length, power, 0.

    run: a `Cycle` of gaits (...,). power: (..., N), or None."""
    length = mean = None
    if power is not None:
        P = np.maximum(power, 0.0)
        length, mean = 2 * np.pi * (P ** (1 / degree)).mean(-1), P.mean(-1)
    return (
        run.net,
        turning(run.xi)[..., 0],
        length,
        mean,
        np.zeros(np.shape(run.net)[:-1]),
    )


def _first_of_turning(n: int) -> np.ndarray:
    """Return the slopes (N,) of the heading at phase 0 minus its mean, by the rate of heading at every phase."""
    unit = np.zeros((n, n, 3))
    unit[..., 2] = np.eye(n)
    return turning(unit)[:, 0]


def uneven(loops: Loops, alphadot: np.ndarray) -> tuple:
    """Return mean |alphadot|^2 / (mean |alphadot|)^2 - 1 plus mean |alphadot|^2 in units of the loops squared, and its
    slopes."""
    n, speed = len(alphadot), np.sqrt((alphadot**2).sum(-1)) + 1e-300
    mean, square = speed.mean(), (speed**2).mean()
    by = (
        2 * alphadot / mean**2
        - 2 * square / mean**3 * alphadot / speed[:, None]
        + 2 * alphadot / loops.unit**2
    ) / n
    return square / mean**2 - 1 + square / loops.unit**2, loops.rates.T @ by
