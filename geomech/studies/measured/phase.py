"""The phase of a log: place in the cycle, which grows at a uniform rate on average."""

from __future__ import annotations

import numpy as np

from geomech.mathematics.geometry.representations.tube import waves

# Of the highest autocorrelation: the shortest shift above this is the period.
NEARLY_HIGHEST = 0.9
ORDER = 4  # of the Butterworth filter about the cycle's frequency
DENSITY = 8  # harmonics of the density of a protophase


def period_of(t: np.ndarray, alpha: np.ndarray) -> float:
    """Return the period of shapes alpha (N, d) at equally spaced t: the first peak of
    their autocorrelation that is near the highest. 0 without a peak."""
    centred = alpha - alpha.mean(0)
    n = len(t)
    spectrum = np.fft.rfft(centred, 2 * n, axis=0)
    raw = np.fft.irfft(np.abs(spectrum) ** 2, axis=0).sum(1)[: n // 2 + 1]
    correlation = raw / np.arange(n, n - len(raw), -1)
    below = np.flatnonzero(correlation < 0)
    if not below.size:
        return 0.0
    tail = correlation.copy()
    tail[: below[0]] = -np.inf
    peaks = 1 + np.flatnonzero((tail[1:-1] > tail[:-2]) & (tail[1:-1] >= tail[2:]))
    peaks = peaks[tail[peaks] >= NEARLY_HIGHEST * tail[peaks].max(initial=0.0)]
    if not peaks.size or tail[peaks[0]] <= 0:
        return 0.0
    # The vertex of the parabola through the peak and its neighbours.
    k = peaks[0]
    a, b, c = correlation[k - 1 : k + 2]
    return (k + 0.5 * (a - c) / (a - 2 * b + c)) * (t[1] - t[0])


def protophase(t: np.ndarray, alpha: np.ndarray, period: float) -> np.ndarray:
    """Return the angle (N,), rad, of the analytic signal (Hilbert transform) of the
    combination of joints with the largest swing.

    The signal is filtered to between half and one and a half times the cycle's
    frequency. alpha (N, d) is at equally spaced t."""
    from scipy.signal import butter, hilbert, sosfiltfilt

    band = 2 * np.array([0.5, 1.5]) * (t[1] - t[0]) / period
    slow = sosfiltfilt(butter(ORDER, band, "bandpass", output="sos"), alpha, axis=0)
    z = hilbert(slow, axis=0)
    _, vectors = np.linalg.eigh(z.conj().T @ z)
    return np.unwrap(np.angle(z @ vectors[:, -1]))


def uniform(phase: np.ndarray) -> np.ndarray:
    """Return a growing phase (N,) with uniform density: the integral of the Fourier
    series of its density.

    Kralemann et al., Phys. Rev. E 77, 066205 (2008); Revzen and Guckenheimer, Phys.
    Rev. E 78, 051907 (2008)."""
    k = np.arange(1, DENSITY + 1)
    count = np.floor((phase[-1] - phase[0]) / (2 * np.pi))
    full_cycles = phase[phase < phase[0] + 2 * np.pi * count]
    density = np.exp(-1j * full_cycles[:, None] * k).mean(0)
    correction = (density / (1j * k) * (np.exp(1j * phase[:, None] * k) - 1)).sum(1)
    return phase + 2 * correction.real


def fitted_loop(phase: np.ndarray, alpha: np.ndarray, harmonics: int) -> np.ndarray:
    """Return Fourier coefficients (d, 2 K + 1) of shapes alpha (N, d) over the phase,
    by least squares."""
    return np.linalg.lstsq(waves(phase, harmonics), alpha, rcond=None)[0].T
