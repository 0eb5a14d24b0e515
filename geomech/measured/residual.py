"""The misfit of a fit beyond noise, and the error of A that it implies.

Where links begin or cease to stick, A has corners and jumps. Splines through rows, Fourier series and a regression over
all deviations from the gait cannot follow these, and the scatter between cycles does not show them: the misfit of xi
does. Its mean at a phase, over the rate of the gait, is the error of A along the gait; its scatter beyond noise, over
the rate across the gait, has the size of the error of A across it: 1.7 times that for a corner in the midst of the
cycles, 0.8 for one a standard deviation away. Both are products of halves of the rows, each with splines of its own,
whose noise is independent.

Below the noise the misfit shows nothing. There the series itself does: for a jump, harmonics from K / 2 to K have as
much power as all those beyond K, at which the series ends; for a spike less. Their power beyond their own noise is an
error, too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geomech.geometry.tube import TaylorSeries, series
from geomech.measured.regression import RATES, Samples
from geomech.measured.spread import PLACES, WIDTH

NOISE = 0.3  # of its variance: residual of cross-validated splines and harmonics where A is smooth
COARSE = 0.5  # of the mean residual of halves: splines through all rows have twice the knots and less of it
UPPER = 0.5  # of the harmonics: higher ones stand for the truncated ones
TAIL = 2.0  # truncation over these: between a jump, 1, and spikes; covers 95 % of the entries of A with both
SLOWEST = 0.03  # of its rms: the rate across the gait, at least


class Residual(NamedTuple):
    """Misfit of a fit.

    residual: (3,), rms misfit of xi, over that of the joint rates. explained: (3,), share of the squares of xi that the
    fit explains. standard_error: (3, 2, PLACES), errors of A as in `geomech.geometry.tube.TaylorSeries`."""

    residual: np.ndarray
    explained: np.ndarray
    standard_error: np.ndarray


def residual_of(known: TaylorSeries, samples: Samples, varies: int) -> Residual:
    """Return the misfit of ``known`` on the samples, with the error of the truncated series."""
    predicted = lambda alpha, rate: np.einsum(
        "ijmk,nk,njm->ni", known.combined, *known.terms(samples.phase, alpha, rate)
    )
    misfit = samples.xi - predicted(samples.alpha, samples.rate)
    residual = np.sqrt((misfit**2).mean(0) / (samples.rate**2).sum(-1).mean())
    explained = 1 - (misfit**2).mean(0) / samples.xi.var(0).clip(1e-300)
    halves = [
        xi - predicted(*half) for half, xi in zip(samples.halves, samples.xi_halves)
    ]
    places, speed = (
        _Places(samples.phase),
        (known.loop.shape(samples.phase, 1) ** 2).sum(-1, keepdims=True),
    )
    common, noise = (
        places.product(*halves),
        places.product(*[halves[0] - halves[1]] * 2) / 4,
    )
    mean = np.multiply(*map(places.mean, halves)) - (common + noise) / places.count
    along = COARSE**2 * _near(mean) / _near(places.mean(speed))
    across = np.zeros_like(along)
    if varies == RATES:
        swings = (
            np.einsum("nik,ni->nk", known.loop.normals(samples.phase), u)
            for _, u in samples.halves
        )
        swing = _near(places.mean(np.multiply(*swings).mean(-1, keepdims=True)))
        across = _near(common - NOISE * noise) / np.maximum(
            swing, SLOWEST**2 * swing.mean()
        )
    square = np.maximum(np.stack([along, across]), 0.0) + TAIL**2 * _truncation(known)
    return Residual(residual, explained, np.sqrt(square).transpose(2, 0, 1))


def _truncation(known: TaylorSeries) -> np.ndarray:
    """Return (2, PLACES, 3): squares of the upper harmonics of A along the gait and across it, less those of their
    noise."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    upper = np.arange(known.A.shape[-1]) > 2 * int(UPPER * (known.A.shape[-1] // 2))
    rate, normals = known.loop.shape(t, 1), known.loop.normals(t)
    tangent = rate / np.linalg.norm(rate, axis=1, keepdims=True)

    def squares(coefficients: np.ndarray) -> np.ndarray:
        A = series(coefficients * upper, t)
        across = np.einsum("t...ij,tjk->t...ik", A, normals)
        return np.stack(
            [np.einsum("t...ij,tj->t...i", A, tangent) ** 2, (across**2).mean(-1)]
        )

    noise = squares(known.errors[:, :, :, 0]).sum(2)
    return np.stack(
        [np.maximum(_near(a - b), 0.0) for a, b in zip(squares(known.A), noise)]
    )


class _Places:
    """Rows grouped by the nearest of PLACES phases."""

    def __init__(self, phase: np.ndarray):
        self.bins = np.rint(phase / (2 * np.pi) * PLACES).astype(int) % PLACES
        self.count = np.maximum(np.bincount(self.bins, minlength=PLACES), 2)[:, None]

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return means (PLACES, C) of values (N, C)."""
        return (
            np.stack([np.bincount(self.bins, x, PLACES) for x in values.T], -1)
            / self.count
        )

    def product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return covariances (PLACES, C) of a and b (N, C)."""
        return (
            (self.mean(a * b) - self.mean(a) * self.mean(b))
            * self.count
            / (self.count - 1)
        )


def _near(values: np.ndarray) -> np.ndarray:
    """Return averages over WIDTH of values (PLACES, C)."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    weight = np.exp((np.cos(t[:, None] - t) - 1) / WIDTH**2)
    return weight @ values / weight.sum(1, keepdims=True)
