"""Intervals of kinematics: from the cycles, from the noise of the tracking, and from what smoothing cuts off.

The value is that of all cycles, less its mean change by noise. Its variance has three parts. Noise: the residual of
the smooth midlines is put on them again and again, and everything is computed anew. Cycles: leaving out one after
another gives pseudo-values, whose scatter is that of the cycles and that which noise explains; the variance taken for
the former is the likeliest. Smoothing: the change with more modes and more knots, less the part that noise explains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geomech.measured.midlines import smooth

Values = Callable[[smooth.Curve], tuple[np.ndarray, np.ndarray]]

RESAMPLED = 40  # times that noise is put on
TRIED = np.concatenate([[0.0], np.geomspace(1e-3, 10, 80)])  # variances of cycles over that of the pseudo-values


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
    from scipy.stats import t as student

    count, by_noise = len(sample.pseudo), sample.noisy - sample.value
    noise = by_noise.var(0, ddof=1)
    cycles = np.zeros_like(noise)
    if count > 1:
        cycles = _variance(sample.pseudo, sample.noisy_pseudo - sample.pseudo) / count
    unbiased = 2 * sample.change - sample.noisy_change.mean(0)
    cut_off = np.maximum(unbiased**2 - sample.noisy_change.var(0, ddof=1), 0.0)
    total = np.maximum(cycles + noise + cut_off, 1e-300)
    degrees = total**2 / np.maximum(cycles**2 / max(count - 1, 1) + noise**2 / (len(by_noise) - 1), 1e-300)
    factor = student.ppf((1 + level) / 2, np.clip(degrees, max(count - 1, 1), 1e6))
    value = sample.value - by_noise.mean(0)
    return Intervals(value, *np.sqrt((cycles, noise, cut_off)), factor * np.sqrt(total), sample.pseudo)


def _variance(values: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Return the variances (Q,) of values (C, Q) between cycles beyond noise (B, C, Q), of largest likelihood.

    Noise is correlated between neighbours: what ends one cycle too far begins the next too late."""
    count = len(values)
    contrasts = np.linalg.qr(np.column_stack([np.ones(count), np.eye(count)[:, 1:]]))[0][:, 1:]
    deviation = noise - noise.mean(0)
    same = (deviation**2).sum(0).mean(0) / (len(noise) - 1)
    next_one = (deviation[:, 1:] * deviation[:, :-1]).sum(0).mean(0) / (len(noise) - 1)
    scatter = np.maximum(values.var(0, ddof=1), 1e-300)
    best = np.empty(values.shape[1])
    for q in range(values.shape[1]):
        near = np.clip(next_one[q], -0.5 * same[q], 0.5 * same[q])
        known = same[q] * np.eye(count) + near * (np.eye(count, k=1) + np.eye(count, k=-1))
        sizes, axes = np.linalg.eigh(contrasts.T @ known @ contrasts)
        square = (axes.T @ (contrasts.T @ values[:, q])) ** 2
        spread = np.maximum(TRIED[:, None] * scatter[q] + np.maximum(sizes, 0.0), 1e-12 * scatter[q])
        best[q] = TRIED[(np.log(spread) + square / spread).sum(1).argmin()] * scatter[q]
    return best


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
