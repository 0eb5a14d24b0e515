"""Keys of a section of a scene file, from the class that the section is read into.

A class declares them in the annotations of its fields (`rft.core.checks.Number`, `Word`), else in its docstring: ``name
(unit): meaning``, or ``name, other (unit): meaning``, up to the next key or the end of the paragraph. The unit is -
where there is none; a key in rad may be given in degrees, as ``name_deg``. Types and defaults are those of its
fields.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import json
import re
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple, get_args, get_type_hints

import msgspec

from rft.core.checks import number_fields

MARK = re.compile(r"(?<![\w`.])((?:[A-Za-z_]\w*, )*[A-Za-z_]\w*) \(([^()]*)\):\s+")


class Word(NamedTuple):
    """A field whose text is one of several choices. meaning: for lists of keys."""

    choices: Collection[str]
    meaning: str


class Key(NamedTuple):
    """One key of a section. schema: JSON Schema of its values. default: None where it has no value by default. degrees:
    it may be given as ``name``_deg. alias: another name of it."""

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
        """The default as a scene file has it."""
        if self.required:
            return "required"
        return (
            "none" if self.default is None else json.dumps(self.default, default=list)
        )

    @property
    def spellings(self) -> tuple[str, ...]:
        """The names under which a file may give it."""
        return (
            self.name,
            *[f"{self.name}_deg"] * self.degrees,
            *[self.alias] * bool(self.alias),
        )


def text_key(name: str, meaning: str, required: bool = False) -> Key:
    """Return a key that takes a text."""
    return Key(name, {"type": "string"}, "-", meaning, required, None, False)


def keys_of(kind: type) -> list[Key]:
    """Return the keys of a section that a class is read from."""
    schemas, names, words, numbers = (
        _schemas(kind),
        aliases(kind),
        words_of(kind),
        number_fields(kind),
    )
    keys = []
    for field in dataclasses.fields(kind):
        if field.init and field.name != "solver":
            required = field.default is field.default_factory is dataclasses.MISSING
            required = required or field.name in getattr(kind, "required", ())
            default = None if required else _default(field)
            schema, (unit, meaning) = (
                _plain(schemas.get(field.name, {})),
                meanings(kind).get(field.name, ("", "")),
            )
            if number := numbers.get(field.name):
                schema = schema | {"minimum": number.low, "maximum": number.high}
            if word := words.get(field.name):
                schema, unit, meaning = (
                    schema | {"enum": [*word.choices]},
                    "-",
                    word.meaning,
                )
            name, alias = (
                (names[field.name], field.name)
                if field.name in names
                else (field.name, "")
            )
            degrees = field.name in angles_of(kind)
            keys.append(
                Key(name, schema, unit, meaning, required, default, degrees, alias)
            )
    return keys


def aliases(kind: type) -> Mapping[str, str]:
    """Return, by field, the names in files of keys that are no names in Python."""
    return getattr(kind, "aliases", {})


@functools.cache
def angles_of(kind: type) -> frozenset[str]:
    """Return the fields in rad, which a file may give in degrees; none for a class that is no dataclass."""
    if not dataclasses.is_dataclass(kind):
        return frozenset()
    return frozenset(
        name for name, (unit, _) in meanings(kind).items() if unit == "rad"
    )


@functools.cache
def spellings(kind: type) -> dict[str, tuple[str, bool]]:
    """Return, by key in a file, the field of a class and whether it is in degrees."""
    names = [
        field.name
        for field in dataclasses.fields(kind)
        if field.init and field.name != "solver"
    ]
    fields = {name: (name, False) for name in names}
    fields |= {spelling: (name, False) for name, spelling in aliases(kind).items()}
    return fields | {
        f"{name}_deg": (name, True) for name in names if name in angles_of(kind)
    }


@functools.cache
def words_of(kind: type) -> dict[str, Word]:
    """Return the annotations `Word` of a class by field."""
    try:
        hints = get_type_hints(kind, include_extras=True)
    except (
        NameError,
        TypeError,
    ):  # of a class of a user's, whose annotations name what is not there
        return {}
    marked = {
        name: [x for x in get_args(hint) if isinstance(x, Word)]
        for name, hint in hints.items()
    }
    return {name: words[0] for name, words in marked.items() if words}


def _schemas(kind: type) -> dict[str, dict]:
    """Return JSON Schema of the fields; empty for types that no scene file can hold, and for a custom class with
    such."""
    try:
        return msgspec.json.schema(kind, schema_hook=lambda other: {"type": "object"})[
            "$defs"
        ][kind.__name__]["properties"]
    except (TypeError, KeyError):
        return {}


def _plain(schema: dict) -> dict[str, Any]:
    """Return a schema without default, and without null, which TOML lacks."""
    values = [x for x in schema.get("anyOf", ()) if x.get("type") != "null"]
    return (
        values[0]
        if len(values) == 1
        else {k: v for k, v in schema.items() if k != "default"}
    )


def _default(field: dataclasses.Field) -> Any:
    return (
        field.default
        if field.default is not dataclasses.MISSING
        else field.default_factory()
    )  # type: ignore[misc]


@functools.cache
def meanings(kind: type) -> dict[str, tuple[str, str]]:
    """Return (unit, meaning) of the fields, from annotations and docstrings of the class and its bases."""
    names = {f.name for f in dataclasses.fields(kind)}
    meanings_by_name: dict[str, tuple[str, str]] = {}
    for base in reversed(kind.__mro__):
        for paragraph in inspect.cleandoc(vars(base).get("__doc__") or "").split(
            "\n\n"
        ):
            marks = [
                m for m in MARK.finditer(paragraph) if {*m[1].split(", ")} <= names
            ]
            for mark, after in zip(marks, [*marks[1:], None]):
                meaning = " ".join(
                    paragraph[mark.end() : after.start() if after else None].split()
                )
                meanings_by_name |= dict.fromkeys(
                    mark[1].split(", "),
                    (mark[2], meaning.rstrip(" .;").replace("`", "")),
                )
    return meanings_by_name | {
        name: (number.unit, number.meaning)
        for name, number in number_fields(kind).items()
    }


def first_sentence(kind: type) -> str:
    """Return the first sentence of a class's docstring; nothing where that tells a key."""
    paragraph = (
        inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0].replace("`", "")
    )
    sentence = re.split(
        r"(?<!Fig\.)(?<!Eqs\.)(?<!Eq\.)(?<!Sec\.)(?<=[.:;])\s",
        " ".join(paragraph.split()),
    )[0]
    return "" if MARK.match(paragraph) else f"{sentence.rstrip('.:;')}."
