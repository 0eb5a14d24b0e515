"""What a gait is: a closed curve in shape space, run once as the phase t goes from 0 to 2 pi."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LARGEST = 1e6  # rad or scale: beyond it an angle has few digits left


@dataclass(frozen=True, kw_only=True)
class Gait:
    """alpha(t) = centre + amplitude * unit(t). Subclasses give `joints`, `unit` and `unit_rate`.

    amplitude: scales the curve about its centre. centre: shape angles (rad), the origin if left empty.
    reverse: run the curve backwards, t -> -t, from the same start.
    """

    amplitude: float = 1.0
    centre: tuple[float, ...] = ()
    reverse: bool = False
    angles = ("centre",)
    harmonics = 1

    def __post_init__(self):
        try:
            object.__setattr__(self, "centre", tuple(float(x) for x in self.centre))
            object.__setattr__(self, "amplitude", float(self.amplitude))
        except (TypeError, OverflowError):
            raise ValueError(f"amplitude and centre must be numbers, got {self.amplitude!r}, {self.centre!r}") from None
        if not abs(self.amplitude) <= LARGEST:
            raise ValueError(f"amplitude must be finite and at most {LARGEST:g}, got {self.amplitude!r}")
        if self.centre and len(self.centre) != self.joints:
            raise ValueError(f"centre must have {self.joints} angles, got {list(self.centre)}")
        if not all(map(math.isfinite, self.centre)):
            raise ValueError(f"centre must be finite, got {list(self.centre)}")

    @property
    def joints(self) -> int:
        return 2

    @property
    def amplitude_label(self) -> str:
        """For an axis of amplitudes."""
        return f"amplitude of the {type(self).__name__.lower()} (scale)"

    def unit(self, t) -> np.ndarray:
        raise TypeError(f"{type(self).__name__} gives no curve: define unit(t)")

    def unit_rate(self, t) -> np.ndarray:
        raise TypeError(f"{type(self).__name__} gives no curve: define unit_rate(t)")

    def shape(self, t, amplitudes=None) -> np.ndarray:
        """alpha at phases t (T...), for amplitudes (B...) or the gait's own: (B..., T..., joints), rad."""
        centre = np.array(self.centre or (0.0,) * self.joints)
        return centre + self._times(amplitudes, self.unit(-np.asarray(t, float) if self.reverse else t))

    def rate(self, t, amplitudes=None) -> np.ndarray:
        """d alpha / dt, shaped like `shape`."""
        sign = -1.0 if self.reverse else 1.0
        return self._times(amplitudes, sign * self.unit_rate(sign * np.asarray(t, float)))

    def _times(self, amplitudes, curve):
        a = np.asarray(self.amplitude if amplitudes is None else amplitudes, float)
        if not (np.abs(a) <= LARGEST).all():
            raise ValueError(f"amplitudes must be finite and at most {LARGEST:g}, got {a.ravel()[:4]}")
        return a[(..., *([None] * curve.ndim))] * curve

    def cycle(self, phases: int, amplitudes=None) -> tuple[np.ndarray, np.ndarray]:
        """(alpha, alphadot) at ``phases`` equally spaced phases from 0, each (B..., phases, joints)."""
        least = max(4, 2 * self.harmonics + 1)
        if not (np.isfinite(phases) and int(phases) == phases and phases >= least):
            raise ValueError(f"phases must be a whole number of at least {least} for this gait, got {phases!r}")
        t = 2 * np.pi * np.arange(phases) / phases
        return self.shape(t, amplitudes), self.rate(t, amplitudes)


def finite_array(name: str, values: Sequence, ndim: int) -> np.ndarray:
    """values as a float array of that many dimensions, or ValueError naming it."""
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} must be numbers in equal rows, got {values!r}") from None
    if array.ndim != ndim or not array.size or not (np.abs(array) <= LARGEST).all():
        raise ValueError(f"{name} must be {ndim}-dimensional, finite and not empty, got {values!r}")
    return array
