"""The cost of accuracy in lines: the cheapest settings by tolerance, then a sentence for each setting that was varied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from geomech.core.variables import Result
from geomech.studies import accuracy

numbers = accuracy.table
SCALES = {  # of an error, by what only a study of that kind has
    "parts": ("error / largest", " of its largest"),
    "speed": ("error (m/s)", " m/s"),
    "amplitudes": ("error in BL", ""),
}


def text(result: Result) -> str:
    """Return the table and the sentences of a study."""
    study = numbers(result)
    return "\n".join([table(study), "", *sentences(study)])


def table(found: Mapping[str, Any]) -> str:
    """Return the cheapest measured settings by tolerance."""
    rows = [_cells(choice) for choice in found["cheapest"]]
    names = max((list(row) for row in rows), key=len)
    scale, _ = _scale(found)
    heads = {name: scale if name == "tolerance" else name for name in names}
    wide = {
        n: max(len(heads[n]), *(len(row.get(n, "")) for row in rows)) for n in names
    }
    lines = [f"speed {found['speed']:.6g} m/s"] if "speed" in found else []
    lines.append("  ".join(f"{heads[n]:>{wide[n]}}" for n in names))
    for row in rows:
        cells = (f"{row[n]:>{wide[n]}}" for n in names if n in row)
        lines.append(
            "  ".join([*cells, *["none of those tried"] * (len(row) < len(names))])
        )
    if error := found.get("own_error"):
        lines.append(
            f"errors here include the table's own, {error:.1e} BL, which no setting takes away; those below do not"
        )
    return "\n".join(lines)


def _cells(choice: Mapping[str, Any]) -> dict[str, str]:
    """Return a row of the table by column; its tolerance alone where nothing meets that."""
    cells = {"tolerance": f"{choice['tolerance']:.0e}"}
    if choice.get("tier"):
        cells["setting"] = (
            f"{choice['tier']}, {choice['setting']} = {choice['value']:g}"
        )
    settings = {
        k: x
        for k, x in choice.items()
        if k not in ("tolerance", "tier", "setting", "value", "error", "seconds")
    }
    if any(x is not None for x in settings.values()) or len(settings) > 1:
        cells |= {name: "-" if x is None else f"{x:g}" for name, x in settings.items()}
    if "error" in choice:
        cells |= {
            "error": f"{choice['error']:.1e}",
            "seconds": f"{choice['seconds']:.4f}",
        }
    return cells


def sentences(found: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each setting: its values from coarse to fine, error, time, gain, and measured order."""
    lines, (_, of) = [], _scale(found)
    for line in found["lines"]:
        e, t, v = line["error"], line["seconds"], line["value"]
        slope = (
            "no slope, all rounding"
            if line["slope"] is None
            else f"measured order {line['slope']:.1f}"
        )
        settings = f"{line['label']} {v[0]:g} to {v[-1]:g}" + (
            f" {found['parts']}" if "parts" in found else ""
        )
        against = " of its own limit" * (line.get("against") == "limit")
        buys = f"; buys {line['buys']}" if "buys" in line else ""
        error = f"error {e[0]:.1e} to {e[-1]:.1e}{of}{against}"
        lines.append(
            f"{settings}: {error} for {t[-1] / t[0]:.1f} times the time{buys} ({slope}; theory: {line['order']})."
        )
    return lines


def _scale(found: Mapping[str, Any]) -> tuple[str, str]:
    return next(
        (scale for key, scale in SCALES.items() if key in found), SCALES["amplitudes"]
    )
