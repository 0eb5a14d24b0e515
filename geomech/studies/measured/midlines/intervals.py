"""Intervals of kinematics: from the cycles, from the noise of the tracking, and from
what smoothing cuts off.

The value is that of all cycles, less its mean change by noise. Its variance has three
parts. Noise: the residual of the smooth midlines is put on them again and again, and
everything is computed anew. Cycles: leaving out one after another gives pseudo-values,
whose scatter is that of the cycles and that which noise explains; all variances of the
former count by their likelihood. Smoothing: the change from fewer modes and fewer
knots, less the part that noise explains, and as a series goes on that each mode more
halves (`smooth.Curve.falls`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geomech.studies.measured.midlines import smooth

Values = Callable[[smooth.Curve], tuple[np.ndarray, np.ndarray]]

RESAMPLED = 40  # times that noise is added
# Variances of cycles that are tried, over the variance of the pseudo-values, or of
# noise.
TRIED = np.geomspace(1e-3, 100, 40)
REPEATING = 0.5  # prior probability that all cycles repeat exactly, as a robot's
# Prior probability that a quantity repeats exactly where others do not; found by
# coverage.
CONSTANT = 0.2
# Correlations of neighbouring cycles, and their prior shares; found by coverage.
CORRELATIONS = {-0.5: 1.0, 0.0: 1.0, 0.5: 1.0, 0.8: 0.2}
# Of the bias by noise, which is found from midlines with noise; found by coverage.
UNSURE = 0.15
# Independent deviations of a wave (size, length, pace), which move all quantities;
# assumed.
FREE = 3.0
TINY = 1e-30  # variance below which there is rounding alone
FURTHEST = 12.0  # standard deviations of the largest variance: more than half a width


@dataclass(frozen=True, eq=False)
class Intervals:
    """Values with the parts of their errors, (Q,) each.

    value: without the bias of noise. cycles, noise, smoothing: one standard deviation
    each. half_width: of the interval. per_cycle: (C, Q), pseudo-values of the
    cycles."""

    value: np.ndarray
    cycles: np.ndarray
    noise: np.ndarray
    smoothing: np.ndarray
    half_width: np.ndarray
    per_cycle: np.ndarray


@dataclass(frozen=True, eq=False)
class Sample:
    """Quantities as measured and with noise put on once more.

    value (Q,), pseudo (C, Q): of all cycles, and their pseudo-values. noisy (B, Q),
    noisy_pseudo (B, C, Q): likewise. change: (Q,), what smoothing cuts off;
    noisy_change: (B, Q)."""

    value: np.ndarray
    pseudo: np.ndarray
    noisy: np.ndarray
    noisy_pseudo: np.ndarray
    change: np.ndarray
    noisy_change: np.ndarray


def intervals(
    sample: Sample, level: float, constant: float | np.ndarray = CONSTANT
) -> Intervals:
    """Return intervals that cover the truth in a share ``level`` of cases.

    constant: prior probability that a quantity repeats where others do not; of all, or
    (Q,)."""
    from scipy.special import ndtr, ndtri

    by_noise = sample.noisy - sample.value
    bias = by_noise.mean(0)
    noise = by_noise.var(0, ddof=1) + (UNSURE * bias) ** 2
    unbiased = 2 * sample.change - sample.noisy_change.mean(0)
    cut_off = np.maximum(unbiased**2 - sample.noisy_change.var(0, ddof=1), 0.0)
    known = np.maximum(noise + cut_off, 1e-300)
    half_width = ndtri((1 + level) / 2) * np.sqrt(known)
    if len(sample.pseudo) > 1:
        pseudo_noise = sample.noisy_pseudo - sample.pseudo
        weights, by_cycles = _cycle_variances(sample.pseudo, pseudo_noise, constant)
        deviation = np.sqrt(by_cycles + known)
        # Bisection for the half width whose coverage is the level.
        low = half_width
        high = FURTHEST * deviation.max(0)
        for _ in range(40):
            middle = (low + high) / 2
            coverage = (weights * (2 * ndtr(middle / deviation) - 1)).sum(0)
            low = np.where(coverage < level, middle, low)
            high = np.where(coverage < level, high, middle)
        half_width = high
    cycles = np.maximum((half_width / ndtri((1 + level) / 2)) ** 2 - known, 0.0)
    return Intervals(
        value=sample.value - bias,
        cycles=np.sqrt(cycles),
        noise=np.sqrt(noise),
        smoothing=np.sqrt(cut_off),
        half_width=half_width,
        per_cycle=sample.pseudo,
    )


def _cycle_variances(
    values: np.ndarray, noise: np.ndarray, constant: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return weights and variances (M, Q) that the mean of pseudo-values (C, Q) may
    have by cycles, beyond noise (B, C, Q).

    The weights are the likelihood of the contrasts between cycles times a prior: v = 0
    if `_repeating` or ``constant``, else the density of the cycles' variance v is 1/(v
    + noise). Neighbours are correlated by one of CORRELATIONS, cycles at a distance of
    k by its k-th power; all quantities together show which one. Noise is correlated
    between neighbours as well: an error that ends one cycle too far begins the next too
    late."""
    count = len(values)
    distance = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    columns = np.column_stack([np.ones(count), np.eye(count)[:, 1:]])
    contrasts = np.linalg.qr(columns)[0][:, 1:]
    deviation = noise - noise.mean(0)
    same = np.maximum((deviation**2).sum(0).mean(0) / (len(noise) - 1), TINY)
    near = (deviation[:, 1:] * deviation[:, :-1]).sum(0).mean(0) / (len(noise) - 1)
    near = np.clip(near, -0.5 * same, 0.5 * same)
    scatter = np.maximum(values.var(0, ddof=1), TINY)
    neighbours = np.where(distance == 1, near[:, None, None], 0.0)
    own = (same + 1e-9 * scatter)[:, None, None]
    known = np.where(distance == 0, own, neighbours)
    factor = np.linalg.cholesky(contrasts.T @ known @ contrasts)
    whitening = np.linalg.inv(factor) @ contrasts.T
    white = (whitening @ values.T[..., None])[..., 0]
    repeating = _repeating(white, np.einsum("qkc,bcq->bqk", whitening, deviation))
    exact = repeating + (1 - repeating) * constant
    variances = np.vstack([np.zeros_like(scatter), TRIED[:, None] * scatter])
    prior = variances[1:] / (variances[1:] + same)  # times v, as TRIED is geometric
    prior = np.vstack([exact + 0 * scatter, (1 - exact) * prior / prior.sum(0)])

    likelihood = []
    by_cycles = []
    for correlation in np.power.outer([*CORRELATIONS], distance):
        whitened = whitening @ correlation @ whitening.transpose(0, 2, 1)
        sizes, axes = np.linalg.eigh(whitened)
        square = (axes.transpose(0, 2, 1) @ white[..., None])[..., 0] ** 2
        spread = 1 + variances[..., None] * sizes
        likelihood.append(-0.5 * (np.log(spread) + square / spread).sum(-1))
        by_cycles.append(variances * correlation.mean())
    likelihood = np.array(likelihood)
    weights = prior * np.exp(likelihood - likelihood.max((0, 1)))

    # All quantities show the correlation of neighbours together, as few deviations move
    # them.
    evidence = np.log(np.maximum(weights.sum(1), 1e-300))
    others = evidence.sum(1, keepdims=True) - evidence
    pooled = (FREE - 1) / max(len(scatter) - 1, 1) * others
    shares = np.array([*CORRELATIONS.values()])[:, None]
    weights = weights * (shares * np.exp(pooled - pooled.max(0)))[:, None]
    weights = weights / weights.sum((0, 1))
    shape = (-1, len(scatter))
    return weights.reshape(shape), np.array(by_cycles).reshape(shape)


