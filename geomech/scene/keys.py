"""Every key of a scene file, from the classes that read it: as text to read, and as a JSON Schema for editors.

A class says what its keys are in its docstring: ``name (unit): meaning``, or ``name, other (unit): meaning``, up to the
next key or the end of the paragraph. The unit is - where there is none. Types and defaults are those of its fields.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
import textwrap
from collections.abc import Iterator
from typing import Any, NamedTuple

import msgspec

from geomech.errors import choose
from geomech.kinds import FAMILIES, unloaded
from geomech.scene.model import Numerics
from geomech.scene.read import NOT_OF_THE_BODY, TABLES, Physical
from geomech.systems.swimmer import MEDIA, Swimmer

GROUPS = {
    "medium": "media",
    "body": "bodies",
    "gait": "gaits",
    "effects": "effects",
    "system": "systems",
}  # of FAMILIES
MARK = re.compile(r"(?<![\w`.])((?:[A-Za-z_]\w*, )*[A-Za-z_]\w*) \(([^()]*)\):\s+")
FRAME = (
    "of all velocities and displacements, in place of the body's own key; 'minimum-perturbation': the one in which the "
    "connection is smallest"
)
FILE = (
    "TOML of a medium, as geomech calibrate writes it, with no key beside it; or, beside law = 'table', CSV of a table"
)
SWIMMER = "A body in a medium: its tables [medium], [body] and [[effects]] may as well be in it as stand by themselves."
WORDS = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false"}
PLURALS = {"number": "numbers", "integer": "whole numbers", "string": "texts", "boolean": "truths"}
WIDTH = 120


class Key(NamedTuple):
    """One key of a table. schema: JSON Schema of its values. default: None where it may be left out for want of a value.
    degrees: it may be given as ``name``_deg."""

    name: str
    schema: dict[str, Any]
    unit: str
    meaning: str
    required: bool
    default: Any
    degrees: bool

    @property
    def type(self) -> str:
        return _words(self.schema)

    @property
    def value(self) -> str:
        """Its default as a scene file has it."""
        if self.required:
            return "required"
        return "none" if self.default is None else json.dumps(self.default, default=list)


def keys_of(kind: type) -> list[Key]:
    """The keys of a table that a class is read from."""
    shapes, told, angles = _shapes(kind), meanings(kind), getattr(kind, "angles", ())
    made = []
    for field in dataclasses.fields(kind):
        if field.init and field.name != "solver":
            required = field.default is field.default_factory is dataclasses.MISSING
            default = None if required else _default(field)
            unit, meaning = told.get(field.name, ("", ""))
            schema = _plain(shapes.get(field.name, {}))
            made.append(Key(field.name, schema, unit, meaning, required, default, field.name in angles))
    return made


def _shapes(kind: type) -> dict[str, dict]:
    """JSON Schema of the fields; empty for a class of one's own with types that no scene file can hold."""
    try:
        return msgspec.json.schema(kind)["$defs"][kind.__name__]["properties"]
    except (TypeError, KeyError):
        return {}


def _plain(schema: dict) -> dict[str, Any]:
    """Without default, and without null, which TOML has not."""
    values = [x for x in schema.get("anyOf", ()) if x.get("type") != "null"]
    return values[0] if len(values) == 1 else {k: v for k, v in schema.items() if k != "default"}


def _default(field: dataclasses.Field) -> Any:
    return field.default if field.default is not dataclasses.MISSING else field.default_factory()  # type: ignore[misc]


def meanings(kind: type) -> dict[str, tuple[str, str]]:
    """(unit, meaning) of the fields, as the docstrings of the class and of those it is derived from say."""
    names = {f.name for f in dataclasses.fields(kind)}
    found: dict[str, tuple[str, str]] = {}
    for base in reversed(kind.__mro__):
        for paragraph in inspect.cleandoc(vars(base).get("__doc__") or "").split("\n\n"):
            marks = [m for m in MARK.finditer(paragraph) if {*m[1].split(", ")} <= names]
            for mark, after in zip(marks, [*marks[1:], None]):
                meaning = (
                    " ".join(paragraph[mark.end() : after.start() if after else None].split())
                    .rstrip(" .")
                    .replace("`", "")
                )
                found |= dict.fromkeys(mark[1].split(", "), (mark[2], meaning))
    return found


