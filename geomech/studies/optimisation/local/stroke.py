"""Strokes: loops that go round their centre once, and never back."""

from __future__ import annotations

import numpy as np

FLAT = 0.05  # shorter over longer axis of the first harmonic: thinner spans no plane
BACK = 1e-9  # of the sweep of the first harmonic: tolerance of going back
NEWTON_STEPS = 3  # to the least sweep in an interval


class Stroke:
    """The plane and the sense of the first harmonic of a loop p, in which it goes round
    its centre. loops: `Loops`.

    The area that p sweeps about the centre, per phase, is a trigonometric polynomial.
    Its minimum is found in each of N intervals between phases; where all minima are
    positive, the loop never goes back."""

    def __init__(self, loops, p: np.ndarray):
        # The axes of the first harmonic, (joints, 2), and half their lengths.
        self.plane, axes, _ = np.linalg.svd(p[1:3].T, full_matrices=False)
        self.thin = axes[-1] < FLAT * axes[0] or len(axes) < 2
        self.size = float(np.prod(axes)) or 1.0

        self.k = np.arange(1, loops.harmonics + 1)
        self.width = 2 * np.pi / loops.phases
        self.phases = self.width * np.arange(loops.phases)
        self._last_loop = None
        self._last_phases = None

        self.side = 1.0
        if not self.thin:
            (u, v), (du, dv), *_ = self._derivatives(p, self.phases)
            self.side = float(np.sign((u * dv - v * du).mean())) or 1.0

    def _derivatives(self, p: np.ndarray, phases: np.ndarray) -> list[np.ndarray]:
        """Return the loop about its centre in the plane at the phases (N,), and its
        first three derivatives, (2, N) each."""
        q = p @ self.plane
        amplitudes = q[1::2] - 1j * q[2::2]
        orders = [(1j * self.k[:, None]) ** n * amplitudes for n in range(4)]
        waves = np.exp(1j * np.outer(phases, self.k))
        return np.split((waves @ np.concatenate(orders, 1)).real.T, 4)

    def lowest(self, p: np.ndarray) -> np.ndarray:
        """Return the phase (N,) of least sweep in each interval between phases."""
        if self._last_loop is None or not np.array_equal(self._last_loop, p):
            self._last_loop = np.array(p)
            self._last_phases = self._minimised(p)
        return self._last_phases

    def _minimised(self, p: np.ndarray) -> np.ndarray:
        """Return `lowest`, by Newton's method."""

        def cross(a, b):
            return self.side * (a[0] * b[1] - a[1] * b[0])

        shift = np.zeros_like(self.phases)
        for _ in range(NEWTON_STEPS):
            x, dx, ddx, dddx = self._derivatives(p, self.phases + shift)
            slope = cross(x, ddx)
            bend = cross(dx, ddx) + cross(x, dddx)
            step = -slope / np.where(bend > 0, bend, 1.0)
            # An interval without a minimum has its least sweep at an edge.
            step = np.where(bend > 0, step, -np.sign(slope) * self.width)
            shift = np.clip(shift + step, -self.width / 2, self.width / 2)
        return self.phases + shift

    def swept(self, p: np.ndarray) -> np.ndarray:
        """Return the least area (N,) per phase that the loop p sweeps about the centre
        in every interval, over that of its first harmonic."""
        (u, v), (du, dv), *_ = self._derivatives(p, self.lowest(p))
        return self.side * (u * dv - v * du) / self.size

    def slopes(self, p: np.ndarray) -> np.ndarray:
        """Return the slopes of `swept`, (N, *shape of p)."""
        phases = self.lowest(p)
        (u, v), (du, dv), *_ = self._derivatives(p, phases)
        kt = np.outer(phases, self.k)
        waves = np.zeros((len(phases), len(p)))
        waves[:, 1::2] = np.cos(kt)
        waves[:, 2::2] = np.sin(kt)
        rates = np.zeros_like(waves)
        rates[:, 1::2] = -self.k * np.sin(kt)
        rates[:, 2::2] = self.k * np.cos(kt)
        by_u = dv[:, None] * waves - v[:, None] * rates
        by_v = u[:, None] * rates - du[:, None] * waves
        rows = by_u[..., None] * self.plane[:, 0] + by_v[..., None] * self.plane[:, 1]
        return self.side * rows / self.size

    def winding(self, p: np.ndarray) -> int:
        """Return how often the loop goes round its centre, in the sense of the
        first."""
        u, v = self._derivatives(p, self.phases)[0]
        q = u + 1j * v
        angles = np.angle(np.roll(q, -1) * np.conj(q))
        return int(np.rint(self.side * angles.sum() / (2 * np.pi)))

    @classmethod
    def is_one(cls, loops, p: np.ndarray, back: float = BACK) -> bool:
        """Return whether the loop is one stroke, with a sweep nowhere below
        -``back``."""
        if p.ndim != 2 or p.shape[1] < 2:
            return False
        stroke = cls(loops, p)
        if stroke.thin:
            return False
        return stroke.swept(p).min() >= -back and stroke.winding(p) == 1
