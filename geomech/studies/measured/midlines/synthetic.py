"""Trials of an undulator with known motion, cycles that vary, and noise, to test
intervals."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from geomech.io.files import atomic_file
from geomech.mathematics.systems.base import body_size
from geomech.studies.measured.midlines.trial import Trial
from geomech.studies.measured.synthetic import _integrated as integrated
from geomech.studies.measured.synthetic import _smooth as smooth_noise
from rft.core.checks import in_range

STEPS_PER_FRAME = 3  # of the integration
CORRELATION = 0.25  # cycles, over which the wave's deviations are correlated
# Times the trial, over which deviations have no mean: over the trial itself their mean
# varies as it does for free ones.
LONGER = 8


class SyntheticTrial(NamedTuple):
    """A trial: t (F,), points (F, P, 2) tail to head, in body lengths, and the same
    without noise."""

    t: np.ndarray
    points: np.ndarray
    exact: np.ndarray

    def trial(self, name: str = "synthetic") -> Trial:
        """Return the trial as `geomech.studies.measured.midlines.reader.read` gives
        it."""
        frames, points = self.points.shape[:2]
        lines = 2 + np.arange(frames * points).reshape(frames, points)
        return Trial(
            name,
            self.t,
            self.points,
            tuple(str(k + 1) for k in range(points)),
            lines,
            "BL",
        )


def synthetic_midlines(
    system: Any,
    cycles: float = 8.0,
    frames: int = 40,
    points: int = 30,
    *,
    swing: float = 0.9,
    waves: float = 1.1,
    frequency: float = 1.0,
    noise: float = 0.01,
    spread: float = 0.05,
    jitter: float = 0.02,
    heading: float = 0.5,
    bend: float = 0.0,
    third: float = 0.0,
    memory: float = CORRELATION,
    seed: int = 0,
) -> SyntheticTrial:
    """Return a trial of a swimmer of many equal elements (`rft.Backbone`) in its
    medium.

    Headings along the body are swing sin(phase + 2 pi waves s), a wave from head to
    tail. frames: per cycle. points: at equal distances from tail to head. noise:
    standard deviation of x and y, body lengths. spread, jitter: relative standard
    deviations of swing and waves, and of the rate of the phase, which vary over
    ``memory`` of a cycle. heading (rad): at the start. bend (rad): of the resting body,
    which makes it turn. third: third harmonic of the wave, over its swing."""
    in_range("frames", frames, 8, 1e6, whole=True)
    rng = np.random.default_rng(seed)
    steps_per_cycle = frames * STEPS_PER_FRAME
    count = int(cycles * frames * STEPS_PER_FRAME) + 1
    t = np.arange(count) / (steps_per_cycle * frequency)
    width = memory * frames * STEPS_PER_FRAME
    varying = smooth_noise(rng, LONGER * count, width, 3)[0][:count]
    rate = 2 * np.pi * frequency * (1 + jitter * varying[:, 0])
    gained = np.cumsum((rate[1:] + rate[:-1]) / 2) * t[1]
    phase = rng.uniform(0, 2 * np.pi) + np.concatenate([[0.0], gained])
    swings = swing * (1 + spread * varying[:, 1])
    wavenumbers = 2 * np.pi * waves * (1 + spread * varying[:, 2])

    # Headings of the elements, and the motion of the body that they cause.
    elements = system.joints + 1
    s = (np.arange(elements) + 0.5) / elements
    phases = phase[:, None] + wavenumbers[:, None] * (s - 0.5)
    wave = np.sin(phases) + third * np.sin(3 * phases)
    headings = swings[:, None] * wave + bend * (s - 0.5)
    alpha = np.diff(headings, axis=-1)
    alphadot = _rates(t, alpha)
    pose = integrated(system.velocity(alpha, alphadot), t[1]) + [0.0, 0.0, heading]
    pose[:, :2] = pose[:, :2] @ _rotation(heading).T
    rows = slice(None, None, STEPS_PER_FRAME)
    ends = system.body.points(alpha[rows], pose[rows])
    exact = _along_body(ends, np.linspace(0, 1, points)) / body_size(system)
    noisy = exact + noise * rng.normal(size=exact.shape)
    return SyntheticTrial(t[rows], noisy, exact)


def _rotation(angle: float) -> np.ndarray:
    """Return the matrix (2, 2) of a rotation."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _rates(t: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Return the rates of shapes alpha (N, d) at times t."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(t, alpha).derivative()(t)


def _along_body(ends: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return points (F, P, 2) at shares s of the arc through ends (F, n + 1, 2) of
    equal elements."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(np.linspace(0, 1, ends.shape[1]), ends, axis=1)(s)


def save(path: str | Path, trial: SyntheticTrial) -> None:
    """Write a trial as CSV: t, point, x, y, in body lengths."""
    frames, points = trial.points.shape[:2]
    rows = np.column_stack(
        [
            np.repeat(trial.t, points),
            np.tile(np.arange(1, points + 1), frames),
            trial.points.reshape(-1, 2),
        ]
    )
    with atomic_file(path) as part:
        np.savetxt(
            part,
            rows,
            ("%.6g", "%d", "%.6g", "%.6g"),
            ",",
            header="t,point,x_BL,y_BL",
            comments="",
        )