def sections() -> dict[str, list[tuple[str, str, type]]]:
    """Of every table: (key that names the class, its name, the class), with "" for tables of one class."""
    made: dict[str, list[tuple[str, str, type]]] = {}
    for table, group in GROUPS.items():
        family = FAMILIES[f"geomech.{group}"]
        made[table] = [(family.key, name, kind) for name, kind in family.kinds.items() if kind is not Swimmer]
    solvers = {type(k.solver): None for _, _, k in [*made["system"], ("", "", Swimmer)] if getattr(k, "solver", None)}
    made["numerics"] = [("", "", kind) for kind in (Numerics, *solvers)]
    made["physical"] = [("", "", Physical)]
    return {name: made[name] for name in TABLES if name in made}


def text(section: str | None = None) -> str:
    """All keys, or those of one section, to be read."""
    every = sections()
    chosen = [choose("SECTION", section, [*every, "frame"])] if section is not None else ["frame", *every]
    return "\n\n".join("\n\n".join(_told(name, every)) for name in chosen) + "\n"


def _told(section: str, every: dict) -> Iterator[str]:
    words = {"type": "string"}
    if section == "frame":
        yield _table("above all tables", "", [Key("frame", words, "-", FRAME, False, "mean", False)])
        return
    if section == "medium":
        meaning = f"a medium of the catalogue: {', '.join(MEDIA)}; 'geomech scenes --show NAME' prints one"
        yield _table(
            "[medium]", "By name, with no key beside it.", [Key("name", words, "-", meaning, True, None, False)]
        )
        yield _table("[medium]", "From a file.", [Key("file", words, "-", FILE, True, None, False)])
    for key, name, kind in every[section]:
        head = f"[[{section}]]" if section == "effects" else f"[{section}]"
        yield _table(f'{head} {key} = "{name}"' if key else head, _first(kind), keys_of(kind))
    if section in GROUPS:
        yield from _of_packages(f"geomech.{GROUPS[section]}", every[section][0][0])
    if section == "system":
        yield _table('[system] kind = "swimmer"', SWIMMER, [])


def _of_packages(group: str, key: str) -> Iterator[str]:
    new, refused = unloaded(group)
    for name, package in new.items():
        yield _table(f'{key} = "{name}"', f"Of {package}, which is loaded when a scene asks for it.", [])
    for name, package in refused.items():
        why = f"Not that of {package}, which is refused: the one that is built in has this name."
        yield _table(f'{key} = "{name}"', why, [])


def _first(kind: type) -> str:
    """The first sentence of its docstring; nothing where that tells a key."""
    first = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0].replace("`", "")
    sentence = re.split(r"(?<!Fig\.)(?<!Eqs\.)(?<!Eq\.)(?<=[.:;])\s", " ".join(first.split()))[0].rstrip(".:;")
    return "" if MARK.match(first) else f"{sentence}."


def _table(title: str, about: str, keys: list[Key]) -> str:
    rows = [(k.name, k.type, k.unit, k.value) for k in keys]
    widths = [max(map(len, column)) for column in zip(*rows)]  # none without keys
    lines = [title, *textwrap.wrap(about, WIDTH)]
    for key, row in zip(keys, rows):
        start = "  " + "".join(f"{x:{width}}  " for x, width in zip(row, widths))
        meaning = key.meaning + f"; in degrees as {key.name}_deg" * key.degrees
        lines += textwrap.wrap(meaning, WIDTH, initial_indent=start, subsequent_indent=" " * min(len(start), 60))
    return "\n".join(lines)


def _words(schema: dict, several: bool = False) -> str:
    if "anyOf" in schema:
        return " or ".join(_words(x, several) for x in schema["anyOf"] if x.get("type") != "null")
    if schema.get("type") == "array":
        inner = schema.get("items") or schema["prefixItems"][0]
        count = f"{schema['minItems']} " if "minItems" in schema else ""
        return f"list{'s' * several} of {count}{_words(inner, True)}"
    return (PLURALS if several else WORDS).get(schema.get("type", ""), "value")


