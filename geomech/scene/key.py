"""What a class that a table of a TOML file is read from says of the table's keys, as text to read and as JSON Schema.

A class says it in the annotations of its fields (`rft.checks.Number`), else in its docstring: ``name (unit): meaning``,
or ``name, other (unit): meaning``, up to the next key or the end of the paragraph. The unit is - where there is none. Types
and defaults are those of its fields.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
import textwrap
from collections.abc import Collection
from typing import Any, NamedTuple

import msgspec

from rft.checks import numbers_of

MARK = re.compile(r"(?<![\w`.])((?:[A-Za-z_]\w*, )*[A-Za-z_]\w*) \(([^()]*)\):\s+")
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
        return worded(self.schema)

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
    """JSON Schema of the fields; empty for types that no scene file can hold, and for a class of one's own with such."""
    try:
        return msgspec.json.schema(kind, schema_hook=lambda other: {"type": "object"})["$defs"][kind.__name__][
            "properties"
        ]
    except (TypeError, KeyError):
        return {}


def _plain(schema: dict) -> dict[str, Any]:
    """Without default, and without null, which TOML has not."""
    values = [x for x in schema.get("anyOf", ()) if x.get("type") != "null"]
    return values[0] if len(values) == 1 else {k: v for k, v in schema.items() if k != "default"}


def _default(field: dataclasses.Field) -> Any:
    return field.default if field.default is not dataclasses.MISSING else field.default_factory()  # type: ignore[misc]


def meanings(kind: type) -> dict[str, tuple[str, str]]:
    """(unit, meaning) of the fields, as annotations and docstrings of the class and of those it is derived from say."""
    names = {f.name for f in dataclasses.fields(kind)}
    found: dict[str, tuple[str, str]] = {}
    for base in reversed(kind.__mro__):
        for paragraph in inspect.cleandoc(vars(base).get("__doc__") or "").split("\n\n"):
            marks = [m for m in MARK.finditer(paragraph) if {*m[1].split(", ")} <= names]
            for mark, after in zip(marks, [*marks[1:], None]):
                meaning = (
                    " ".join(paragraph[mark.end() : after.start() if after else None].split())
                    .rstrip(" .;")
                    .replace("`", "")
                )
                found |= dict.fromkeys(mark[1].split(", "), (mark[2], meaning))
    return found | {name: (number.unit, number.meaning) for name, number in numbers_of(kind).items()}


def first(kind: type) -> str:
    """The first sentence of its docstring; nothing where that tells a key."""
    first = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0].replace("`", "")
    sentence = re.split(r"(?<!Fig\.)(?<!Eqs\.)(?<!Eq\.)(?<!Sec\.)(?<=[.:;])\s", " ".join(first.split()))[0].rstrip(
        ".:;"
    )
    return "" if MARK.match(first) else f"{sentence}."


def told(title: str, about: str, keys: list[Key]) -> str:
    rows = [(k.name, k.type, k.unit, k.value) for k in keys]
    widths = [max(map(len, column)) for column in zip(*rows)]  # none without keys
    lines = [title, *textwrap.wrap(about, WIDTH)]
    for key, row in zip(keys, rows):
        start = "  " + "".join(f"{x:{width}}  " for x, width in zip(row, widths))
        meaning = key.meaning + f"; in degrees as {key.name}_deg" * key.degrees
        lines += textwrap.wrap(meaning, WIDTH, initial_indent=start, subsequent_indent=" " * min(len(start), 60))
    return "\n".join(lines)


def worded(schema: dict, several: bool = False) -> str:
    if "anyOf" in schema:
        return " or ".join(worded(x, several) for x in schema["anyOf"] if x.get("type") != "null")
    if schema.get("type") == "array":
        inner = schema.get("items") or schema["prefixItems"][0]
        count = f"{schema['minItems']} " if "minItems" in schema else ""
        return f"list{'s' * several} of {count}{worded(inner, True)}"
    return (PLURALS if several else WORDS).get(schema.get("type", ""), "value")


def properties(keys: list[Key]) -> dict[str, Any]:
    """JSON Schema of the keys by name, in degrees too where they may be."""
    made = {}
    for key in keys:
        unit = f" ({key.unit})" if key.unit not in ("", "-") else ""
        more = {} if key.required or key.default is None else {"default": json.loads(key.value)}
        made[key.name] = {**key.schema, "description": f"{key.meaning}{unit}", **more}
        if key.degrees:
            made[f"{key.name}_deg"] = {**key.schema, "description": f"{key.meaning} (degrees)"}
    return made


def option(about: str, key: str, name: str, keys: list[Key], elsewhere: Collection[str] = ()) -> dict[str, Any]:
    """A table that names its class by ``key = "name"``, if there is a key. elsewhere: what may be given in another table."""
    required = [k.name for k in keys if k.required and not k.degrees and k.name not in elsewhere]
    named = {key: {"const": name}} if key else {}
    made = table(about, {**named, **properties(keys)}, [*named, *required])
    either = [({"required": [k.name]}, {"required": [f"{k.name}_deg"]}, k.required) for k in keys if k.degrees]
    rules = [{"oneOf": [a, b]} if needed else {"not": {"allOf": [a, b]}} for a, b, needed in either]
    return {**made, "allOf": rules} if rules else made


def table(about: str, values: dict[str, Any], required: list[str]) -> dict[str, Any]:
    made = {"type": "object", "properties": values, "required": required, "additionalProperties": False}
    return {"description": about, **made} if about else made
