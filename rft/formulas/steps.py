"""Smooth steps from 0 to 1, of what comes and goes."""

from __future__ import annotations

import numpy as np


def smooth_step(x: np.ndarray) -> np.ndarray:
    """Return 0 below 0, 1 above 1, and between them x^3 (10 - 15 x + 6 x^2), whose
    first two derivatives are continuous."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def on_weight(phase: np.ndarray, half_width: float, rise: float) -> np.ndarray:
    """Return the weight of a part that touches for phases within ``half_width`` of 0,
    and lifts off, or touches down, over ``rise`` about that; rad."""
    distance = np.abs((phase + np.pi) % (2 * np.pi) - np.pi)
    return smooth_step((half_width - distance) / rise + 0.5)
