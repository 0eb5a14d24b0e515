"""Files from before results had one vocabulary: their variables under current names.

A current file names its format (`geomech.io.results.FORMAT`); one without it passes
through `translated`.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from geomech.core.variables import POSE, Variable

UNITS = {"body length": "BL"}  # of lengths, as old files name them
NAMES = {"length": "body_length", "aside": "lateral_speed", "turning": "yaw_rate"}
ERRORS = {  # names of errors, by the variable whose error they are
    "speed": "estimate",
    "lateral_speed": "estimate_aside",
    "yaw_rate": "estimate_turning",
}
# Units of x and y, and of theta, such as "m rad-1 (x, y), rad rad-1 (theta)".
BY_COMPONENT = re.compile(r"(.+) \(x, y\), (.+) \(theta\)")
POWERS = {" rad-1": "/rad", " rad-2": "/rad2", " s-1": "/s"}


def translated(variables: list[Variable]) -> list[Variable]:
    """Return the variables of an old file under their current names."""
    by_name = {v.name: renamed(v) for v in variables}
    if {"displacement", "estimate", "estimate_heading"} <= {*by_name}:
        return displacement_variables(by_name)
    if {"A", "speed"} <= {*by_name}:
        by_name["speed"] = replace(by_name["speed"], name="xi_rms")
        return list(by_name.values())
    if {"speed", "estimate"} <= {*by_name}:
        return walk_variables(by_name)
    return list(by_name.values())


def renamed(variable: Variable) -> Variable:
    """Return a variable with its current name and unit."""
    name = NAMES.get(variable.name, variable.name)
    found = BY_COMPONENT.fullmatch(variable.units)
    if found and variable.dims[:1] == ("component",):
        lengths, angles = map(current_unit, found.groups())
        return replace(variable, name=name, unit=(lengths, lengths, angles))
    return replace(variable, name=name, unit=current_unit(variable.units))


def current_unit(unit: str) -> str:
    """Return a unit of an old file in its current spelling."""
    for old, new in {**UNITS, **POWERS}.items():
        unit = unit.replace(old, new)
    return unit


def displacement_variables(by_name: dict[str, Variable]) -> list[Variable]:
    """Return x, y, heading and the net distance of poses (..., component), with their
    errors, and all else."""
    poses = by_name.pop("displacement")
    error = by_name.pop("estimate")
    heading_error = by_name.pop("estimate_heading")
    by_name.pop("component", None)
    found = []
    for k, name in enumerate(POSE):
        bound = heading_error if name == "heading" else error
        found.append(per_cycle(name, poses.values[..., k], bound))
    distance = np.hypot(poses.values[..., 0], poses.values[..., 1])
    found.append(per_cycle("net_distance", distance, error))
    return [*found, *by_name.values()]


def per_cycle(name: str, values: np.ndarray, error: Variable) -> Variable:
    label = f"{name.replace('_', ' ')} per cycle"
    return Variable(name, error.dims, values, error.unit, label, error.values)


def walk_variables(by_name: dict[str, Variable]) -> list[Variable]:
    """Return speeds of robots with their errors, and all else; a status that is a
    number as the word that its label has for it."""
    for name, error in ERRORS.items():
        if name in by_name and error in by_name:
            values = by_name.pop(error).values
            by_name[name] = replace(by_name[name], error=values)
    status = by_name.get("status")
    if status is not None and not status.is_text:
        meanings = [one.partition(": ")[2] for one in status.label.split(", ")]
        words = np.array(meanings)[status.values.astype(int)]
        by_name["status"] = replace(status, values=words, unit="", label="")
    return list(by_name.values())
