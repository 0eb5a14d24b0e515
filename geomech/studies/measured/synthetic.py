"""Logs computed from a known velocity, with cycles that vary and noise, to test a
fit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.io.files import atomic_file
from geomech.mathematics.gaits import Gait
from rft.core.checks import in_range

STEPS_PER_ROW = 4  # of the integration
CORRELATION = 0.25  # cycles, over which the joints' deviations are correlated


class SyntheticLog(NamedTuple):
    """A log with known phase.

    t (N,), s. alpha (N, d), rad. pose (N, 3): x, y, heading. phase (N,), rad, which a
    log file does not contain."""

    t: np.ndarray
    alpha: np.ndarray
    pose: np.ndarray
    phase: np.ndarray


def synthetic_log(
    velocity: Callable,
    gait: Gait,
    cycles: int = 60,
    samples: int = 60,
    spread: float = 0.05,
    noise: float = 1e-3,
    pose_noise: float = 1e-3,
    frequency: float = 1.0,
    jitter: float = 0.02,
    seed: int = 0,
) -> SyntheticLog:
    """Return a log of ``cycles`` cycles of a gait of a body with velocity(alpha,
    alphadot), with ``samples`` rows per cycle.

    spread (rad): standard deviation of smooth deviations of each joint from the gait,
    which decorrelate within a quarter of a cycle. jitter: relative standard deviation
    of the rate of the phase, over a cycle. noise (rad), pose_noise (the velocity's
    length, and rad): white noise of each row."""
    in_range("cycles", cycles, 2, 1e7, whole=True)
    in_range("samples", samples, 8, 1e7, whole=True)
    in_range("seed", seed, 0, 1e7, whole=True)
    rng = np.random.default_rng(seed)
    steps_per_cycle = samples * STEPS_PER_ROW
    count = int(cycles * steps_per_cycle) + 1
    t = np.arange(count) / (steps_per_cycle * frequency)
    step = t[1]

    # The phase, whose rate varies from cycle to cycle.
    variation, _ = _smooth(rng, count, 1.0 * steps_per_cycle, 1)
    rate = 2 * np.pi * frequency * (1 + jitter * variation[:, 0])
    phase = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2)]) * step

    # The shapes, which deviate from the gait, and the motion of the body.
    width = CORRELATION * steps_per_cycle
    deviation, deviation_rate = _smooth(rng, count, width, gait.joints)
    alpha = gait.shape(phase) + spread * deviation
    alphadot = gait.rate(phase) * rate[:, None] + spread * deviation_rate / step
    pose = _integrated(velocity(alpha, alphadot), step)

    rows = slice(None, None, STEPS_PER_ROW)
    pose = pose[rows]
    pose = pose + pose_noise * rng.normal(size=pose.shape)
    alpha = alpha[rows]
    alpha = alpha + noise * rng.normal(size=alpha.shape)
    return SyntheticLog(t[rows], alpha, pose, phase[rows])


def _smooth(
    rng, count: int, width: float, columns: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return values and their derivatives by the step, (count, columns) each, of unit
    variance, correlated over ``width`` steps."""
    # Twice as long, so that end and beginning are uncorrelated.
    n = 2 * count
    k = 2 * np.pi * np.fft.rfftfreq(n)[:, None]
    real = rng.normal(size=(len(k), columns))
    imaginary = rng.normal(size=(len(k), columns))
    waves = (real + 1j * imaginary) * np.exp(-((k * width) ** 2) / 2)
    waves[0] = 0.0
    values = np.fft.irfft(waves, n, axis=0)
    rates = np.fft.irfft(1j * k * waves, n, axis=0)
    size = values.std(0)
    return values[:count] / size, rates[:count] / size


def _integrated(xi: np.ndarray, step: float) -> np.ndarray:
    """Return poses (N, 3) from body velocities xi (N, 3) at equally spaced times, by
    integrated splines."""
    from scipy.interpolate import CubicSpline

    t = step * np.arange(len(xi))

    def integral(values):
        return CubicSpline(t, values).antiderivative()(t)

    heading = integral(xi[:, 2])
    path = integral(np.exp(1j * heading) * (xi[:, 0] + 1j * xi[:, 1]))
    return np.stack([path.real, path.imag, heading], -1)


def save(path: str | Path, log: SyntheticLog) -> None:
    """Write a log as CSV: t, alpha_1 ..., x, y, heading."""
    joints = [f"alpha_{k + 1}" for k in range(log.alpha.shape[1])]
    names = ["t", *joints, "x", "y", "heading"]
    rows = np.column_stack([log.t, log.alpha, log.pose])
    with atomic_file(path) as part:
        np.savetxt(part, rows, "%.9g", ",", header=",".join(names), comments="")
