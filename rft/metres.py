"""Lengths in m, as plates, meshes and robots have them."""

from __future__ import annotations

from rft.checks import Number

LARGEST = 10.0  # m; what is larger was likely given in mm


def metres(meaning: str, low: float = 1e-6) -> Number:
    """Return the annotation of a length from ``low`` to `LARGEST`, both in m."""
    return Number(low, LARGEST, "m", meaning)
