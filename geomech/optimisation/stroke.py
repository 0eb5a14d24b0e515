"""Strokes: loops that go round their centre once, and never back."""

from __future__ import annotations

import numpy as np

FLAT, BACK = (
    0.05,
    1e-9,
)  # of the first harmonic: thinner ellipses span no plane; of its sweep: tolerance
NEWTON = 3  # steps to the least sweep in an interval


class Stroke:
    """The plane and the sense, of its first harmonic, in which a loop p goes round its centre; loops: `Loops`.

    The area that p sweeps about the centre, per phase, is a trigonometric polynomial. Its minimum is found in each of N
    intervals between phases; where all minima are positive, the loop never goes back."""

    def __init__(self, loops, p: np.ndarray):
        self.plane, size, _ = np.linalg.svd(
            p[1:3].T, full_matrices=False
        )  # (joints, 2)
        self.thin, self.size = (
            size[-1] < FLAT * size[0] or len(size) < 2,
            float(np.prod(size)) or 1.0,
        )
        self.k, self.width = np.arange(1, loops.harmonics + 1), 2 * np.pi / loops.phases
        self.phases = self.width * np.arange(loops.phases)
        self.side, self._of, self._lowest = 1.0, None, None
        if not self.thin:
            (u, v), (du, dv) = self._going(p, self.phases)[:2]
            self.side = float(np.sign((u * dv - v * du).mean())) or 1.0

    def _going(self, p: np.ndarray, phases: np.ndarray) -> list[np.ndarray]:
        """Return the loop about its centre at the phases (N,), and its first three derivatives, (2, N) each."""
        q = p @ self.plane
        each = [
            (1j * self.k[:, None]) ** n * (q[1::2] - 1j * q[2::2]) for n in range(4)
        ]
        return np.split(
            (np.exp(1j * np.outer(phases, self.k)) @ np.concatenate(each, 1)).real.T, 4
        )

    def lowest(self, p: np.ndarray) -> np.ndarray:
        """Return the phase (N,) of least sweep in each interval between phases."""
        if self._of is None or not np.array_equal(self._of, p):
            self._of, self._lowest = np.array(p), self._minimised(p)
        return self._lowest

    def _minimised(self, p: np.ndarray) -> np.ndarray:
        """Return `lowest`, by Newton's method."""
        cross = lambda a, b: self.side * (a[0] * b[1] - a[1] * b[0])
        shift = np.zeros_like(self.phases)
        for _ in range(NEWTON):
            x, dx, ddx, dddx = self._going(p, self.phases + shift)
            rise, bend = cross(x, ddx), cross(dx, ddx) + cross(x, dddx)
            step = -rise / np.where(bend > 0, bend, 1.0)
            step = np.where(
                bend > 0, step, -np.sign(rise) * self.width
            )  # to an edge, where there is no minimum
            shift = np.clip(shift + step, -self.width / 2, self.width / 2)
        return self.phases + shift

    def swept(self, p: np.ndarray) -> np.ndarray:
        """Return the least area (N,) per phase that the loop p sweeps about the centre in every interval, over that of
        its first harmonic."""
        (u, v), (du, dv) = self._going(p, self.lowest(p))[:2]
        return self.side * (u * dv - v * du) / self.size

    def slopes(self, p: np.ndarray) -> np.ndarray:
        """Return the slopes of `swept`, (N, *shape of p)."""
        at = self.lowest(p)
        (u, v), (du, dv) = self._going(p, at)[:2]
        kt = np.outer(at, self.k)
        waves, rates = np.zeros((2, len(at), len(p)))
        waves[:, 1::2], waves[:, 2::2] = np.cos(kt), np.sin(kt)
        rates[:, 1::2], rates[:, 2::2] = -self.k * np.sin(kt), self.k * np.cos(kt)
        by_u = dv[:, None] * waves - v[:, None] * rates
        by_v = u[:, None] * rates - du[:, None] * waves
        rows = by_u[..., None] * self.plane[:, 0] + by_v[..., None] * self.plane[:, 1]
        return self.side * rows / self.size

    def winding(self, p: np.ndarray) -> int:
        """Return how often the loop goes round its centre, in the sense of the first."""
        u, v = self._going(p, self.phases)[0]
        q = u + 1j * v
        return int(
            np.rint(
                self.side * np.angle(np.roll(q, -1) * np.conj(q)).sum() / (2 * np.pi)
            )
        )

    @classmethod
    def is_one(cls, loops, p: np.ndarray, back: float = BACK) -> bool:
        """Return whether the loop is one stroke, with a sweep that is nowhere below -``back``."""
        if p.ndim != 2 or p.shape[1] < 2:
            return False
        own = cls(loops, p)
        return not own.thin and own.swept(p).min() >= -back and own.winding(p) == 1
