"""One stroke a cycle: a loop that goes round its centre once, and never back."""

from __future__ import annotations

import numpy as np

FLAT, BACK = 0.05, 1e-6  # of the first harmonic: how thin a plane, and how far back a stroke, is none


class Stroke:
    """The sense and the plane, of its first harmonic, in which a loop p goes round its centre; loops: `Loops`."""

    def __init__(self, loops, p: np.ndarray):
        self.plane, size, _ = np.linalg.svd(p[1:3].T, full_matrices=False)  # (joints, 2)
        self.thin, self.size = size[-1] < FLAT * size[0] or len(size) < 2, float(np.prod(size)) or 1.0
        self.at, self.rates = loops.basis[::2].copy(), loops.rates[::2]
        self.at[:, 0] = 0.0  # about the centre
        self.side = 1.0
        if not self.thin:
            self.side = float(np.sign(self.swept(p).mean())) or 1.0

    def _going(self, p):
        q = p @ self.plane
        return (self.at @ q).T, (self.rates @ q).T

    def swept(self, p: np.ndarray) -> np.ndarray:
        """(N,): area about the centre that the loop p sweeps, for each phase, over that of its first harmonic."""
        (u, v), (du, dv) = self._going(p)
        return self.side * (u * dv - v * du) / self.size

    def slopes(self, p: np.ndarray) -> np.ndarray:
        """Those of `swept`, (N, *shape of p)."""
        (u, v), (du, dv) = self._going(p)
        by_u = dv[:, None] * self.at - v[:, None] * self.rates
        by_v = u[:, None] * self.rates - du[:, None] * self.at
        rows = by_u[..., None] * self.plane[:, 0] + by_v[..., None] * self.plane[:, 1]
        return self.side * rows / self.size

    def winding(self, p: np.ndarray) -> int:
        """How often the loop goes round, in the sense of the first."""
        (u, v), _ = self._going(p)
        q = u + 1j * v
        return int(np.rint(self.side * np.angle(np.roll(q, -1) * np.conj(q)).sum() / (2 * np.pi)))

    @classmethod
    def is_one(cls, loops, p: np.ndarray) -> bool:
        """Whether the loop is one stroke."""
        if p.ndim != 2 or p.shape[1] < 2:
            return False
        own = cls(loops, p)
        return not own.thin and own.swept(p).min() >= -BACK and own.winding(p) == 1
