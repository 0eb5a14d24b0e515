"""Results in another unit of length, for pictures and for printing."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result, Unit, Variable
from geomech.results.kinds import kind_of
from geomech.results.length_units import UNITS, own_unit
from geomech.results.scenes import scene_of

LENGTHS = ("body_length",)  # attributes that are lengths
# A unit of products and at most one quotient, such as drag x BL/rad.
PLAIN = re.compile(r"[\w^]+((?: x | )[\w^]+)*(/[\w^]+((?: x | )[\w^]+)*)?")
# The units of x and y, and of theta, of a variable over components.
BY_COMPONENT = re.compile(r"(\S+) \(x, y\), (\S+) \(theta\)(.*)")
FACTS = ("shown_unit", "shown_factor")  # attributes of a result in another unit


def in_lengths(result: Result, unit: str) -> Result:
    """Return a result whose lengths are in a unit: "m", "cm", "mm" or "BL".

    Its kind has the units of its lengths (`Plain.lengths`).

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
    choose("``unit``", unit, UNITS)
    lengths = kind_of(result).lengths(result)
    name = result.attributes.get("scene") or result.attributes.get("file", "the result")
    factors = {own: lengths.factor(own, unit, name) for own in lengths.metres}
    variables = []
    for variable in result.variables:
        if variable.name not in lengths.kept:
            for own, factor in factors.items():
                if own != unit:
                    variable = converted(variable, own, unit, factor)
        variables.append(variable)
    facts = dict(result.attributes)
    own = facts.get("length_unit", next(iter(factors)))
    for each in LENGTHS:
        if each in facts and own in factors:
            facts[each] = factors[own] * facts[each]
    if "length_unit" in facts:
        facts["length_unit"] = unit
    facts |= {"shown_unit": unit, "shown_factor": next(iter(factors.values()))}
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
        by_component = BY_COMPONENT.fullmatch(parts)
        if by_component is not None and "component" in variable.dims:
            return _converted_components(variable, by_component, own, unit, factor)
        shown, power = unit_with(parts, own, unit)
        if not power:
            return variable
        return variable.with_arrays(lambda x: factor**power * x, unit=shown)
    shown_parts, powers = zip(*(unit_with(part, own, unit) for part in parts))
    if not any(powers):
        return variable
    return _scaled(variable, 0, factor, powers, shown_parts)


def _converted_components(
    variable: Variable, units: re.Match, own: str, unit: str, factor: float
) -> Variable:
    """Return a variable over components x, y and theta, such as rows of A, with the
    lengths of x and y in another unit."""
    position, position_power = unit_with(units[1], own, unit)
    heading, heading_power = unit_with(units[2], own, unit)
    powers = (position_power, position_power, heading_power)
    shown = f"{position} (x, y), {heading} (theta){units[3]}"
    axis = variable.dims.index("component")
    return _scaled(variable, axis, factor, powers, shown)


def _scaled(
    variable: Variable, axis: int, factor: float, powers: Sequence[int], unit: Unit
) -> Variable:
    """Return a variable times powers of a factor, one for each place of an axis."""
    shape = [1] * variable.values.ndim
    shape[axis] = -1
    factors = (factor ** np.array(powers, float)).reshape(shape)
    return variable.with_arrays(lambda x: factors * x, unit=unit)


def unit_with(text: str, own: str, unit: str) -> tuple[str, int]:
    """Return a unit such as m, m/s, N/m or N m with another unit of length, and the
    power of lengths in it; any other as it is, with 0.

    Examples
    --------
    >>> from geomech.results.lengths import unit_with
    >>> unit_with("drag/BL", "BL", "cm"), unit_with("m/rad2", "m", "mm")
    (('drag/cm', -1), ('mm/rad2', 1))
    """
    if not PLAIN.fullmatch(text):
        return text, 0
    numerator, slash, denominator = text.partition("/")
    above = re.split(r"( x | )", numerator)
    below = re.split(r"( x | )", denominator)
    power = above.count(own) - below.count(own)
    if not power:
        return text, 0
    shown = ["".join(unit if x == own else x for x in part) for part in (above, below)]
    return slash.join(shown) if slash else shown[0], power
