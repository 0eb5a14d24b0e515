"""Forces along a body, in lines and as JSON has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.studies.forces import PARTS
from geomech.systems.base import length_unit
from rft.refusal import in_line

PLACES = (0.25, 0.5, 0.75)  # of the body, at which the lag of activation is printed


def numbers(result: Result) -> dict[str, Any]:
    """Return all variables by name, None for nan, with errors and units."""
    values = {
        v.name: np.where(np.isfinite(v.values), v.values, None).tolist()
        for v in result.variables
    }
    errors = {v.name: v.error.tolist() for v in result.variables if v.error is not None}
    return {
        **result.attributes,
        **values,
        "errors": errors,
        "units": {v.name: v.unit for v in result.variables},
    }


def text(result: Result) -> str:
    """Return means over the cycle of thrust and drag by their parts, power, bending moment and activation."""
    rows = [
        (name, [_mean(result[f"{kind}_{name}"]) for kind in ("thrust", "drag")])
        for name in PARTS
    ]
    rows.append(
        ("sum", [tuple(map(sum, zip(*(row[k] for _, row in rows)))) for k in (0, 1)])
    )
    unit = f"mean of a cycle, {result['thrust_normal'].unit}:"
    return "\n".join([
        _travel(result),
        f"{unit:<22} {'thrust +- error':>20} {'drag +- error':>20}",
        *(f"{name:>22} {' '.join(f'{_digits(*pair):>20}' for pair in row)}" for name, row in rows),
        _power(result),
        _moment(result),
        _activation(result),
        _unit(result),
    ])  # fmt: skip


def _mean(v: Variable) -> tuple[float, float]:
    """Return the mean of a variable and that of its error."""
    return float(v.values.mean()), 0.0 if v.error is None else float(v.error.mean())


def _digits(x: float, error: float) -> str:
    return f"{x:.4g} +-{error:.0e}" if abs(x) + error >= 1e-9 else "0"


def _travel(result: Result) -> str:
    run, name = result.subject, in_line(result.attributes["name"])
    if not run.travels:
        return f"{name}: no net displacement; forwards is where the frame points to at phase 0"
    distance, angle = np.hypot(*run.net[:2]), np.degrees(run.direction)
    unit = length_unit(run.scene.system)
    return f"{name}: {distance:.4g} {unit} per cycle, {angle:.1f} degrees from the frame's heading at phase 0"


def _power(result: Result) -> str:
    medium, joints = (result[f"{name}_power"] for name in ("medium", "joint"))
    most = np.abs(medium.values).max() or 1.0
    difference = np.abs(medium.values - joints.values).max() / most
    same = (
        "at the joints the same"
        if difference < 1e-6
        else f"at the joints {joints.values.mean():.4g} {joints.unit}"
    )
    return f"power {_digits(*_mean(medium))} {medium.unit} into the medium, largest {medium.values.max():.4g}; {same}"


def _moment(result: Result) -> str:
    moment = result["bending_moment"]
    phase, point = np.unravel_index(np.abs(moment.values).argmax(), moment.values.shape)
    s, t = result["point"].values[point], result["phase"].values[phase]
    size = abs(moment.values[phase, point])
    return f"largest bending moment {size:.4g} {moment.unit}, at s = {s:.3g} (head 1) and phase {t:.3g} rad"


def _activation(result: Result) -> str:
    joint, lag, ratio = (
        result[name].values
        for name in ("joint", "fundamental_lag", "fundamental_speed_ratio")
    )
    if len(joint) < 2:
        return f"activation ahead of bending by {float(lag[0]):.3g} rad"
    places = joint if len(joint) <= len(PLACES) else np.array(PLACES)
    ahead = ", ".join(f"{x:.3g}" for x in np.interp(places, joint, lag))
    at = ", ".join(f"{x:.3g}" for x in places)
    speed = (
        f"; its wave runs {float(ratio):.3g} times as fast as that of curvature"
        if np.isfinite(ratio)
        else ""
    )
    return f"activation ahead of bending by {ahead} rad at s = {at}{speed}"


def _unit(result: Result) -> str:
    newtons = result.subject.newtons
    if newtons.drag is None:
        return f"unit: drag of the straight body along itself; give {', '.join(newtons.lacks)} for newtons"
    seconds = "" if newtons.frequency else "; give frequency for watts"
    return f"drag of the straight body along itself {newtons.drag:.4g} N, {newtons.how}{seconds}"
