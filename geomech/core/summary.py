"""One-line descriptions of values: shapes, ranges, units, and residuals of fits."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Iterable, Sequence

import numpy as np

from geomech.core.variables import COMPONENTS
from rft.core.premise import negation
from rft.core.refusal import formatted

WIDTH = 80  # characters of a line on a small screen
ALIKE = 1e-9  # difference of values that are alike, over them


def part(kind: str, thing) -> str:
    """Return the kind and the numbers of a part of a scene, to six digits, as a scene
    has them; without keys that are None."""
    entries = []
    if dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            value = getattr(thing, field.name)
            if value is not None:
                entries.append(f"{field.name} = {formatted(_six_digits(value))}")
    if not entries:
        return kind
    return f"{kind} ({', '.join(entries)})"


def _six_digits(value):
    """Return a number, or numbers in a tuple or list, with six digits."""
    if isinstance(value, tuple | list):
        return type(value)(map(_six_digits, value))
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return value


def grid(axes: Sequence[np.ndarray], names: Sequence[str] = ()) -> str:
    """Return the shape of a grid and the ranges of its axes. names: of the axes,
    alpha_1 ... if left out."""
    shape = " x ".join(str(len(a)) for a in axes)
    ranges = [f"{a[0]:.4g} to {a[-1]:.4g}" for a in axes]
    names = names or [f"alpha_{k + 1}" for k in range(len(axes))]
    if len(axes) > 1 and len(set(ranges)) == 1:
        all_names = f"{names[0]} to {names[-1]}"
        if len(names) == 2:
            all_names = f"{names[0]} and {names[-1]}"
        return f"{shape} shapes, {all_names} from {ranges[0]} rad"
    text = ", ".join(f"{name} from {x}" for name, x in zip(names, ranges))
    return f"{shape} shapes, {text} rad"


def span(values) -> str:
    """Return the smallest and the largest of the numbers; "nothing" without any."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    if not values.size:
        return "nothing"
    low = f"{values.min():.3g}"
    high = f"{values.max():.3g}"
    if low == high:
        return low
    return f"{low} to {high}"


def spans(values) -> str:
    """Return `span` of each of x, y and theta, on the first axis."""
    return ", ".join(f"{row} {span(v)}" for row, v in zip(COMPONENTS, values))


def masked(values) -> str:
    """Return the number of singular shapes as an addition to a line; "" without any."""
    count = int(np.isnan(np.asarray(values)).any(0).sum())
    if count == 0:
        return ""
    return f"; {count} singular"


def fit_residual(residual, speed) -> str:
    """Return the residual of a fit by component, rms over all shapes, over the rms of
    xi."""
    if np.isnan(residual).all():
        return "residual of the fit unknown"
    parts = []
    for name, r, s in zip(COMPONENTS, residual, speed):
        relative = np.sqrt(np.nanmean(r**2) / max(np.nanmean(s**2), 1e-300))
        parts.append(f"{name} {percent(relative)}")
    return f"the fit leaves {', '.join(parts)} of the rms of xi unexplained"


def percent(share: float) -> str:
    """Return a share in percent, to two digits; 0 where it is rounding."""
    if share > 1e-8:
        return f"{100 * share:.2g} %"
    return "0 %"


def lengths(unit: str, length: float | None) -> str:
    """Return the unit of lengths and the body's length as an addition to a line; ""
    where they are unknown."""
    if length is None:
        return ""
    if unit == "BL":
        return f"; lengths in {unit}"
    return f"; lengths in {unit}, body length {length:g}"


def poses(values) -> str:
    """Return the ranges of x, y and theta of poses or velocities (..., 3)."""
    rows = np.asarray(values, float).reshape(-1, 3).T
    return spans(np.round(rows, 12) + 0.0)  # no -0


def first_place(values: np.ndarray, extreme: float) -> tuple[int, ...]:
    """Return the first place, in C order, at which an array has its extreme, but for
    rounding, which would decide between places that are alike."""
    is_extreme = np.abs(values - extreme) <= ALIKE * np.abs(extreme)
    place = np.unravel_index(np.flatnonzero(is_extreme)[0], values.shape)
    return tuple(map(int, place))


def listed(names: Sequence[str]) -> str:
    """Return "x", "x and y" or "x, y and heading"."""
    *first, last = names
    if not first:
        return last
    return f"{', '.join(first)} and {last}"


def wrapped(lines: Iterable[str], indent: int = 2) -> list[str]:
    """Return lines of WIDTH at most; the rest of a longer line follows, indented."""
    fill = textwrap.TextWrapper(
        WIDTH,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    short = []
    for line in lines:
        if len(line) > WIDTH:
            short += fill.wrap(line)
        else:
            short.append(line)
    return short


def effect_lines(effects: Sequence) -> list[str]:
    """Return a line for each effect on the ground, and one more for its assumptions."""
    lines = []
    for effect in effects:
        premises = negation(effect.breaks) or "breaks no assumption"
        lines.append(
            f"on:  {part(effect.kind, effect)}; {premises}; cost: {effect.cost}; "
            f"vanishes as {effect.limit} (order {effect.order})"
        )
        if effect.assumes:
            lines.append(f"     assumption: {effect.assumes}")
    return lines
