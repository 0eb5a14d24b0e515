"""Every key of the tables of an intruder scene, of outlines or of meshes, as `geomech.scene.keys` has those of scenes with a
gait."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

from geomech.scene import solid
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
OF_MESHES = "of an intruder scene of a mesh"
STRENGTH = "Give one of name, file (either with zeta, if wanted), xi_n, and density with internal_friction."
SOLID_DRAGS = DRAGS.replace("such a table", "a table [medium] of the vertical plane")
ZETA = "times the strength of the name or file"
SOLID_COURSE = COURSE.replace("t,x,z or t,x,z,angle", "t,x,y,z or t,x,y,z,rx,ry,rz (rotation vector)")
TRIANGLES = "of the mesh, about, 1 to 2,000,000; a mesh from a file has at least its own"
DENSITY = "critical density of the grains, 1 to 1e5; with internal_friction, in place of xi_n"
FRICTION = "mu, tan of the angle of repose of the grains, 0.05 to 1.5; with density, in place of xi_n"
INTRUDED = ["medium", "intruder", "motion"]


class Part(NamedTuple):
    """A table. named: what it names itself by, if anything, such as {"kind": "plate"}."""

    title: str
    about: str
    keys: list[Key]
    named: dict[str, str] = {}


def sections() -> dict[str, list[Part]]:
    """Of every table of an intruder scene what it may be."""
    theirs, others = outlines(), meshes()
    effects = {
        "effects": [_part("effects", kind, effect, " of an intruder scene") for kind, effect in solid.EFFECTS.items()]
    }
    return {name: theirs[name] + others[name] for name in theirs} | effects


def outlines() -> dict[str, list[Part]]:
    """Of the tables of scenes of outlines."""
    strength = [_text("name", NAMED), _text("file", DRAGS)]
    return {
        "medium": [Part("[medium] of an intruder scene", MEDIUM, [*strength, *_coefficients(), *keys_of(_Choices)])],
        "intruder": [_part("intruder", kind, body) for kind, body in SHAPES.items()],
        "motion": [_part("motion", kind, motion) for kind, motion in MOTIONS.items()],
        "numerics": [Part("[numerics] of an intruder scene", "", [_count(IntruderScene, "elements", ELEMENTS)])],
    }


def meshes() -> dict[str, list[Part]]:
    """Of the tables of scenes of meshes."""
    (zeta,) = (k for k in keys_of(_Choices) if k.name == "zeta")
    xi_n, *rest = keys_of(solid.Spatial)
    grains = [_number("density", "kg/m^3", DENSITY), _number("internal_friction", "-", FRICTION)]
    by_name = [_text("name", NAMED), _text("file", SOLID_DRAGS), zeta._replace(meaning=ZETA)]
    shapes = [_part("intruder", kind, body) for kind, body in solid.KINDS.items()]
    shapes += [_part("intruder", "mesh", body, shape=shape) for shape, body in solid.SOLIDS.items()]
    return {
        "medium": [Part(f"[medium] {OF_MESHES}", STRENGTH, [*by_name, xi_n._replace(required=False), *grains, *rest])],
        "intruder": shapes,
        "motion": [_part("motion", kind, motion, " of a mesh") for kind, motion in solid.MOTIONS.items()],
        "numerics": [Part(f"[numerics] {OF_MESHES}", "", [_count(solid.MeshScene, "triangles", TRIANGLES)])],
    }


def _part(section: str, kind: str, made: type, of: str = "", **more: str) -> Part:
    keys = keys_of(made)
    if kind == "csv":  # its columns are its fields
        keys = [_text("file", SOLID_COURSE if of else COURSE, required=True)]
    elif "points" in (k.name for k in keys):
        keys = [_text("file", POINTS), *keys]
    named = {"kind": kind, **more}
    told = ", ".join(f'{key} = "{name}"' for key, name in named.items())
    head = f"[[{section}]]" if section == "effects" else f"[{section}]"
    return Part(f"{head} {told}{of}", first(made), keys, named)


def _text(name: str, meaning: str, required: bool = False) -> Key:
    return Key(name, {"type": "string"}, "-", meaning, required, None, False)


def _number(name: str, unit: str, meaning: str) -> Key:
    return Key(name, {"type": "number"}, unit, meaning, False, None, False)


def _count(scene: type, name: str, meaning: str) -> Key:
    count = next(f.default for f in dataclasses.fields(scene) if f.name == name)
    return Key(name, {"type": "integer"}, "-", meaning, False, count, False)


def _coefficients() -> list[Key]:
    """The nine, none with a default of its own, under the names of the paper; those of `StressMap` do as well."""
    theirs = {k.name: k._replace(default=None) for k in keys_of(StressMap)}
    return [theirs[name]._replace(name=_written(name)) for name in COEFFICIENTS]


def _written(name: str) -> str:
    return name.replace("m", "-")


def schemas() -> dict[str, dict[str, Any]]:
    """JSON Schema of every table, of scenes of outlines and of those of meshes."""
    effects = {"type": "array", "items": {"oneOf": [_schema(part) for part in sections()["effects"]]}}
    made = {}
    for group, parts, medium in (("outlines", outlines(), _medium), ("meshes", meshes(), _solid_medium)):
        made[group] = {
            "medium": medium(parts["medium"][0]),
            **{name: {"oneOf": [_schema(part) for part in parts[name]]} for name in ("intruder", "motion")},
            "numerics": table("", option("", "", "", parts["numerics"][0].keys)["properties"], []),
            "effects": effects,
        }
    return made


def whole(tables: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """JSON Schema of an intruder scene of such tables: the kind of the body says of which."""
    solids = {"required": ["kind"], "properties": {"kind": {"enum": [*solid.KINDS]}}}
    return {
        "if": {"required": ["intruder"], "properties": {"intruder": solids}},
        "then": table("", tables["meshes"], INTRUDED),
        "else": table("", tables["outlines"], INTRUDED),
    }


def _schema(part: Part) -> dict[str, Any]:
    both = {"points", "file"} <= {k.name for k in part.keys}
    keys = [k._replace(required=k.required and not (both and k.name == "points")) for k in part.keys]
    (kind, name), *more = part.named.items()
    made = option(part.about, kind, name, keys)
    for other, value in more:
        made["properties"][other] = {"const": value}
        made["required"].append(other)
    return {**made, "oneOf": [{"required": ["points"]}, {"required": ["file"]}]} if both else made


def _solid_medium(part: Part) -> dict[str, Any]:
    made = option(part.about, "", "", part.keys)
    made["properties"]["name"]["enum"] = [*VERTICAL]
    strengths = {*solid.STRENGTHS}
    ways = [({"name"}, {"zeta"}), ({"file"}, {"zeta"}), ({"xi_n"}, set()), ({"density", "internal_friction"}, set())]
    return made | {"oneOf": [{"required": sorted(a), **_none_of(strengths - a - more)} for a, more in ways]}


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
