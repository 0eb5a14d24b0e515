"""A sweep in a line: its points and the ranges of its values."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geomech.core.variables import Result, Variable

SHOWN = {"net_distance": "net distance per cycle", "speed": "speed"}


def text(result: Result) -> str:
    """Return how many points there are, of what kinds, and the ranges of the net distance and the speed."""
    points = int(np.prod([v.values.size for v in result.variables if v.is_coordinate]))
    kinds = ", ".join(kind for v in result.variables if v.is_text for kind in _kinds(v))
    shown = (v for v in result.variables if v.name in SHOWN)
    ranges = [f"{SHOWN[v.name]} {v.values.min():.6g} to {v.values.max():.6g} {v.unit}" for v in shown]
    return ", ".join([f"{points} points" + (f" ({kinds})" if kinds else ""), *ranges])


def _kinds(variable: Variable) -> Iterator[str]:
    """Yield how often each word stands in a variable of words."""
    for word, count in zip(*np.unique(variable.values, return_counts=True)):
        yield f"{count} {word}"
