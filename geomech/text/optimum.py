"""The best gait of a scene, in lines and as a scene file."""

from __future__ import annotations

import textwrap
from typing import Any

from geomech.core.summary import moved
from geomech.core.variables import Result
from geomech.optimisation import Optimum
from geomech.scenes.write import gait_table, toml
from geomech.systems.base import body_size
from rft.refusal import in_line

SHOWN = 6  # answers that a table led to, of those that nobody finished


def numbers(result: Result) -> dict[str, Any]:
    """Return the best gait as JSON has it; a path length or work that does not exist is None."""
    optimum, value, number = (
        result.subject,
        result["value"],
        lambda name: float(result[name].values),
    )
    unit = result["x"].unit
    return {
        "objective": value.label,
        "value": number("value"),
        "start_value": number("start_value"),
        "displacement": [number(name) for name in ("x", "y", "theta")],
        **{
            name: number(name) if name in result else None
            for name in ("path_length", "work")
        },
        "gait": gait_table(optimum.gait),
        "evaluations": optimum.evaluations,
        "seconds": optimum.seconds,
        "active": list(optimum.active),
        "answers": [list(x) for x in optimum.answers + optimum.others],
        "estimate": float(value.error),
        "body_length": float(body_size(optimum.scene.system)),
        "zero_by_symmetry": result.attributes["zero_by_symmetry"],
        "units": {
            **dict.fromkeys(("value", "start_value", "estimate"), value.unit),
            "displacement": [unit, unit, "rad"],
            **{
                name: result[name].unit
                for name in ("path_length", "work")
                if name in result
            },
            "body_length": unit,
            "seconds": "s",
        },
    }


def text(result: Result) -> str:
    """Return the best gait in lines: its value, its effort, the limits that it touches, and where the starts led."""
    optimum, value, start = result.subject, result["value"], result["start_value"]
    objective = optimum.request.objective
    pose, zero = (
        (result["x"], result["y"], result["theta"]),
        result.attributes["zero_by_symmetry"],
    )
    lines = [
        _headline(result),
        f"the scene's gait: {round(float(start.values), 12) + 0.0:.6g} {start.unit}",
    ]
    lines += [
        f"displacement per cycle: {moved([(v.values, v.unit) for v in pose], zero)}"
    ]
    efforts = [result[name] for name in ("path_length", "work") if name in result]
    spent = ", ".join(
        f"{v.name.replace('_', ' ')} {v.values:.6g} {v.unit}" for v in efforts
    )
    lines += [f"effort per cycle: {spent}"] * bool(spent)
    if objective.timed:
        limits = {
            "rate": objective.rate
            and f"rates of shape up to {objective.rate:.6g} rad/s",
            "power": objective.power
            and f"mean power up to {objective.power:g} drag x BL/s",
        }
        limited = " and ".join(filter(None, limits.values()))
        lines.append(f"frequency {optimum.gait.frequency:.6g} Hz, with {limited}")
    lines.append(f"limits touched: {', '.join(optimum.active) or 'none'}")
    if optimum.request.starts > 1:
        lines += _answers(optimum)
    if value.values <= start.values * (1 + 1e-12):
        lines.append("nothing better than the scene's own gait was found")
    return "\n".join(
        [*lines, f"{optimum.evaluations} cycles evaluated in {optimum.seconds:.2g} s"]
    )


def _headline(result: Result) -> str:
    """Return the value with its error."""
    optimum, value = result.subject, result["value"]
    towards = (
        f" along {optimum.request.objective.direction}"
        if optimum.request.objective.direction
        else ""
    )
    return f"{in_line(optimum.scene.name)}: {value.label}{towards} {value.values:.6g} {value.unit}, error {value.error:.1g}"


def _answers(optimum: Optimum) -> list[str]:
    """Return the values that the starts led to."""
    listed = lambda answers: ", ".join(
        f"{value:.6g} (from {count})" for value, count in answers
    )
    led = (
        sum(count for _, count in optimum.answers + optimum.others)
        - optimum.request.starts
    )
    more = f", and {led} that narrower limits led to" if led > 0 else ""
    lines = [
        f"{optimum.request.starts} starts{more}, answers that differ: {listed(optimum.answers)}"
    ]
    if optimum.others:
        rest = len(optimum.others) - SHOWN
        more = (
            f" and {rest} more, down to {optimum.others[-1][0]:.6g}" if rest > 0 else ""
        )
        lines.append(
            f"and by a table alone, less: {listed(optimum.others[:SHOWN])}{more}"
        )
    return lines


def scene_toml(result: Result) -> str:
    """Return the scene with the best gait, behind a comment with its value."""
    start = result["start_value"]
    about = textwrap.wrap(
        f"{_headline(result)} (the scene's gait: {start.values:.6g})", 110
    )
    return "".join(f"# {line}\n" for line in about) + "\n" + toml(result.subject.scene)
