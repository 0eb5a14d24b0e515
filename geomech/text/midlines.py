"""Kinematics of midlines in lines and as JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.measured.midlines.kinematics import QUANTITIES
from geomech.measured.midlines.predicted import COMPARED, Closing
from geomech.measured.midlines.question import SOURCES, units_of, with_unit

SHOWN = tuple(name for name in QUANTITIES if name not in ("drift", "arc_wavelength"))
MORE = "per cycle, along the body and by source of error: --json, or -o FILE.nc"


def numbers(result: Result) -> dict[str, Any]:
    """Return all numbers: quantities with half widths of intervals and standard errors by source."""
    fit, comparison = result.subject
    units = units_of(fit)
    quantities = {
        name: {
            "value": float(result[name].values),
            "half_width": float(result[name].error),
            "unit": units[name],
            "standard_error": dict(
                zip(SOURCES, result["standard_error"].values[k].tolist())
            ),
        }
        for k, name in enumerate(QUANTITIES)
    }
    along = {
        name: {
            "value": result[f"{name}_along"].values.tolist(),
            "half_width": result[f"{name}_along"].error.tolist(),
        }
        for name in ("slip", "amplitude")
    }
    per_cycle = dict(zip(QUANTITIES, result["per_cycle"].values.T.tolist()))
    facts = {
        key: value
        for key, value in result.attributes.items()
        if key not in ("title", "frame_meaning", "notes")
    }
    facts["notes"] = result.attributes["notes"].splitlines()
    out = {
        **facts,
        "quantities": quantities,
        "s": result["s"].values.tolist(),
        "along": along,
        "per_cycle": per_cycle,
    }
    if comparison is not None:
        out["predicted"] = {
            name: {
                "value": float(value),
                "half_width": float(error),
                "unit": units[name],
            }
            for name, value, error in zip(
                COMPARED, comparison.predicted, comparison.predicted_error
            )
        }
        out["closing"] = [_numbers(x) for x in comparison.closing]
    return out


def _numbers(x: Closing) -> dict[str, Any]:
    found = math.isfinite(x.value)
    return {"parameter": x.name, "unit": x.unit, "present": x.present, "value": x.value if found else None,
            "half_width": x.error if found else None, "tried": [float(x.low), float(x.high)]}  # fmt: skip


def text(result: Result) -> str:
    """Return a trial in lines."""
    fit, comparison = result.subject
    about, units = result.attributes, units_of(fit)
    left = about["cycles_left_out"]
    lines = [
        f"{about['file']}: {about['cycles']} full cycles of {about['points']} points"
        + (f"; {left} with gaps left out" if left else ""),
        f"head: {about['head']}",
        f"smoothed by {about['modes']} modes along the body and {about['knots_per_cycle']:.3g} knots a cycle, more than "
        f"by cross-validation; noise of a point {about['noise']:.2g} BL",
        f"with intervals of {100 * about['level']:.3g} % of cases:",
    ]
    lines += [
        f"  {name:<12}"
        + with_unit(pair(result[name].values, result[name].error), units[name])
        for name in SHOWN
    ]
    return "\n".join(
        lines + (_compared(comparison, units) if comparison is not None else [])
    )


def pair(value: float, error: float) -> str:
    """Return a value and its error with as many digits as the error's first two."""
    value, error = float(value), float(error)
    if not (math.isfinite(error) and error > 1e-12 * abs(value)):  # rounding
        return f"{value:>10.4g}"
    digits = int(np.clip(1 - math.floor(math.log10(error)), 0, 9))
    return f"{value:>10.{digits}f} +- {error:.{digits}f}"


def _compared(c: Any, units: dict[str, str]) -> list[str]:
    lines = ["", f"{'':<12}{'measured':>12}{'predicted':>24}"]
    for name, *x in zip(
        COMPARED, c.measured, c.measured_error, c.predicted, c.predicted_error
    ):
        apart = abs(x[0] - x[2]) / math.hypot(x[1], x[3])
        said = "they agree" if apart <= 1 else "they differ"
        lines.append(
            f"  {name:<10}{pair(x[0], x[1]):<23} "
            + with_unit(f"{pair(x[2], x[3]):<20}", units[name]).rstrip()
            + f": {said}"
        )
    return [*lines, *map(closing_line, c.closing)]


def closing_line(x: Closing) -> str:
    """Return which value of a parameter gives the measured distance."""
    scale, unit = (180 / math.pi, "deg") if x.unit == "rad" else (1.0, x.unit)
    present = f"{x.name} = " + with_unit(f"{x.present * scale:.4g}", unit)
    if not math.isfinite(x.value):
        low, high = (float(f"{v * scale:.3g}") for v in (x.low, x.high))
        tried = with_unit(f"{low:g} to {high:g}", unit)
        return f"{present}: none from {tried} gives the measured distance"
    value = with_unit(pair(x.value * scale, x.error * scale).strip(), unit)
    return f"{present}: {value} gives the measured distance"
