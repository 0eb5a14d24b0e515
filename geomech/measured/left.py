"""What a fit leaves of the body velocity beyond noise, and what A may be off by for it.

Where links begin or cease to stick A has corners and jumps. Neither splines through rows, nor a Fourier series, nor a
regression over all that cycles do about the gait follows these, and no spread of the cycles tells so: what is left of xi does.
Its mean at a phase, over the rate of the gait, is what A along the gait is off by; its scatter beyond noise, over the rate
across the gait, is the size of what A across it is off by: 1.7 times that for a corner in the midst of the cycles, 0.8 for
one a standard deviation off. Both are of halves of the rows, each by splines of its own, whose noise is independent.

Below the noise nothing of that is seen. There the series itself tells: of a jump, harmonics from K / 2 to K make as much as all
those beyond K, at which the series ends, and of a spike less. What they make beyond their own noise is an error, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geomech.geometry.tube import TaylorSeries, series
from geomech.measured.reach import PLACES, WIDTH
from geomech.measured.regression import RATES, Samples

NOISE = 0.3  # of its variance: what splines and harmonics that cross-validation chooses leave, where A is smooth
COARSE = 0.5  # of the mean that halves leave: splines through all rows, twice as close, leave less
UPPER = 0.5  # of the harmonics are below those that stand for what is cut off
TAIL = 2.0  # times what these make: between a jump, 1, and spikes; covers 95 % of the entries of A where it has both
SLOWEST = 0.03  # of its rms: the rate across the gait, at least


class Left(NamedTuple):
    """residual: (3,), rms of what is left of xi, over that of the joint rates. explained: (3,), share of the squares of xi that
    is not left. off: (3, 2, PLACES) of `geomech.geometry.tube.TaylorSeries`."""

    residual: np.ndarray
    explained: np.ndarray
    off: np.ndarray


def left(known: TaylorSeries, samples: Samples, varies: int) -> Left:
    """What ``known`` leaves of the samples, and cuts off."""
    told = lambda alpha, rate: np.einsum("ijmk,nk,njm->ni", known.combined, *known.terms_at(samples.phase, alpha, rate))
    all_of_it = samples.xi - told(samples.alpha, samples.rate)
    residual = np.sqrt((all_of_it**2).mean(0) / (samples.rate**2).sum(-1).mean())
    explained = 1 - (all_of_it**2).mean(0) / samples.xi.var(0).clip(1e-300)
    halves = [xi - told(*half) for half, xi in zip(samples.halves, samples.xi_halves)]
    places, pace = _Places(samples.phase), (known.loop.shape(samples.phase, 1) ** 2).sum(-1, keepdims=True)
    common, noise = places.product(*halves), places.product(*[halves[0] - halves[1]] * 2) / 4
    mean = np.multiply(*map(places.mean, halves)) - (common + noise) / places.count
    along = COARSE**2 * _near(mean) / _near(places.mean(pace))
    across = np.zeros_like(along)
    if varies == RATES:
        swings = (np.einsum("nik,ni->nk", known.loop.normals(samples.phase), u) for _, u in samples.halves)
        swing = _near(places.mean(np.multiply(*swings).mean(-1, keepdims=True)))
        across = _near(common - NOISE * noise) / np.maximum(swing, SLOWEST**2 * swing.mean())
    square = np.maximum(np.stack([along, across]), 0.0) + TAIL**2 * _cut_off(known)
    return Left(residual, explained, np.sqrt(square).transpose(2, 0, 1))


def _cut_off(known: TaylorSeries) -> np.ndarray:
    """(2, PLACES, 3): squares of what the upper harmonics of A make along the gait and across it, less those of their noise."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    upper = np.arange(known.A.shape[-1]) > 2 * int(UPPER * (known.A.shape[-1] // 2))
    rate, normals = known.loop.shape(t, 1), known.loop.normals(t)
    tangent = rate / np.linalg.norm(rate, axis=1, keepdims=True)

    def squares(coefficients: np.ndarray) -> np.ndarray:
        A = series(coefficients * upper, t)
        across = np.einsum("t...ij,tjk->t...ik", A, normals)
        return np.stack([np.einsum("t...ij,tj->t...i", A, tangent) ** 2, (across**2).mean(-1)])

    noise = squares(known.errors[:, :, :, 0]).sum(2)
    return np.stack([np.maximum(_near(a - b), 0.0) for a, b in zip(squares(known.A), noise)])


class _Places:
    """Rows by the nearest of PLACES phases."""

    def __init__(self, phase: np.ndarray):
        self.bins = np.rint(phase / (2 * np.pi) * PLACES).astype(int) % PLACES
        self.count = np.maximum(np.bincount(self.bins, minlength=PLACES), 2)[:, None]

    def mean(self, values: np.ndarray) -> np.ndarray:
        """(PLACES, C) of values (N, C)."""
        return np.stack([np.bincount(self.bins, x, PLACES) for x in values.T], -1) / self.count

    def product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Covariances (PLACES, C) of a, b (N, C)."""
        return (self.mean(a * b) - self.mean(a) * self.mean(b)) * self.count / (self.count - 1)


def _near(values: np.ndarray) -> np.ndarray:
    """Averages of values (PLACES, C) over WIDTH."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    weight = np.exp((np.cos(t[:, None] - t) - 1) / WIDTH**2)
    return weight @ values / weight.sum(1, keepdims=True)
