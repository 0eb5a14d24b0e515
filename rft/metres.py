"""Annotations of lengths in m, for plates, meshes and robots."""

from __future__ import annotations

from rft.checks import Number

LARGEST = 10.0  # m; a larger number was likely meant in mm


def metres(meaning: str, low: float = 1e-6) -> Number:
    """Return the annotation of a length from ``low`` to `LARGEST`, both in m."""
    return Number(low, LARGEST, "m", meaning)
