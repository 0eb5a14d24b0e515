"""The reader of scene files: it builds the parts of a scene from tables of TOML, by the
scene's declarations."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from geomech.core.entry_points import choose_part
from geomech.core.errors import UnitWarning, choose
from geomech.scenes.format import hints
from geomech.scenes.format.key import Key, spellings, words_of
from geomech.scenes.format.sections import (
    Each,
    Keys,
    OneOf,
    Section,
    Variant,
    file_sections,
    sections_of,
    variant_of,
)
from geomech.scenes.format.sizes import Sizes
from rft.core.notes import warn
from rft.core.refusal import Refusal, located
from rft.core.registry import Registry

FILES = ("file", "mjcf")  # keys that name a file, relative to the scene's folder
Built = TypeVar("Built")


@dataclass
class Source:
    """A scene file that is being read.

    name: of the file. example: a built-in scene that has all required sections. files:
    names of further files, which the reader adds. sizes: given once for all parts.
    folder: in which files are looked for; that of the scene file if None."""

    name: str
    example: str = "NAME"
    files: list[str] = dataclasses.field(default_factory=list)
    sizes: Sizes | None = None
    folder: Path | None = None

    @property
    def cure(self) -> str:
        return f"see 'geomech scenes --show {self.example}'"

    def located(self, table: Mapping) -> dict:
        """Return a table in which the name of a file has its folder, and add the file
        to ``files``."""
        table = dict(table)
        for key in FILES:
            if isinstance(table.get(key), str):
                folder = self.folder or Path(self.name).absolute().parent
                table[key] = str(folder / table[key])
                self.files.append(table[key])
        return table


def read(scene: type[Built], tables: Mapping, name: str, text: str) -> Built:
    """Return the scene of the tables of a TOML text; Refusal with the place if they
    describe none."""
    source = Source(name, scene.example)
    check(scene, tables, source)
    with located(name):
        return scene(
            **read_sections(scene, tables, source),
            name=name,
            text=text,
            files=tuple(source.files),
        )


def check(scene: type, tables: Mapping, source: Source) -> None:
    """Raise Refusal for a table that is not declared, or missing."""
    declared = file_sections(scene)
    for table in tables:
        choose(f"{source.name}: table", table, declared)
    for name, (section, required, instead) in declared.items():
        if name in tables:
            _check_form(source, name, tables[name], section)
        elif required and instead not in tables:
            raise Refusal(
                f"the table [{name}] is missing",
                where=source.name,
                instead=f"add it, {source.cure}",
            )


def _check_form(source: Source, path: str, table: Any, section: Section | Key) -> None:
    """Raise Refusal unless a value is a table, or a list of tables where a section has
    one for each part."""
    if isinstance(section, Each):
        is_list = isinstance(table, list)
        if not is_list or not all(isinstance(each, Mapping) for each in table):
            raise Refusal(
                f"{path} must be tables [[{path}]], one for each", where=source.name
            )
    elif not isinstance(section, Key) and not isinstance(table, Mapping):
        raise Refusal(
            f"{path} must be a table [{path}], got {type(table).__name__}",
            where=source.name,
            instead=source.cure,
        )


def read_sections(scene: type, tables: Mapping, source: Source) -> dict[str, Any]:
    """Return the fields of a scene that its tables give, by name."""
    parts = {}
    for name, (section, *_) in sections_of(scene).items():
        if name in tables:
            part = read_section(source, name, tables[name], section)
            if isinstance(part, dict):  # several fields of the scene
                parts |= part
            else:
                parts[name] = part
    return parts


def read_section(source: Source, path: str, table: Any, section: Section) -> Any:
    """Return the part of a scene that a section describes. path: its name, after the
    names of the sections around it."""
    if isinstance(section, Each):
        return tuple(_read_one(source, f"[{path}]", each, section) for each in table)
    return _read_one(source, path, table, section)


def _read_one(source: Source, path: str, table: Mapping, section: Section) -> Any:
    place = f"{source.name}: [{path}]"
    variant, table = _choose_variant(place, source.located(table), section)
    if isinstance(section, OneOf) and section.sized and source.sizes:
        table = source.sizes.fill(place, table, variant.kind)
    label = variant.label
    if not label and isinstance(section, OneOf):
        label = f"no {section.key!r}"
    inner = {}
    if variant.inner:
        _check_keys(place, table, variant.kind, label)
    for field, part in variant.inner.items():
        within = f"{path}.{field}"
        if variant.named.get("kind") == section.short:
            within = field
        if field in table:
            _check_form(source, within, table[field], part)
            inner[field] = read_section(source, within, table.pop(field), part)
        elif field in variant.needed:
            raise Refusal(
                f"the table [{within}] is missing",
                where=place,
                instead=f"add it, {source.cure}",
            )
    if variant.file:
        table = _from_file(place, table, variant)
    return build(source, place, table, variant.kind, inner, label)


def _choose_kind(place: str, word: object, section: OneOf) -> str:
    """Return the name of a kind of a section; Refusal for another word."""
    if isinstance(section.kinds, Registry):
        return choose_part(section.kinds, place, word)
    if isinstance(word, str) and word in section.elsewhere:
        raise Refusal(
            f"{word!r} is not among {', '.join(section.kinds)}",
            where=place,
            instead=section.elsewhere[word],
        )
    return choose(place, word, section.kinds)


def _choose_variant(
    place: str, table: dict, section: Keys | OneOf
) -> tuple[Variant, dict]:
    """Return the kind that a table names, and its other keys."""
    if isinstance(section, Keys):
        return Variant({}, section.kind), table
    if section.key in table:
        name = _choose_kind(f"{place} {section.key}", table[section.key], section)
        table = {key: value for key, value in table.items() if key != section.key}
        if not isinstance(section.kinds[name], OneOf):
            return variant_of(section, name), table
        variant, table = _choose_variant(place, table, section.kinds[name])
        return variant._replace(named={section.key: name} | dict(variant.named)), table
    cure = f"add {section.key} = one of {', '.join(section.kinds)}"
    for kind in section.otherwise:
        first_key = dataclasses.fields(kind)[0].name
        if first_key in table:
            return Variant({}, kind), table
        cure += f", or {first_key}"
    raise Refusal(f"has no {section.key!r}", where=place, instead=cure)


def _from_file(place: str, table: dict, variant: Variant) -> dict:
    """Return the keys of a section with the values of its file in place of the file."""
    if not variant.file.keys and {*table} != {"file"}:
        raise Refusal(
            f"{variant.label} with the key 'file' takes no other key",
            where=place,
            because=f"it reads a {variant.file.meaning}",
        )
    if "file" not in table:
        return table
    if variant.file.keys:
        fields = [spellings(variant.kind).get(key, (key,))[0] for key in table]
        variant.alternatives.check(place, fields)
    file = table.pop("file")
    if not isinstance(file, str):
        raise Refusal("file must be the name of a file", value=file, where=place)
    return table | variant.file.read(place, file)


def build(
    source: Source,
    place: str,
    table: Mapping,
    kind: type[Built],
    inner: Mapping[str, Any] | None = None,
    label: str = "",
) -> Built:
    """Return the part of a table of keys: an instance of a class, or what the class
    returns as ``to_part``. Refusal if the keys do not describe one.

    inner: fields that are already read. label: how the table names the class."""
    inner = dict(inner or {})
    _check_keys(place, table, kind, label)
    values = _field_values(place, table, kind)
    alternatives = getattr(kind, "alternatives", None)
    if alternatives:
        alternatives.check(place, values)
    for field, word in words_of(kind).items():
        if field in values:
            choose(f"{place} {field}", values[field], word.choices)
    required = {
        field.name
        for field in dataclasses.fields(kind)
        if field.default is field.default_factory
    }
    # A swimmer has parts whose types msgspec does not know.
    if inner and required <= {*inner}:
        return kind(**inner | values)
    try:
        part = msgspec.convert({**values, **inner}, kind)
        if hasattr(kind, "to_part"):
            return part.to_part(source, place, {*values})
        return part
    except Refusal as refusal:
        raise refusal.within(place) from None
    except (ValueError, OverflowError) as error:
        raise _build_refusal(error, place, table, kind) from None


def _build_refusal(error: Exception, place: str, table: Mapping, kind: type) -> Refusal:
    """Return the refusal, with a cure, for an error of msgspec."""
    refusal = error.__cause__
    if isinstance(refusal, Refusal):  # of a class that checks its own values
        refusal.instead = refusal.instead or hints.value_hint(refusal.what, table, kind)
        return refusal.within(place)
    reason = str(error).replace(" - at `$", " - at `").replace(" - at ``", "")
    message = reason.replace("Object missing required field", "has no")
    hint = hints.value_hint(reason, table, kind)
    return Refusal(message, where=place, instead=hint)


def _field_values(place: str, table: Mapping, kind: type) -> dict[str, Any]:
    """Return the values of a table by field, with angles in rad; Refusal for a field
    that is given under two names."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        field, in_degrees = spellings(kind)[key]
        if field in values:
            both = [other for other in table if spellings(kind)[other][0] == field]
            raise Refusal(
                f"{field} is given twice",
                where=place,
                instead=f"keep one of {' and '.join(both)}",
            )
        values[field] = _radians(value) if in_degrees else value
        if key == "gamma0_deg":
            _check_degrees(f"{place} {key}", value)
    return values


def _check_keys(place: str, table: Mapping, kind: type, label: str) -> None:
    """Raise Refusal for a key that a class does not have. label: how the table names
    the class."""
    try:
        for key in table:
            choose(f"{place} key", key, spellings(kind))
    except Refusal as refusal:
        if label:
            refusal.instead += f" ({label})"
        raise


def _check_degrees(place: str, value) -> None:
    """Warn (`UnitWarning`) of an angle of grains below a degree: measured ones are ten
    to twenty degrees."""
    if isinstance(value, (int, float)) and 0 < value < 1:
        text = (
            f"{place} = {value:g} is less than one degree: if the value is in rad, "
            f"write gamma0 = {value:g}"
        )
        warn(text, UnitWarning)


def _radians(degrees: Any) -> Any:
    """Return a number, or numbers in lists, converted from degrees; other values
    unchanged, as they are refused later."""
    if isinstance(degrees, list):
        return [_radians(x) for x in degrees]
    is_number = isinstance(degrees, (int, float)) and not isinstance(degrees, bool)
    if is_number and abs(degrees) < 1e300:
        return math.radians(degrees)
    return degrees
