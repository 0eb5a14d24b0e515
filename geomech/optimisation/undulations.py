"""Undulations of a body of many elements as two numbers: amplitude over wavelength, and waves on the body."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from geomech.gaits import Sine
from geomech.optimisation.loops import TOUCHING

NAMES = "amplitude", "waves"
LEAST, MOST = (0.01, 0.5), (1.0, 4.0)
ELEMENTS_PER_WAVE = 12  # with fewer a sine is a polygon


@dataclass(frozen=True)
class Undulations:
    """All sines of a body with the elements of ``first``, evaluated at ``phases``. The parameters p are (amplitude,
    waves)."""

    first: Sine
    phases: int = 64

    shape = (2,)
    unit = 0.5

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest parameters, (2,) each."""
        return np.array(LEAST), np.array(
            [MOST[0], min(MOST[1], self.first.elements / ELEMENTS_PER_WAVE)]
        )

    def cycle(self, p) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (..., N, joints) of sines p (..., 2)."""
        cycles = [self.gait(x).cycle(self.phases) for x in np.reshape(p, (-1, 2))]
        return tuple(
            np.stack(x).reshape(*np.shape(p)[:-1], self.phases, -1)
            for x in zip(*cycles)
        )

    def limits(self, dense: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return (A, b) with A p <= b, which holds at all phases."""
        low, high = self.bounds
        return np.concatenate([np.eye(2), -np.eye(2)]), np.concatenate([high, -low])

    def active(self, p) -> list[str]:
        """Return the limits that the sine touches, as text."""
        names = []
        for name, x, low, high in zip(NAMES, p, *self.bounds):
            names += [f"{name} >= {low:g}"] if x <= low * (1 + TOUCHING) else []
            names += [f"{name} <= {high:g}"] if x >= high * (1 - TOUCHING) else []
        return names

    def gait(self, p) -> Sine:
        return dataclasses.replace(self.first, amplitude=float(p[0]), waves=float(p[1]))

    def of(self, gait: Sine) -> np.ndarray:
        return np.array([abs(gait.amplitude), gait.waves])

    def fitted(self, p) -> np.ndarray:
        return np.clip(p, *self.bounds)

    def starts(self, own, count: int, seed: int = 0) -> list[np.ndarray]:
        """Return ``count`` initial sines, ``own`` the first."""
        rng, (low, high) = np.random.default_rng(seed), self.bounds
        return [self.fitted(own)] + [
            low + (high - low) * rng.uniform(0.05, 0.5, 2) for _ in range(count - 1)
        ]

    def same(self, p, q) -> bool:
        """Return whether two sines are the same."""
        return bool(np.abs(np.asarray(p) - q).max() < 0.01)