def _repeating(white: np.ndarray, drawn: np.ndarray) -> float:
    """Return the probability that cycles repeat exactly, from contrasts (Q, C - 1) of
    unit variance by noise.

    All are one test: by noise alone their mean square is 1, and its scatter in noise
    that is drawn (B, Q, C - 1) gives the number of independent ones. Cycles that vary
    make it 1 + r, of a density (r (1 + r))^-1/2."""
    square = (white**2).mean()
    by_noise = (drawn**2).mean((1, 2))
    free = 2 * by_noise.mean() ** 2 / by_noise.var(ddof=1)
    ratio = 1 + np.concatenate([[0.0], TRIED])
    prior = np.sqrt(TRIED / (1 + TRIED))
    prior = np.concatenate([[REPEATING], (1 - REPEATING) * prior / prior.sum()])
    likelihood = -0.5 * free * (np.log(ratio) + square / ratio)
    weights = prior * np.exp(likelihood - likelihood.max())
    return float(weights[0] / weights.sum())


def sampled(
    curve: smooth.Curve,
    coarse: smooth.Curve,
    values: Values,
    phase: np.ndarray,
    resampled: int | None = None,
    seed: int = 0,
) -> Sample:
    """Return the quantities of a curve, and the same with noise put on once more, as
    often as ``resampled`` or RESAMPLED.

    coarse: the same `smooth.coarser`. values: returns quantities (Q,) and pseudo-values
    (C, Q) of a curve. phase: (F,), of the frames, rad."""
    value, pseudo = values(curve)
    coarse_value, _ = values(coarse)

    # Noise is added to a curve with little noise. On a noisy one its effect is larger
    # than on the body: the slip, an absolute value, rises little where the body slips
    # by more than noise.
    base = curve.repeating(phase)
    base_value, base_pseudo = values(base)

    # The remainder of a geometric series.
    remainder = 1 / (curve.falls ** (curve.modes - coarse.modes) - 1)
    change = remainder * (value - coarse_value)
    noisy = []
    noisy_pseudo = []
    noisy_change = []
    if resampled is None:
        resampled = RESAMPLED
    for k in range(resampled):
        with_noise, with_noise_pseudo = values(base.noisy(_generator(seed, k)))
        coarse_with_noise, _ = values(coarse.noisy(_generator(seed, k)))
        by_noise = with_noise - base_value
        coarse_by_noise = coarse_with_noise - coarse_value
        noisy.append(value + by_noise)
        noisy_pseudo.append(pseudo + with_noise_pseudo - base_pseudo)
        noisy_change.append(change + remainder * (by_noise - coarse_by_noise))
    return Sample(
        value,
        pseudo,
        np.array(noisy),
        np.array(noisy_pseudo),
        change,
        np.array(noisy_change),
    )


def _generator(seed: int, k: int) -> np.random.Generator:
    """Return the generator of the k-th noise, the same for every curve."""
    return np.random.default_rng((seed, k))
