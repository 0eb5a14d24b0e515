"""Intervals of kinematics: from the cycles, from the noise of the tracking, and from what smoothing cuts off.

The value is that of all cycles, less its mean change by noise. Its variance has three parts. Noise: the residual of
the smooth midlines is put on them again and again, and everything is computed anew. Cycles: leaving out one after
another gives pseudo-values, whose scatter is that of the cycles and that which noise explains; all variances of the
former count by their likelihood. Smoothing: the change with more modes and more knots, less the part that noise
explains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geomech.measured.midlines import smooth

Values = Callable[[smooth.Curve], tuple[np.ndarray, np.ndarray]]

RESAMPLED = 40  # times that noise is put on
TRIED = np.geomspace(1e-3, 100, 60)  # variances of cycles over that of the pseudo-values
REPEATING = 0.25  # prior probability that cycles repeat exactly, as a robot's; found by coverage
FURTHEST = 12.0  # standard deviations of the largest variance: more than half a width


@dataclass(frozen=True, eq=False)
class Intervals:
    """Values with the parts of their errors, (Q,) each.

    value: without the bias of noise. cycles, noise, smoothing: one standard deviation each. half_width: of the interval.
    per_cycle: (C, Q), pseudo-values of the cycles."""

    value: np.ndarray
    cycles: np.ndarray
    noise: np.ndarray
    smoothing: np.ndarray
    half_width: np.ndarray
    per_cycle: np.ndarray


@dataclass(frozen=True, eq=False)
class Sample:
    """Quantities as measured and with noise put on once more.

    value (Q,), pseudo (C, Q): of all cycles, and their pseudo-values. noisy (B, Q), noisy_pseudo (B, C, Q): likewise.
    change: (Q,), what finer smoothing adds to the value; noisy_change: (B, Q)."""

    value: np.ndarray
    pseudo: np.ndarray
    noisy: np.ndarray
    noisy_pseudo: np.ndarray
    change: np.ndarray
    noisy_change: np.ndarray


def intervals(sample: Sample, level: float) -> Intervals:
    """Return intervals that cover the truth in a share ``level`` of cases."""
    from scipy.special import ndtr, ndtri

    count, by_noise = len(sample.pseudo), sample.noisy - sample.value
    noise = by_noise.var(0, ddof=1)
    unbiased = 2 * sample.change - sample.noisy_change.mean(0)
    cut_off = np.maximum(unbiased**2 - sample.noisy_change.var(0, ddof=1), 0.0)
    known = np.maximum(noise + cut_off, 1e-300)
    half_width = ndtri((1 + level) / 2) * np.sqrt(known)
    if count > 1:
        weights, variances = _variances(sample.pseudo, sample.noisy_pseudo - sample.pseudo, noise)
        deviation = np.sqrt(variances / count + known)
        low, high = half_width, FURTHEST * deviation.max(0)
        for _ in range(40):
            middle = (low + high) / 2
            inside = (weights * (2 * ndtr(middle / deviation) - 1)).sum(0) < level
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        half_width = high
    cycles = np.maximum((half_width / ndtri((1 + level) / 2)) ** 2 - known, 0.0)
    value = sample.value - by_noise.mean(0)
    return Intervals(value, *np.sqrt((cycles, noise, cut_off)), half_width, sample.pseudo)


def _variances(values: np.ndarray, noise: np.ndarray, of_mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return weights and variances (V, Q) that the cycles may have beyond noise, from pseudo-values (C, Q).

    noise: (B, C, Q), of the pseudo-values, correlated between neighbours: what ends one cycle too far begins the next too
    late. of_mean: (Q,), its variance in the mean. The weights are the likelihood of the contrasts between cycles, times a
    prior: cycles repeat exactly with REPEATING, else v^-1/2 (v + C of_mean)^-1/2 dv."""
    count = len(values)
    contrasts = np.linalg.qr(np.column_stack([np.ones(count), np.eye(count)[:, 1:]]))[0][:, 1:]
    deviation = noise - noise.mean(0)
    same = (deviation**2).sum(0).mean(0) / (len(noise) - 1)
    near = (deviation[:, 1:] * deviation[:, :-1]).sum(0).mean(0) / (len(noise) - 1)
    near = np.clip(near, -0.5 * same, 0.5 * same)
    neighbours = np.eye(count, k=1) + np.eye(count, k=-1)
    scatter = np.maximum(values.var(0, ddof=1), 1e-300)
    variances = np.vstack([np.zeros_like(scatter), TRIED[:, None] * scatter])
    likelihood = np.empty_like(variances)
    for q in range(values.shape[1]):
        known = contrasts.T @ (same[q] * np.eye(count) + near[q] * neighbours) @ contrasts
        sizes, axes = np.linalg.eigh(known)
        square = (axes.T @ (contrasts.T @ values[:, q])) ** 2
        spread = variances[:, q, None] + np.maximum(sizes, 1e-12 * scatter[q])
        likelihood[:, q] = -0.5 * (np.log(spread) + square / spread).sum(1)
    prior = np.sqrt(variances[1:] / (variances[1:] + count * of_mean))  # times v, as TRIED is geometric
    prior = np.vstack([np.full_like(scatter, REPEATING), (1 - REPEATING) * prior / prior.sum(0)])
    weights = prior * np.exp(likelihood - likelihood.max(0))
    return weights / weights.sum(0), variances


def sampled(
    curve: smooth.Curve, fine: smooth.Curve, values: Values, resampled: int | None = None, seed: int = 0
) -> Sample:
    """Return the quantities of a curve, and the same with noise put on once more, as often as ``resampled`` or RESAMPLED.

    fine: the same `smooth.refined`. values: returns quantities (Q,) and pseudo-values (C, Q) of a curve."""
    value, pseudo = values(curve)
    noisy, changes = [], []
    for k in range(RESAMPLED if resampled is None else resampled):
        one, other = (c.noisy(np.random.default_rng((seed, k))) for c in (curve, fine))
        noisy.append(values(one))
        changes.append(values(other)[0] - noisy[-1][0])
    each, every = (np.array([x[k] for x in noisy]) for k in (0, 1))
    return Sample(value, pseudo, each, every, values(fine)[0] - value, np.array(changes))
