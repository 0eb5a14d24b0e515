"""Undulations of a body of many elements as two numbers: amplitude over wavelength, and
waves on the body."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from geomech.mathematics.gaits import Sine
from geomech.studies.optimisation.loops import TOUCHING

NAMES = ("amplitude", "waves")
SMALLEST = (0.01, 0.5)
LARGEST = (1.0, 4.0)
ELEMENTS_PER_WAVE = 12  # with fewer a sine is a polygon
EQUAL = 0.01  # largest difference of a parameter between sines that count as the same


@dataclass(frozen=True)
class Undulations:
    """All sines of a body with the elements of ``first``, evaluated at ``phases``.

    The parameters p are (amplitude, waves)."""

    first: Sine
    phases: int = 64

    shape = (2,)
    unit = 0.5

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest parameters, (2,) each."""
        amplitude, waves = LARGEST
        waves = min(waves, self.first.elements / ELEMENTS_PER_WAVE)
        return np.array(SMALLEST), np.array([amplitude, waves])

    def cycle(self, p) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (..., N, joints) of sines p (..., 2)."""
        cycles = [self.gait(x).cycle(self.phases) for x in np.reshape(p, (-1, 2))]
        alpha, alphadot = zip(*cycles)
        shape = (*np.shape(p)[:-1], self.phases, -1)
        return np.stack(alpha).reshape(shape), np.stack(alphadot).reshape(shape)

    def limits(self, dense: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return (A, b) with A p <= b, which holds at all phases."""
        low, high = self.bounds
        return np.concatenate([np.eye(2), -np.eye(2)]), np.concatenate([high, -low])

    def active(self, p) -> list[str]:
        """Return the limits that the sine touches, as text."""
        names = []
        for name, x, low, high in zip(NAMES, p, *self.bounds):
            if x <= low * (1 + TOUCHING):
                names.append(f"{name} >= {low:g}")
            if x >= high * (1 - TOUCHING):
                names.append(f"{name} <= {high:g}")
        return names

    def gait(self, p) -> Sine:
        """Return the gait of parameters p."""
        return dataclasses.replace(self.first, amplitude=float(p[0]), waves=float(p[1]))

    def from_gait(self, gait: Sine) -> np.ndarray:
        """Return p of a gait."""
        return np.array([abs(gait.amplitude), gait.waves])

    def fitted(self, p) -> np.ndarray:
        """Return p moved into the bounds."""
        return np.clip(p, *self.bounds)

    def starts(self, first, count: int, seed: int = 0) -> list[np.ndarray]:
        """Return ``count`` initial sines, ``first`` the first."""
        rng = np.random.default_rng(seed)
        low, high = self.bounds
        sines = [self.fitted(first)]
        for _ in range(count - 1):
            sines.append(low + (high - low) * rng.uniform(0.05, 0.5, 2))
        return sines

    def is_same(self, p, q) -> bool:
        """Return whether two sines are the same."""
        return bool(np.abs(np.asarray(p) - q).max() < EQUAL)
