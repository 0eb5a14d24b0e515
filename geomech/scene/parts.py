"""Parts of a scene from the tables of its TOML: a class by its name, and its fields from keys."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Mapping

import msgspec

from geomech.core.errors import SceneError, UnitWarning, choose
from geomech.scene import slips
from geomech.scene.kinds import choose_kind

LARGEST = 10_000_000  # bytes of a scene file


def kind_in(place: str, table: dict, key: str, kinds: Mapping[str, type]) -> str:
    """Return the name of the kind that a table has under a key; SceneError if there is none, or none of that name."""
    if key not in table:
        raise SceneError(f"{place} has no {key!r}: add {key} = one of {', '.join(kinds)}")
    return choose_kind(f"{place} {key}", table[key], kinds)


def build_kind(place: str, table: dict, key: str, kinds: Mapping[str, type], fill=lambda place, table, kind: table):
    """Return the part of the kind that a table names, from its other keys as ``fill`` completes them."""
    kind = kinds[kind_in(place, table, key, kinds)]
    return build(place, fill(place, {k: v for k, v in table.items() if k != key}, kind), kind)


def build(place: str, table: dict, kind: type):
    """Return a dataclass from a table: keys are its fields, one of its ``angles`` may be ``x_deg``; else SceneError."""
    names = [f.name for f in dataclasses.fields(kind)]
    values = {}
    for key, value in table.items():
        in_degrees = key.endswith("_deg") and key.removesuffix("_deg") in getattr(kind, "angles", ())
        field = choose(f"{place} key", key.removesuffix("_deg") if in_degrees else key, names)
        if field in values:
            raise SceneError(f"{place}: {field} is given twice: keep one of {field} and {field}_deg")
        values[field] = _radians(value) if in_degrees else value
        if key == "gamma0_deg":
            _check_degrees(f"{place} {key}", value)
    try:
        return msgspec.convert(values, kind)
    except (ValueError, OverflowError) as error:
        told = str(error).replace(" - at `$", " - at `").replace(" - at ``", "")
        cure = slips.of_value(told, table, getattr(kind, "angles", ()))
        raise SceneError(f"{place} {told}{cure}") from None


def _check_degrees(place: str, value) -> None:
    """UnitWarning for an angle of grains below a degree: measured ones are of ten to twenty."""
    if isinstance(value, (int, float)) and 0 < value < 1:
        told = f"{place} = {value:g} is less than a degree: if that is in rad, write gamma0 = {value:g}"
        warnings.warn(told, UnitWarning, stacklevel=2)


def _radians(degrees):
    """Numbers, and numbers in lists, from degrees; anything else as it is, to be refused for what it is."""
    if isinstance(degrees, list):
        return [_radians(x) for x in degrees]
    if isinstance(degrees, (int, float)) and not isinstance(degrees, bool) and abs(degrees) < 1e300:
        return math.radians(degrees)
    return degrees
