"""Units of plates, meshes and robots: annotations of lengths in m, and the acceleration
of gravity."""

from __future__ import annotations

from rft.core.checks import Number

GRAVITY = 9.81  # m/s^2
LARGEST = 10.0  # m; a larger number was likely meant in mm


def metres(meaning: str, low: float = 1e-6) -> Number:
    """Return the annotation of a length from ``low`` to `LARGEST`, both in m."""
    return Number(low, LARGEST, "m", meaning)
