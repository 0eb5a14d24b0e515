"""The misfit of a fit beyond noise, and the error of A that it implies.

Where links begin or cease to stick, A has corners and jumps. Splines through rows,
Fourier series and a regression over all deviations from the gait cannot follow these,
and the scatter between cycles does not show them: the misfit of xi does. Its mean at a
phase, over the rate of the gait, is the error of A along the gait. Its scatter beyond
noise, over the rate across the gait, has the size of the error of A across it: 1.7
times that error for a corner in the midst of the cycles, 0.8 times for a corner a
standard deviation away. Both are products of halves of the rows, each with its own
splines, whose noise is independent.

Below the noise the misfit shows nothing. There the series itself does: for a jump,
harmonics from K / 2 to K have as much power as all harmonics beyond K, at which the
series ends; for a spike less. Their power beyond their own noise is an error as
well."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geomech.mathematics.geometry.representations.tube import TaylorSeries, series
from geomech.studies.measured.regression import RATES, Samples
from geomech.studies.measured.spread import PLACES, WIDTH

# Of the noise's variance: residual of cross-validated splines and harmonics where A is
# smooth.
NOISE = 0.3
# Of the mean residual of halves: splines through all rows have twice the knots and a
# smaller residual.
COARSE = 0.5
UPPER = 0.5  # of the harmonics: higher ones stand for the truncated ones
# Truncation over the upper harmonics: between a jump, 1, and spikes; it covers 95 % of
# the entries of A with both.
TAIL = 2.0
SLOWEST = 0.03  # of its rms: least rate across the gait


class Residual(NamedTuple):
    """Misfit of a fit.

    residual: (3,), rms misfit of xi, over the rms of the joint rates. explained: (3,),
    share of the squares of xi that the fit explains. standard_error: (3, 2, PLACES),
    errors of A as in
    `geomech.mathematics.geometry.representations.tube.TaylorSeries`."""

    residual: np.ndarray
    explained: np.ndarray
    standard_error: np.ndarray


def fit_residual(taylor: TaylorSeries, samples: Samples, varies: int) -> Residual:
    """Return the misfit of ``taylor`` on the samples, with the error of the truncated
    series."""

    def predicted(alpha, rate):
        w, terms = taylor.terms(samples.phase, alpha, rate)
        return np.einsum("ijmk,nk,njm->ni", taylor.combined, w, terms)

    misfit = samples.xi - predicted(samples.alpha, samples.rate)
    residual = np.sqrt((misfit**2).mean(0) / (samples.rate**2).sum(-1).mean())
    explained = 1 - (misfit**2).mean(0) / samples.xi.var(0).clip(1e-300)
    (alpha_1, rate_1), (alpha_2, rate_2) = samples.halves
    xi_1, xi_2 = samples.xi_halves
    misfit_1 = xi_1 - predicted(alpha_1, rate_1)
    misfit_2 = xi_2 - predicted(alpha_2, rate_2)

    # Covariances at each phase: what the halves share, and their noise.
    places = _Places(samples.phase)
    common = places.product(misfit_1, misfit_2)
    difference = misfit_1 - misfit_2
    noise = places.product(difference, difference) / 4

    # Along the gait: the square of the mean misfit, over the square of the gait's rate.
    mean_square = places.mean(misfit_1) * places.mean(misfit_2)
    mean_square = mean_square - (common + noise) / places.count
    speed = (taylor.loop.shape(samples.phase, 1) ** 2).sum(-1, keepdims=True)
    along = COARSE**2 * _averaged(mean_square) / _averaged(places.mean(speed))

    # Across the gait: the scatter beyond noise, over the square of the rate across it.
    across = np.zeros_like(along)
    if varies == RATES:
        normals = taylor.loop.normals(samples.phase)
        across_1 = np.einsum("nik,ni->nk", normals, rate_1)
        across_2 = np.einsum("nik,ni->nk", normals, rate_2)
        rate = _averaged(places.mean((across_1 * across_2).mean(-1, keepdims=True)))
        rate = np.maximum(rate, SLOWEST**2 * rate.mean())
        across = _averaged(common - NOISE * noise) / rate
    square = np.maximum(np.stack([along, across]), 0.0) + TAIL**2 * _truncation(taylor)
    return Residual(residual, explained, np.sqrt(square).transpose(2, 0, 1))


def _truncation(taylor: TaylorSeries) -> np.ndarray:
    """Return (2, PLACES, 3): squares of the upper harmonics of A along the gait and
    across it, less the squares of their noise."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    n_waves = taylor.A.shape[-1]
    is_upper = np.arange(n_waves) > 2 * int(UPPER * (n_waves // 2))
    normals = taylor.loop.normals(t)
    rate = taylor.loop.shape(t, 1)
    tangent = rate / np.linalg.norm(rate, axis=1, keepdims=True)

    def squares(coefficients: np.ndarray) -> np.ndarray:
        A = series(coefficients * is_upper, t)
        along = np.einsum("t...ij,tj->t...i", A, tangent)
        across = np.einsum("t...ij,tjk->t...ik", A, normals)
        return np.stack([along**2, (across**2).mean(-1)])

    noise = squares(taylor.errors[:, :, :, 0]).sum(2)
    excess = [_averaged(a - b) for a, b in zip(squares(taylor.A), noise)]
    return np.maximum(np.stack(excess), 0.0)


class _Places:
    """Rows grouped by the nearest of PLACES phases."""

    def __init__(self, phase: np.ndarray):
        self.bins = np.rint(phase / (2 * np.pi) * PLACES).astype(int) % PLACES
        self.count = np.maximum(np.bincount(self.bins, minlength=PLACES), 2)[:, None]

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return means (PLACES, C) of values (N, C)."""
        totals = [np.bincount(self.bins, column, PLACES) for column in values.T]
        return np.stack(totals, -1) / self.count

    def product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return covariances (PLACES, C) of a and b (N, C)."""
        covariance = self.mean(a * b) - self.mean(a) * self.mean(b)
        return covariance * self.count / (self.count - 1)


def _averaged(values: np.ndarray) -> np.ndarray:
    """Return averages over WIDTH of values (PLACES, C)."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    weight = np.exp((np.cos(t[:, None] - t) - 1) / WIDTH**2)
    return weight @ values / weight.sum(1, keepdims=True)
