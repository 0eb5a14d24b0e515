"""Keys of a section of a scene file, from the class that the section is read into.

A class declares them in the annotations of its fields (`rft.core.checks.Number`,
`Word`), else in its docstring, as ``name (unit): meaning`` or ``name, other (unit):
meaning``, up to the next key or the end of the paragraph. The unit is - where there is
none. A key in rad may be given in degrees, as ``name_deg``. Types and defaults are
those of the fields.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import json
import re
from collections.abc import Mapping
from typing import Any, NamedTuple, get_args, get_type_hints

import msgspec

from rft.core.checks import Word, number_fields

MARK = re.compile(r"(?<![\w`.])((?:[A-Za-z_]\w*, )*[A-Za-z_]\w*) \(([^()]*)\):\s+")


class Key(NamedTuple):
    """One key of a section.

    schema: JSON Schema of its values. default: None where there is none. degrees:
    whether it may also be given as ``name``_deg. alias: another name of it."""

    name: str
    schema: dict[str, Any]
    unit: str
    meaning: str
    required: bool
    default: Any
    degrees: bool
    alias: str = ""

    @property
    def value(self) -> str:
        """The default as a scene file has it; or "required", or "none"."""
        if self.required:
            return "required"
        if self.default is None:
            return "none"
        return json.dumps(self.default, default=list)

    @property
    def spellings(self) -> tuple[str, ...]:
        """The names under which a file may give it."""
        names = [self.name]
        if self.degrees:
            names.append(f"{self.name}_deg")
        if self.alias:
            names.append(self.alias)
        return tuple(names)


def text_key(name: str, meaning: str, required: bool = False) -> Key:
    """Return a key that takes a text."""
    return Key(name, {"type": "string"}, "-", meaning, required, None, False)


def keys_of(kind: type) -> list[Key]:
    """Return the keys of a section that a class is read from."""
    schemas = _schemas(kind)
    return [_key_of(kind, field, schemas) for field in key_fields(kind)]


def key_fields(kind: type) -> list[dataclasses.Field]:
    """Return the fields of a class that are keys of its section."""
    fields = dataclasses.fields(kind)
    return [field for field in fields if field.init and field.name != "solver"]


def _key_of(kind: type, field: dataclasses.Field, schemas: dict[str, dict]) -> Key:
    name = field.name
    required = field.default is field.default_factory is dataclasses.MISSING
    required = required or name in getattr(kind, "required", ())
    schema = _plain_schema(schemas.get(name, {}))
    unit, meaning = meanings(kind).get(name, ("", ""))
    number = number_fields(kind).get(name)
    if number:
        schema = schema | {"minimum": number.low, "maximum": number.high}
    word = words_of(kind).get(name)
    if word:
        schema = schema | {"enum": [*word.choices]}
        unit = "-"
        meaning = word.meaning
    name_in_file = aliases(kind).get(name, name)
    return Key(
        name_in_file,
        schema,
        unit,
        meaning,
        required,
        default=None if required else _default(field),
        degrees=name in angles_of(kind),
        alias=name if name_in_file != name else "",
    )


def aliases(kind: type) -> Mapping[str, str]:
    """Return the names in files of fields whose keys are no names in Python, by
    field."""
    return getattr(kind, "aliases", {})


@functools.cache
def angles_of(kind: type) -> frozenset[str]:
    """Return the names of the fields in rad, which a file may give in degrees; none for
    a class that is no dataclass."""
    if not dataclasses.is_dataclass(kind):
        return frozenset()
    units = {name: unit for name, (unit, _) in meanings(kind).items()}
    return frozenset(name for name, unit in units.items() if unit == "rad")


@functools.cache
def spellings(kind: type) -> dict[str, tuple[str, bool]]:
    """Return the field of a class, and whether the key is in degrees, by key in a
    file."""
    names = [field.name for field in key_fields(kind)]
    fields = {name: (name, False) for name in names}
    for name, name_in_file in aliases(kind).items():
        fields[name_in_file] = (name, False)
    for name in names:
        if name in angles_of(kind):
            fields[f"{name}_deg"] = (name, True)
    return fields


@functools.cache
def words_of(kind: type) -> dict[str, Word]:
    """Return the annotations `Word` of a class by field."""
    try:
        hints = get_type_hints(kind, include_extras=True)
    except (NameError, TypeError):
        # The annotations of a custom class may name types that are not imported.
        return {}
    words = {}
    for name, hint in hints.items():
        for annotation in get_args(hint):
            if isinstance(annotation, Word):
                words[name] = annotation
                break
    return words


def _schemas(kind: type) -> dict[str, dict]:
    """Return JSON Schema of the fields by name. A type that no scene file can hold is
    an object; {} for a custom class of which there is no schema."""
    try:
        schema = msgspec.json.schema(kind, schema_hook=lambda _: {"type": "object"})
        return schema["$defs"][kind.__name__]["properties"]
    except (TypeError, KeyError):
        return {}


def _plain_schema(schema: dict) -> dict[str, Any]:
    """Return a schema without default, and without null, which TOML lacks."""
    values = [x for x in schema.get("anyOf", ()) if x.get("type") != "null"]
    if len(values) == 1:
        return values[0]
    return {key: value for key, value in schema.items() if key != "default"}


def _default(field: dataclasses.Field) -> Any:
    if field.default is not dataclasses.MISSING:
        return field.default
    return field.default_factory()  # type: ignore[misc]


@functools.cache
def meanings(kind: type) -> dict[str, tuple[str, str]]:
    """Return (unit, meaning) of the fields by name, from annotations and docstrings of
    the class and its bases."""
    fields = {field.name for field in dataclasses.fields(kind)}
    found: dict[str, tuple[str, str]] = {}
    for base in reversed(kind.__mro__):
        text = inspect.cleandoc(vars(base).get("__doc__") or "")
        for paragraph in text.split("\n\n"):
            found |= _meanings_in(paragraph, fields)
    for name, number in number_fields(kind).items():
        found[name] = (number.unit, number.meaning)
    return found


def _meanings_in(paragraph: str, fields: set[str]) -> dict[str, tuple[str, str]]:
    """Return (unit, meaning) of the fields that a paragraph describes, by name."""
    found = {}
    paragraph = " ".join(paragraph.split())
    marks = [m for m in MARK.finditer(paragraph) if {*m[1].split(", ")} <= fields]
    ends = [*(mark.start() for mark in marks[1:]), len(paragraph)]
    for mark, end in zip(marks, ends):
        meaning = paragraph[mark.end() : end]
        for name in mark[1].split(", "):
            found[name] = (mark[2], meaning.rstrip(" .;").replace("`", ""))
    return found


def first_sentence(kind: type) -> str:
    """Return the first sentence of a class's docstring; "" where it describes a key,
    and without a docstring."""
    paragraph = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0]
    paragraph = paragraph.replace("`", "")
    if not paragraph or MARK.match(paragraph):
        return ""
    # Neither an abbreviation nor an ellipsis ends a sentence.
    sentence_end = r"(?<!Fig\.)(?<!Eqs\.)(?<!Eq\.)(?<!Sec\.)(?<!\.\.\.)(?<=[.:;])\s"
    sentence = re.split(sentence_end, " ".join(paragraph.split()))[0]
    return f"{sentence.rstrip('.:;')}."
