"""Every key of the tables of an intruder scene, as `geomech.scene.keys` has those of scenes with a gait."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

from geomech.scene.intruder import COEFFICIENTS, MOTIONS, SHAPES, VERTICAL, IntruderScene, StressMap, _Choices
from geomech.scene.key import Key, first, keys_of, option, table

NAMED = f"{', '.join(VERTICAL)}; 'geomech scenes --show NAME' prints one"
MEDIUM = "Give one of name, file and all nine coefficients, or zeta alone, which is that of the generic set."
DRAGS = "TOML with such a table, or CSV of plate drags with the header beta,gamma,alpha_x,alpha_z (degrees, N/cm^3)"
ELEMENTS = "of the outline, about, 1 to 5000; the error is of order 2 in their number, 1 with tension cut"
POINTS = "CSV with the header x,z (m), in place of points"
COURSE = (
    "CSV with the header t,x,z or t,x,z,angle (s, m, rad); velocities are differences of order 2 in the spacing of t"
)


class Part(NamedTuple):
    """A table. kind: what it names itself by, if anything."""

    title: str
    about: str
    keys: list[Key]
    kind: str = ""


def sections() -> dict[str, list[Part]]:
    """Of every table of an intruder scene what it may be."""
    strength = [_text("name", NAMED), _text("file", DRAGS)]
    count = next(f.default for f in dataclasses.fields(IntruderScene) if f.name == "elements")
    elements = [Key("elements", {"type": "integer"}, "-", ELEMENTS, False, count, False)]
    return {
        "medium": [Part("[medium] of an intruder scene", MEDIUM, [*strength, *_coefficients(), *keys_of(_Choices)])],
        "intruder": [_part("intruder", kind, body) for kind, body in SHAPES.items()],
        "motion": [_part("motion", kind, motion) for kind, motion in MOTIONS.items()],
        "numerics": [Part("[numerics] of an intruder scene", "", elements)],
    }


def _part(section: str, kind: str, made: type) -> Part:
    keys = keys_of(made)
    if kind == "csv":  # its columns are its fields
        keys = [_text("file", COURSE, required=True)]
    elif "points" in (k.name for k in keys):
        keys = [_text("file", POINTS), *keys]
    return Part(f'[{section}] kind = "{kind}"', first(made), keys, kind)


def _text(name: str, meaning: str, required: bool = False) -> Key:
    return Key(name, {"type": "string"}, "-", meaning, required, None, False)


def _coefficients() -> list[Key]:
    """The nine, none with a default of its own, under the names of the paper; those of `StressMap` do as well."""
    theirs = {k.name: k._replace(default=None) for k in keys_of(StressMap)}
    return [theirs[name]._replace(name=_written(name)) for name in COEFFICIENTS]


def _written(name: str) -> str:
    return name.replace("m", "-")


def schemas() -> dict[str, Any]:
    """JSON Schema of every table."""
    made = sections()
    return {
        "medium": _medium(made["medium"][0]),
        **{name: {"oneOf": [_schema(part) for part in made[name]]} for name in ("intruder", "motion")},
        "numerics": table("", option("", "", "", made["numerics"][0].keys)["properties"], []),
    }


def _schema(part: Part) -> dict[str, Any]:
    both = {"points", "file"} <= {k.name for k in part.keys}
    keys = [k._replace(required=k.required and not (both and k.name == "points")) for k in part.keys]
    made = option(part.about, "kind", part.kind, keys)
    return {**made, "oneOf": [{"required": ["points"]}, {"required": ["file"]}]} if both else made


def _medium(part: Part) -> dict[str, Any]:
    made = option(part.about, "", "", part.keys)
    values = {**made["properties"], "name": {**made["properties"]["name"], "enum": [*VERTICAL]}}
    values |= {name: values[_written(name)] for name in COEFFICIENTS}
    either = [{"oneOf": [{"required": [x]} for x in sorted({name, _written(name)})]} for name in COEFFICIENTS]
    nine = {*COEFFICIENTS, *map(_written, COEFFICIENTS)}
    ways = [
        {"required": ["name"], **_none_of({"file", *nine})},
        {"required": ["file"], **_none_of({"name", *nine})},
        {"allOf": either, **_none_of({"name", "file"})},
        _none_of({"name", "file", *nine}),
    ]
    return {**made, "properties": values, "oneOf": ways}


def _none_of(names: set[str]) -> dict[str, Any]:
    return {"not": {"anyOf": [{"required": [name]} for name in sorted(names)]}}