def schema() -> dict[str, Any]:
    """JSON Schema of a scene file, its classes those that are known now."""
    every = sections()
    shapes = {name: _any(name, parts) for name, parts in every.items()}
    swimmer = {"kind": {"const": "swimmer"}, **{name: shapes[name] for name in ("medium", "body", "effects")}}
    shapes["system"]["oneOf"].append(_object(SWIMMER, swimmer, ["kind"]))
    whole, short = {"required": ["gait"]}, {"required": ["medium", "body", "gait"]}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "geomech scene",
        "type": "object",
        "properties": {"frame": {"type": "string", "description": FRAME}, **shapes},
        "additionalProperties": False,
        "if": {"required": ["system"]}, "then": whole, "else": short,
        "allOf": [_size_needed(*each) for each in _sizes_needed(every)],
    }  # fmt: skip


def _sizes_needed(every: dict) -> Iterator[tuple[str, str, str, str]]:
    """(table, key that names a class, its name, a size that it must be given there or in [physical])."""
    shared = {f.name for f in dataclasses.fields(Physical)}
    for table, parts in every.items():
        for key, name, kind in parts:
            for size in keys_of(kind):
                if key and size.required and size.name in shared and name not in NOT_OF_THE_BODY.get(size.name, ()):
                    yield table, key, name, size.name


def _size_needed(table: str, key: str, name: str, size: str) -> dict[str, Any]:
    given = {"required": ["physical"], "properties": {"physical": {"required": [size]}}}
    rule = {"if": {"required": [key], "properties": {key: {"const": name}}}, "then": {"required": [size]}}
    return {"if": {"not": given}, "then": {"properties": {table: {"items": rule} if table == "effects" else rule}}}


def _any(section: str, parts: list[tuple[str, str, type]]) -> dict[str, Any]:
    if not parts[0][0]:  # one table, of the keys of all its classes
        return _object("", {k: v for _, _, kind in parts for k, v in _properties(kind).items()}, [])
    options = [_option(key, name, kind) for key, name, kind in parts]
    if section == "medium":
        file = {"file": {"type": "string", "description": FILE}}
        options.append(_object("A medium of the catalogue.", {"name": {"enum": [*MEDIA]}}, ["name"]))
        options.append(_object("A medium from a file.", file, ["file"]))
        options.append(_object("A table from a file.", {**file, "law": {"const": "table"}}, ["file", "law"]))
    for other in unloaded(f"geomech.{GROUPS[section]}")[0]:  # its keys are known when it is loaded
        options.append({"type": "object", "properties": {parts[0][0]: {"const": other}}, "required": [parts[0][0]]})
    one = {"oneOf": options}
    return {"type": "array", "items": one} if section == "effects" else one


def _option(key: str, name: str, kind: type) -> dict[str, Any]:
    """A table that names this class. What [physical] may give is required by `_size_needed`."""
    keys = keys_of(kind)
    shared = {f.name for f in dataclasses.fields(Physical) if name not in NOT_OF_THE_BODY.get(f.name, ())}
    required = [k.name for k in keys if k.required and not k.degrees and k.name not in shared]
    made = _object(_first(kind), {key: {"const": name}, **_properties(kind)}, [key, *required])
    either = [({"required": [k.name]}, {"required": [f"{k.name}_deg"]}, k.required) for k in keys if k.degrees]
    rules = [{"oneOf": [a, b]} if needed else {"not": {"allOf": [a, b]}} for a, b, needed in either]
    return {**made, "allOf": rules} if rules else made


def _properties(kind: type) -> dict[str, Any]:
    made = {}
    for key in keys_of(kind):
        unit = f" ({key.unit})" if key.unit not in ("", "-") else ""
        more = {} if key.required or key.default is None else {"default": json.loads(key.value)}
        made[key.name] = {**key.schema, "description": f"{key.meaning}{unit}", **more}
        if key.degrees:
            made[f"{key.name}_deg"] = {**key.schema, "description": f"{key.meaning} (degrees)"}
    return made


def _object(about: str, properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    made = {"type": "object", "properties": properties, "required": required, "additionalProperties": False}
    return {"description": about, **made} if about else made
