"""Results in another unit of length, for pictures."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result, Unit, Variable
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.results.scenes import scene_of
from rft.core.refusal import Refusal

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}  # of a unit
BODY_LENGTH = "BL"
UNITS = (*METRES, BODY_LENGTH)
LENGTHS = ("body_length",)  # attributes that are lengths
FACTS = ("shown_unit", "shown_factor")  # attributes of a result in another unit


def length_factor(scene: Any, unit: str) -> float:
    """Return the factor from lengths in the results of a scene to lengths in a unit;
    Refusal for a unit that the scene's lengths cannot have.

    Examples
    --------
    >>> import geomech
    >>> from geomech.results.lengths import length_factor
    >>> length_factor(geomech.load("shovel-nosed-snake"), "BL")
    1.0
    """
    choose("``unit``", unit, UNITS)
    own = own_unit(scene)
    if unit == own:
        return 1.0
    if own == "m" and unit in METRES:
        return 1.0 / METRES[unit]
    if own == "m" and hasattr(scene, "system"):
        return 1.0 / body_size(scene.system)
    if own == "m":
        raise Refusal(
            "a robot has no body length",
            where="``unit``",
            value=unit,
            instead=f"give one of {', '.join(METRES)}",
        )
    if own == BODY_LENGTH:
        raise Refusal(
            f"lengths of {scene.name} are in body lengths",
            where="``unit``",
            value=unit,
            instead="give its [body] a length in m, such as length = 0.15, or unit BL",
        )
    raise Refusal(
        f"lengths of {scene.name} are in {own}",
        where="``unit``",
        value=unit,
        instead="leave ``unit`` out",
    )


def own_unit(scene: Any) -> str:
    """Return the unit of lengths in the results of a scene."""
    if hasattr(scene, "system"):
        return length_unit(scene.system)
    return "m"


def in_lengths(result: Result, unit: str) -> Result:
    """Return a result whose lengths are in a unit: "m", "cm", "mm" or "BL".

    Examples
    --------
    >>> import geomech
    >>> from geomech.results.lengths import in_lengths
    >>> chain = geomech.bodies.Chain((1, 1, 1), length=0.15)
    >>> circle = geomech.gaits.Circle(1.0)
    >>> study = geomech.study(geomech.media.Viscous(2.0), chain, circle)
    >>> moved = in_lengths(study.displacement(tiers="direct"), "cm")
    >>> moved["x"].unit, moved["x"].values.round(2).tolist()
    ('cm', [[-0.77]])
    """
    scene = scene_of(result)
    factor = length_factor(scene, unit)
    own = own_unit(scene)
    variables = [converted(v, own, unit, factor) for v in result.variables]
    facts = dict(result.attributes)
    for name in LENGTHS:
        if name in facts:
            facts[name] = factor * facts[name]
    if "length_unit" in facts:
        facts["length_unit"] = unit
    facts |= {"shown_unit": unit, "shown_factor": factor}
    return replace(result, variables=tuple(variables), attributes=facts)


def shown_lengths(result: Result) -> tuple[str, float]:
    """Return the unit of lengths in a result, and its factor to the scene's."""
    facts = result.attributes
    if "shown_unit" in facts:
        return facts["shown_unit"], float(facts["shown_factor"])
    return own_unit(scene_of(result)), 1.0


def converted(variable: Variable, own: str, unit: str, factor: float) -> Variable:
    """Return a variable with its lengths in another unit.

    own: unit of lengths in the variable's unit, such as m in m/s."""
    parts: Unit = variable.unit
    if isinstance(parts, str):
        shown = unit_with(parts, own, unit)
        if shown == parts:
            return variable
        return variable.with_arrays(lambda x: factor * x, unit=shown)
    shown_parts = tuple(unit_with(part, own, unit) for part in parts)
    if shown_parts == parts:
        return variable
    changes = np.array([a != b for a, b in zip(shown_parts, parts)])
    factors = np.where(changes, factor, 1.0)
    shape = (-1, *[1] * (variable.values.ndim - 1))
    return variable.with_arrays(lambda x: factors.reshape(shape) * x, unit=shown_parts)


def unit_with(text: str, own: str, unit: str) -> str:
    """Return a unit such as m, m/s or m/rad2 with another unit of length; any other as
    it is."""
    match = re.fullmatch(rf"{re.escape(own)}(/(?:s|rad|rad2))?", text)
    if match is None:
        return text
    return unit + (match[1] or "")
