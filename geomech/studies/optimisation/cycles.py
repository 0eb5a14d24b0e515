"""Displacement and cost of a cycle, with their slopes in the numbers of the loop.

Where the velocity follows from shape alone, its derivatives by shape and rate are
computed at every phase by central differences: one batch of 4 d + 1 velocities,
whatever the number of harmonics. The chain rule through the reconstruction
(`geomech.mathematics.geometry.reconstruct.slopes`) and the series is exact. Where a
gait can only be run cycle by cycle, the differences are between whole cycles, run in
one batch."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geomech.mathematics.geometry.reconstruct import slopes, turning
from geomech.studies.optimisation.loops import Loops

STEP = 1e-5  # of central differences: rad, and relative to the rate
STEP_OF_RUNS = 1e-3  # rad: cycles repeat to 1e-6 only


class CycleValues(NamedTuple):
    """Numbers of a cycle, each with its slopes (..., *shape of p).

    net: pose (3,). swing: heading at the start minus its mean, rad. length: of the
    path. power: mean over phases, at one rad of phase per unit of time. uneven: a
    penalty, least where |alphadot| is constant. It grows with the length of the loop,
    as loops may have spurs that yield nothing."""

    net: tuple
    swing: tuple
    length: tuple | None
    power: tuple | None
    uneven: tuple


class Phases:
    """Cycles of loops by velocities at phases.

    velocity(alpha, alphadot) -> (..., 3). power(alpha, alphadot, xi) -> (...), of
    degree ``degree`` in alphadot; None where no cost is needed."""

    exact = 1e-10  # rad: tolerance of a net turn of 0

    def __init__(
        self,
        loops: Loops,
        velocity: Callable,
        power: Callable | None = None,
        degree: float = 1.0,
    ):
        self.loops = loops
        self.velocity = velocity
        self.power = power
        self.degree = degree
        self.count = 0
        self.warm_starts = takes_start(velocity)
        self._last_xi = None

    def __call__(self, p: np.ndarray) -> CycleValues:
        loops = self.loops
        d = loops.joints
        alpha, alphadot = loops.cycle(p)
        samples, spans = self._perturbed(alpha, alphadot)
        self.count += 1
        xi = self._velocities(*samples)
        if not np.isfinite(xi).all():
            raise RuntimeError("a loop whose velocity is undefined somewhere")

        # Slopes by shape and rate at every phase, (2 d, N, 3), then by the chain rule.
        dxi = (xi[1 : 2 * d + 1] - xi[2 * d + 1 :]) / spans[..., None]
        net, net_by_xi = slopes(xi[0])
        swing_by_turning = _swing_slopes(len(alpha))
        swing_by_xi = np.zeros((len(alpha), 3))
        swing_by_xi[:, 2] = swing_by_turning
        swing = float(swing_by_turning @ xi[0][:, 2])

        length = None
        power = None
        if self.power:
            length, power = self._cost(samples, spans, xi)
        return CycleValues(
            (net, self._by_p(np.einsum("...nc,jnc->...nj", net_by_xi, dxi))),
            (swing, self._by_p(np.einsum("...nc,jnc->...nj", swing_by_xi, dxi))),
            length,
            power,
            uneven(loops, alphadot),
        )

    def _perturbed(self, alpha, alphadot) -> tuple[tuple, np.ndarray]:
        """Return shapes and rates (1 + 4 d, N, d) of the loop, of 2 d perturbations and
        of their opposites, and the spans (2 d, 1) between the last two."""
        d = self.loops.joints
        speed = np.sqrt((alphadot**2).sum(-1).mean()) or 1.0
        steps = np.repeat([STEP, STEP * speed], d)
        moves = steps * np.eye(2 * d)
        moves = np.concatenate([np.zeros((1, 2 * d)), moves, -moves])[:, None]
        samples = (alpha + moves[..., :d], alphadot + moves[..., d:])
        return samples, 2 * steps[:, None]

    def _cost(self, samples: tuple, spans, xi) -> tuple[tuple, tuple]:
        """Return the length of the path and the mean power, each with its slopes."""
        d = self.loops.joints
        n = len(xi[0])
        q = self.degree
        P = np.maximum(self.power(*samples, xi), 0.0)
        dP = ((P[1 : 2 * d + 1] - P[2 * d + 1 :]) / spans).T  # (N, 2 d)
        mean = P[0].mean()
        power = (mean, self._by_p(dP / n))

        # The length is the integral of P^(1/q); a power of 0 would have no slope.
        positive = np.maximum(P[0], 1e-12 * mean + 1e-300)
        root = positive ** (1 / q)
        root_by_P = root / positive / q
        slope = self._by_p(2 * np.pi / n * root_by_P[:, None] * dP)
        return (2 * np.pi * root.mean(), slope), power

    def _velocities(self, alpha, alphadot) -> np.ndarray:
        """Return xi (1 + 4 d, N, 3) of a loop and of its perturbations. Balances start
        from the last loop, then from this one."""
        if not self.warm_starts:
            return self.velocity(alpha, alphadot)
        unmoved = self.velocity(alpha[:1], alphadot[:1], start=self._last_xi)
        self._last_xi = unmoved
        moved = self.velocity(alpha[1:], alphadot[1:], start=unmoved)
        return np.concatenate([unmoved, moved])

    def _by_p(self, slopes: np.ndarray) -> np.ndarray:
        """Return slopes (..., 2 K + 1, d) in p from slopes by shape and rate at every
        phase, (..., N, 2 d)."""
        d = self.loops.joints
        by_shape = slopes[..., :d]
        by_rate = slopes[..., d:]
        return self.loops.basis.T @ by_shape + self.loops.rates.T @ by_rate


class Runs:
    """Cycles of gaits run as a whole, by `System.run`.

    loops: an object with ``cycle(p)`` for rows of p. work: whether the cost of moving
    is computed. length: of the body. step (rad): of the differences."""

    exact = 1e-6  # rad: cycles repeat to this

    def __init__(
        self,
        loops,
        run: Callable,
        work: bool = False,
        degree: float = 1.0,
        length: float = 1.0,
        step: float = STEP_OF_RUNS,
    ):
        self.loops = loops
        self.run = run
        self.work = work
        self.degree = degree
        self.length = length
        self.step = step
        self.count = 0

    def __call__(self, p: np.ndarray) -> CycleValues:
        moves = self.step * self.loops.unit * np.eye(p.size).reshape(-1, *p.shape)
        samples = np.concatenate([p[None], p + moves, p - moves])
        self.count += 1
        run = self.run(*self.loops.cycle(samples), self.work)
        power = None
        if run.work is not None:
            power = run.work.power / self.length
        values = cycle_values(run, power, self.degree)
        return CycleValues(*(self._with_slopes(x, p.shape) for x in values))

    def _with_slopes(self, x: np.ndarray | None, shape: tuple) -> tuple | None:
        """Return value and slopes, from values (2 n + 1, ...) of the gait, of n
        perturbed ones, and of their opposites; None for None."""
        if x is None:
            return None
        n = len(x) // 2
        slopes = (x[1 : n + 1] - x[n + 1 :]) / (2 * self.step * self.loops.unit)
        return x[0], np.moveaxis(slopes, 0, -1).reshape(*x.shape[1:], *shape)


def takes_start(velocity: Callable) -> bool:
    """Return whether a velocity accepts a start for its iterations."""
    try:
        return "start" in inspect.signature(velocity).parameters
    except (TypeError, ValueError):  # raised for compiled code
        return False


def cycle_values(run, power, degree: float) -> tuple:
    """Return the numbers of `CycleValues` without slopes: pose, swing, length, power,
    0.

    run: a `Cycle` of gaits (...,). power: (..., N), or None."""
    length = None
    mean_power = None
    if power is not None:
        P = np.maximum(power, 0.0)
        length = 2 * np.pi * (P ** (1 / degree)).mean(-1)
        mean_power = P.mean(-1)
    swing = turning(run.xi)[..., 0]
    return run.net, swing, length, mean_power, np.zeros(np.shape(run.net)[:-1])


def _swing_slopes(n: int) -> np.ndarray:
    """Return the slopes (N,) of the heading at phase 0 minus its mean, by the rate of
    heading at every phase."""
    unit = np.zeros((n, n, 3))
    unit[..., 2] = np.eye(n)
    return turning(unit)[:, 0]


def uneven(loops: Loops, alphadot: np.ndarray) -> tuple:
    """Return mean |alphadot|^2 / (mean |alphadot|)^2 - 1 plus mean |alphadot|^2 in
    units of the loops squared, and its slopes in p. alphadot: (N, d)."""
    n = len(alphadot)
    speed = np.sqrt((alphadot**2).sum(-1)) + 1e-300
    mean = speed.mean()
    square = (speed**2).mean()
    by_rate = (
        2 * alphadot / mean**2
        - 2 * square / mean**3 * alphadot / speed[:, None]
        + 2 * alphadot / loops.unit**2
    ) / n
    return square / mean**2 - 1 + square / loops.unit**2, loops.rates.T @ by_rate
