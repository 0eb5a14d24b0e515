"""Every key of a scene file, from the classes that read it: as text to read, and as a JSON Schema for editors.

What a class says of its keys is in `geomech.scene.key`; tables of intruder scenes are in `geomech.scene.intruder_keys`,
those of walking robots in `geomech.scene.walker_keys`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from geomech.core.errors import choose
from geomech.scene import intruder_keys, walker_keys
from geomech.scene.key import Key, first, keys_of, meanings, option, properties, table, told
from geomech.scene.kinds import FAMILIES, unloaded
from geomech.scene.model import Numerics
from geomech.scene.read import TABLES
from geomech.scene.sizes import NOT_OF_THE_BODY, Physical
from geomech.systems.swimmer import MEDIA, Swimmer

GROUPS = {
    "medium": "media",
    "body": "bodies",
    "gait": "gaits",
    "effects": "effects",
    "system": "systems",
}  # of FAMILIES
FRAME = (
    "of all velocities and displacements, in place of the body's own key; 'minimum-perturbation', here or there: the one in "
    "which the connection is smallest"
)
FILE = (
    "TOML of a medium, as geomech calibrate writes it, with no key beside it; or, beside law = 'table', CSV of a table"
)
SWIMMER = "A body in a medium: its tables [medium], [body] and [[effects]] may as well be in it as stand by themselves."
__all__ = ["Key", "keys_of", "meanings", "names", "schema", "sections", "text"]


def sections() -> dict[str, list[tuple[str, str, type]]]:
    """Of every table: (key that names the class, its name, the class), with "" for tables of one class."""
    made: dict[str, list[tuple[str, str, type]]] = {}
    for section, group in GROUPS.items():
        family = FAMILIES[f"geomech.{group}"]
        made[section] = [(family.key, name, kind) for name, kind in family.kinds.items() if kind is not Swimmer]
    solvers = {type(k.solver): None for _, _, k in [*made["system"], ("", "", Swimmer)] if getattr(k, "solver", None)}
    made["numerics"] = [("", "", kind) for kind in (Numerics, *solvers)]
    made["physical"] = [("", "", Physical)]
    return {name: made[name] for name in TABLES if name in made}


def names() -> list[str]:
    """Of the tables, those of scenes with a gait first."""
    return list(dict.fromkeys(["frame", *sections(), *intruder_keys.sections(), *walker_keys.sections()]))


def text(section: str | None = None) -> str:
    """All keys, or those of one section, to be read."""
    every, theirs = sections(), (intruder_keys.sections(), walker_keys.sections())
    chosen = [choose("SECTION", section, names())] if section is not None else names()
    of_gaits = [x for name in chosen if name in every or name == "frame" for x in _told(name, every)]
    others = [told(*part[:3]) for of in theirs for name in chosen for part in of.get(name, ())]
    return "\n\n".join([*of_gaits, *others]) + "\n"


def _told(section: str, every: dict) -> Iterator[str]:
    words = {"type": "string"}
    if section == "frame":
        yield told("above all tables", "", [Key("frame", words, "-", FRAME, False, "mean", False)])
        return
    if section == "medium":
        meaning = f"a medium of the catalogue: {', '.join(MEDIA)}; 'geomech scenes --show NAME' prints one"
        yield told("[medium]", "By name, with no key beside it.", [Key("name", words, "-", meaning, True, None, False)])
        yield told("[medium]", "From a file.", [Key("file", words, "-", FILE, True, None, False)])
    for key, name, kind in every[section]:
        head = f"[[{section}]]" if section == "effects" else f"[{section}]"
        yield told(f'{head} {key} = "{name}"' if key else head, first(kind), keys_of(kind))
    if section in GROUPS:
        yield from _of_packages(f"geomech.{GROUPS[section]}", every[section][0][0])
    if section == "system":
        yield told('[system] kind = "swimmer"', SWIMMER, [])


def _of_packages(group: str, key: str) -> Iterator[str]:
    new, refused = unloaded(group)
    for name, package in new.items():
        yield told(f'{key} = "{name}"', f"Of {package}, which is loaded when a scene asks for it.", [])
    for name, package in refused.items():
        why = f"Not that of {package}, which is refused: the one that is built in has this name."
        yield told(f'{key} = "{name}"', why, [])


def schema() -> dict[str, Any]:
    """JSON Schema of a scene file, with a gait, an intruder or a robot that walks, its classes those that are known now."""
    every, theirs = sections(), intruder_keys.schemas()
    shapes = {"frame": {"type": "string", "description": FRAME}, **{k: _any(k, parts) for k, parts in every.items()}}
    swimmer = {"kind": {"const": "swimmer"}, **{name: shapes[name] for name in ("medium", "body", "effects")}}
    shapes["system"]["oneOf"].append(table(SWIMMER, swimmer, ["kind"]))
    groups = {"gaits": shapes, **theirs, "walkers": walker_keys.schemas()}
    named = {group: {k: {"$ref": f"#/$defs/{group}/{k}"} for k in of} for group, of in groups.items()}
    own = named["gaits"]
    every_name = dict.fromkeys(name for of in named.values() for name in of)
    whole, short = {"required": ["gait"]}, {"required": ["medium", "body", "gait"]}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "geomech scene",
        "type": "object",
        "properties": {k: {"anyOf": [of[k] for of in named.values() if k in of]} for k in every_name},
        "additionalProperties": False,
        "if": {"required": ["robot"]},
        "then": walker_keys.whole(named["walkers"]),
        "else": {
            "if": {"anyOf": [{"required": ["intruder"]}, {"required": ["motion"]}]},
            "then": intruder_keys.whole(named),
            "else": {
                **table("", own, []),
                "if": {"required": ["system"]}, "then": whole, "else": short,
                "allOf": [_size_needed(*each) for each in _sizes_needed(every)],
            },
        },
        "$defs": groups,
    }  # fmt: skip


def _shared(kind: str) -> set[str]:
    """Keys of a kind that [physical] may give; `_size_needed` asks for them there."""
    return {f.name for f in dataclasses.fields(Physical) if kind not in NOT_OF_THE_BODY.get(f.name, ())}


def _sizes_needed(every: dict) -> Iterator[tuple[str, str, str, str]]:
    """(table, key that names a class, its name, a size that it must be given there or in [physical])."""
    for section, parts in every.items():
        for key, name, kind in parts:
            for size in keys_of(kind):
                if key and size.required and size.name in _shared(name):
                    yield section, key, name, size.name


def _size_needed(section: str, key: str, name: str, size: str) -> dict[str, Any]:
    given = {"required": ["physical"], "properties": {"physical": {"required": [size]}}}
    rule = {"if": {"required": [key], "properties": {key: {"const": name}}}, "then": {"required": [size]}}
    return {"if": {"not": given}, "then": {"properties": {section: {"items": rule} if section == "effects" else rule}}}


def _any(section: str, parts: list[tuple[str, str, type]]) -> dict[str, Any]:
    if not parts[0][0]:  # one table, of the keys of all its classes
        return table("", {k: v for _, _, kind in parts for k, v in properties(keys_of(kind)).items()}, [])
    options = [option(first(kind), key, name, keys_of(kind), _shared(name)) for key, name, kind in parts]
    if section == "medium":
        file = {"file": {"type": "string", "description": FILE}}
        options.append(table("A medium of the catalogue.", {"name": {"enum": [*MEDIA]}}, ["name"]))
        options.append(table("A medium from a file.", file, ["file"]))
        options.append(table("A table from a file.", {**file, "law": {"const": "table"}}, ["file", "law"]))
    for other in unloaded(f"geomech.{GROUPS[section]}")[0]:  # its keys are known when it is loaded
        options.append({"type": "object", "properties": {parts[0][0]: {"const": other}}, "required": [parts[0][0]]})
    one = {"oneOf": options}
    return {"type": "array", "items": one} if section == "effects" else one
