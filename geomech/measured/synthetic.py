"""Logs computed from a known velocity, with cycles that vary and noise, to test a fit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.gaits import Gait
from geomech.io.files import atomic_file
from rft.core.checks import in_range

FINER = 4  # steps of the integration between two rows
MEMORY = 0.25  # correlation time of the joints' deviations, cycles


class SyntheticLog(NamedTuple):
    """A log with known phase.

    t (N,), s. alpha (N, d), rad. pose (N, 3): x, y, heading. phase (N,), rad, which a log file does not contain."""

    t: np.ndarray
    alpha: np.ndarray
    pose: np.ndarray
    phase: np.ndarray


def made(
    velocity: Callable, gait: Gait, cycles: int = 60, samples: int = 60, spread: float = 0.05, noise: float = 1e-3,
    pose_noise: float = 1e-3, frequency: float = 1.0, jitter: float = 0.02, seed: int = 0,
) -> SyntheticLog:  # fmt: skip
    """Return a log of so many cycles of a gait of a body with velocity(alpha, alphadot), with ``samples`` rows per
    cycle.

    spread (rad): standard deviation of smooth deviations of each joint from the gait, which decorrelate within a
    quarter of a cycle. jitter: relative standard deviation of the rate of the phase, over a cycle. noise (rad),
    pose_noise (the velocity's length, and rad): white noise of each row."""
    for name, value, low in (
        ("cycles", cycles, 2),
        ("samples", samples, 8),
        ("seed", seed, 0),
    ):
        in_range(name, value, low, 1e7, whole=True)
    rng, count = np.random.default_rng(seed), int(cycles * samples * FINER) + 1
    t = np.arange(count) / (samples * FINER * frequency)
    smooth = lambda width, columns: _smooth(
        rng, count, width * samples * FINER, columns
    )
    rate = 2 * np.pi * frequency * (1 + jitter * smooth(1.0, 1)[0][:, 0])
    step = t[1]
    phase = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2)]) * step
    deviation, deviation_rate = smooth(MEMORY, gait.joints)
    alpha = gait.shape(phase) + spread * deviation
    alphadot = gait.rate(phase) * rate[:, None] + spread * deviation_rate / step
    pose = _integrated(velocity(alpha, alphadot), step)[::FINER]
    alpha, pose = alpha[::FINER], pose + pose_noise * rng.normal(size=pose.shape)
    return SyntheticLog(
        t[::FINER], alpha + noise * rng.normal(size=alpha.shape), pose, phase[::FINER]
    )


def _smooth(
    rng, count: int, width: float, columns: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return values and their derivatives by the step, (count, columns) each, of unit variance, correlated over
    ``width`` steps."""
    k = (
        2 * np.pi * np.fft.rfftfreq(2 * count)[:, None]
    )  # twice as long, so that end and beginning are uncorrelated
    waves = (
        rng.normal(size=(len(k), columns)) + 1j * rng.normal(size=(len(k), columns))
    ) * np.exp(-((k * width) ** 2) / 2)
    waves[0] = 0.0
    values, rates = (
        np.fft.irfft(w, 2 * count, axis=0)[:count] for w in (waves, 1j * k * waves)
    )
    size = np.fft.irfft(waves, 2 * count, axis=0).std(0)
    return values / size, rates / size


def _integrated(xi: np.ndarray, step: float) -> np.ndarray:
    """Return poses (N, 3) from body velocities at equally spaced times, by integrated splines."""
    from scipy.interpolate import CubicSpline

    t = step * np.arange(len(xi))
    summed = lambda values: CubicSpline(t, values).antiderivative()(t)
    heading = summed(xi[:, 2])
    path = summed(np.exp(1j * heading) * (xi[:, 0] + 1j * xi[:, 1]))
    return np.stack([path.real, path.imag, heading], -1)


def save(path: str | Path, log: SyntheticLog) -> None:
    """Write a log as CSV: t, alpha_1 ..., x, y, heading."""
    names = [
        "t",
        *(f"alpha_{k + 1}" for k in range(log.alpha.shape[1])),
        "x",
        "y",
        "heading",
    ]
    rows = np.column_stack([log.t, log.alpha, log.pose])
    with atomic_file(path) as part:
        np.savetxt(part, rows, "%.9g", ",", header=",".join(names), comments="")
