"""A sweep in lines: its points, and the values at each of a few, or the least and the largest of many."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geomech.core.variables import Result, Variable

SHOWN = {"net_distance": "net distance per cycle", "speed": "speed"}
ROWS = 16  # points in a table


def text(result: Result) -> str:
    """Return how many points there are, of what kinds, the ranges of the net distance and the speed, and where these are."""
    axes = [v for v in result.variables if v.is_coordinate]
    points = int(np.prod([v.values.size for v in axes]))
    kinds = ", ".join(kind for v in result.variables if v.is_text for kind in _kinds(v))
    shown = [v for v in result.variables if v.name in SHOWN]
    ranges = [
        f"{SHOWN[v.name]} {v.values.min():.6g} to {v.values.max():.6g} {v.unit}"
        for v in shown
    ]
    lines = [
        ", ".join([f"{points} points" + (f" ({kinds})" if kinds else ""), *ranges])
    ]
    words = [v for v in result.variables if v.is_text]
    rows = (
        _table(axes, shown, words)
        if points <= ROWS
        else (line for v in shown for line in _extremes(axes, v))
    )
    return "\n".join([*lines, *rows])


def _table(
    axes: list[Variable], shown: list[Variable], words: list[Variable]
) -> Iterator[str]:
    """Yield a row a point: its parameters, and values with their errors."""
    heads = [v.label for v in axes] + [
        x for v in shown for x in (f"{v.name} ({v.unit})".replace("_", " "), "+- error")
    ]
    wide = [max(10, len(head)) + 2 for head in heads]
    yield "".join(f"{head:>{w}}" for head, w in zip(heads, wide))
    for at in np.ndindex(*(v.values.size for v in axes)):
        cells = [f"{v.values[k]:.6g}" for v, k in zip(axes, at)]
        cells += [
            x for v in shown for x in (f"{v.values[at]:.6g}", f"{v.error[at]:.1e}")
        ]
        yield "".join(f"{cell:>{w}}" for cell, w in zip(cells, wide)) + "".join(
            f"  {v.values[at]}" for v in words
        )


def _extremes(axes: list[Variable], shown: Variable) -> Iterator[str]:
    """Yield the least and the largest value with their parameters and errors."""
    for name, find in (("least", np.nanargmin), ("largest", np.nanargmax)):
        at = np.unravel_index(find(shown.values), shown.values.shape)
        where = ", ".join(f"{v.label} = {v.values[k]:.6g}" for v, k in zip(axes, at))
        yield f"{name} {SHOWN[shown.name]} {shown.values[at]:.6g} +- {shown.error[at]:.1g} {shown.unit} at {where}"


def _kinds(variable: Variable) -> Iterator[str]:
    """Yield how often each word stands in a variable of words."""
    for word, count in zip(*np.unique(variable.values, return_counts=True)):
        yield f"{count} {word}"
