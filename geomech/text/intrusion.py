"""Forces along a motion, in lines."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.studies.intrusion import Estimate
from geomech.text.grains import effect_lines
from rft.refusal import in_line

ROUNDING = 1e-12  # over the largest force or moment
UNITS = {"t": "s", "angle": "degrees", "x": "m", "y": "m", "z": "m"}


def numbers(result: Result) -> dict[str, Any]:
    """Return the columns, and the errors of force, N, and moment, N m; None where there are none."""
    error, parts = result.attributes["error"], result.subject[0].parts
    known = {k: x if np.isfinite(x) else None for k, x in error._asdict().items()}
    estimate = {
        "force": known["force"],
        "moment": known["moment"],
        f"from_{parts}": error.count,
    }
    return {
        **{v.name: v.values.tolist() for v in result.variables},
        "estimate": estimate,
    }


def text(result: Result) -> str:
    """Return the extremes of force and moment with their places and errors, and the effort."""
    (scene, found), error = result.subject, result.attributes["error"]
    columns = {v.name: v.values for v in result.variables}
    kinds = type(scene.intruder).__name__, type(scene.motion).__name__
    lines = [
        f"{in_line(scene.name)}: {kinds[0]} of {scene.count:,} {scene.parts}, {kinds[1]} in {len(found.t)} steps"
    ]
    if matched := getattr(scene, "matched", ""):
        lines.append(matched)
    lines += effect_lines(scene.effects)
    place = (
        "angle"
        if "angle" in columns
        else max((n for n in "xyz" if n in columns), key=lambda n: np.ptp(columns[n]))
    )
    names = [
        n
        for n in columns
        if n.startswith(("force", "moment"))
        and not (n == "moment" and "moment_y" in columns)
    ]
    largest = {
        kind: max(np.abs(columns[n]).max() for n in names if n.startswith(kind))
        for kind in ("force", "moment")
    }
    for name in names:
        ends = [(columns[name][k], np.degrees(columns[place][k]) if place == "angle" else columns[place][k])
                for k in (columns[name].argmin(), columns[name].argmax())]  # fmt: skip
        (low, at_low), (high, at_high) = (
            (value + 0.0, f"{place} = {where + 0.0:.4g} {UNITS[place]}")
            for value, where in ends
        )
        unit, kind = result[name].unit, name.partition("_")[0]
        if max(abs(low), abs(high)) < ROUNDING * largest[kind]:
            lines.append(f"{name:8} zero to rounding")
        elif high - low < ROUNDING * largest[kind]:
            lines.append(f"{name:8} {low:.4g} {unit} throughout")
        else:
            lines.append(
                f"{name:8} {low:.4g} at {at_low}, to {high:.4g} at {at_high} ({unit})"
            )
    lines.append(f"error    {_error(scene, error)}")
    work = float(np.sum((found.power[1:] + found.power[:-1]) / 2 * np.diff(found.t)))
    lines.append(
        f"work     {work:.4g} J of the grains on the body; power at most {found.power.max():.4g} W"
    )
    return "\n".join(lines)


def _error(scene, error: Estimate) -> str:
    if not np.isfinite(error.force):
        return f"not known: finer {scene.parts} are more than it takes"
    sizes = f"force {error.force:.1g} N, moment {error.moment:.1g} N m"
    return f"{sizes} at most, from up to {error.count:,} {scene.parts}"
