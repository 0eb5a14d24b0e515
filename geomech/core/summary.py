"""One-line descriptions of values: shapes, ranges, units, and residuals of fits."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Iterable, Sequence

import numpy as np

from rft.premise import negated
from rft.refusal import formatted

ROWS = ("x", "y", "theta")
WIDTH = 80  # characters of a line on a small screen


def part(kind: str, thing) -> str:
    """Return the kind and the numbers of a part of a scene, to six digits, as a scene has them; no key that is None."""
    names = (
        [f.name for f in dataclasses.fields(thing)]
        if dataclasses.is_dataclass(thing)
        else []
    )
    values = [(name, getattr(thing, name)) for name in names]
    given = [
        f"{name} = {formatted(_six_digits(value))}"
        for name, value in values
        if value is not None
    ]
    return f"{kind} ({', '.join(given)})" if given else kind


def _six_digits(value):
    if isinstance(value, tuple | list):
        return type(value)(map(_six_digits, value))
    return float(f"{value:.6g}") if isinstance(value, float) else value


def grid(axes: Sequence[np.ndarray], names: Sequence[str] = ()) -> str:
    """Return the shape of a grid and the ranges of its axes. names: of the axes, alpha_1 ... if left out."""
    ranges = [f"{a[0]:.4g} to {a[-1]:.4g}" for a in axes]
    equal = len(set(ranges)) == 1 and len(ranges) > 1
    names = names or [f"alpha_{k + 1}" for k in range(len(axes))]
    described = (
        f"{names[0]}{' and ' if len(names) == 2 else ' to '}{names[-1]} from {ranges[0]}"
        if equal
        else ""
    )
    described = described or ", ".join(
        f"{name} from {r}" for name, r in zip(names, ranges)
    )
    return f"{' x '.join(str(len(a)) for a in axes)} shapes, {described} rad"


def span(values) -> str:
    """Return the smallest and the largest of the numbers; "nothing" without any."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    if not values.size:
        return "nothing"
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"


def spans(values) -> str:
    """Return `span` of each of x, y and theta, on the first axis."""
    return ", ".join(f"{row} {span(v)}" for row, v in zip(ROWS, values))


def masked(values) -> str:
    """Return the number of singular shapes as an addition to a line; empty if none is."""
    count = int(np.isnan(np.asarray(values)).any(0).sum())
    return f"; {count} singular" if count else ""


def fit_residual(residual, speed) -> str:
    """Return the residual of a fit by component, rms over all shapes, over the rms of xi."""
    if np.isnan(residual).all():
        return "fit residual unknown"
    parts = [
        np.sqrt(np.nanmean(r**2) / max(np.nanmean(s**2), 1e-300))
        for r, s in zip(residual, speed)
    ]
    return (
        "fit leaves "
        + ", ".join(f"{row} {_percent(x)}" for row, x in zip(ROWS, parts))
        + " of the rms of xi"
    )


def _percent(x: float) -> str:
    return f"{100 * x:.2g} %" if x > 1e-8 else "0 %"


def lengths(unit: str, length: float | None) -> str:
    """Return the unit of lengths and the body's length as an addition to a line; empty where they are unknown."""
    if length is None:
        return ""
    return f"; lengths in {unit}" + (f", the body's {length:g}" if unit != "BL" else "")


def poses(values) -> str:
    """Return the ranges of x, y and theta of poses or velocities (..., 3)."""
    return spans(
        np.moveaxis(np.round(np.asarray(values, float).reshape(-1, 3), 12) + 0.0, -1, 0)
    )


def listed(names: Sequence[str]) -> str:
    """Return "x", "x and y" or "x, y and heading"."""
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def wrapped(lines: Iterable[str], indent: int = 2) -> list[str]:
    """Return lines of WIDTH at most; of a longer one the rest follows, indented."""
    fill = textwrap.TextWrapper(
        WIDTH,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [
        part
        for line in lines
        for part in (fill.wrap(line) if len(line) > WIDTH else [line])
    ]


def effect_lines(effects: Sequence) -> list[str]:
    """Return a line for each effect on the ground, and one more for what it assumes."""
    lines = []
    for effect in effects:
        lines.append(
            f"on:  {part(effect.kind, effect)}; {negated(effect.breaks) or 'keeps every premise'}; costs {effect.cost}; "
            f"gone at {effect.limit}, order {effect.order}"
        )
        if effect.assumes:
            lines.append(f"     assumes {effect.assumes}")
    return lines
