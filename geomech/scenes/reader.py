"""The reader of scene files: tables of TOML become the parts of a scene that its declarations name."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from geomech.core.entry_points import choose_part
from geomech.core.errors import UnitWarning, choose
from geomech.scenes import hints
from geomech.scenes.key import Key, spellings, words_of
from geomech.scenes.sections import (
    Each,
    Keys,
    OneOf,
    Section,
    Variant,
    file_sections,
    sections_of,
    variant_of,
)
from geomech.scenes.sizes import Sizes
from rft.core.refusal import Refusal, located
from rft.core.registry import Registry

FILES = (
    "file",
    "mjcf",
)  # keys that name a file, looked for from the folder of the scene's
Built = TypeVar("Built")


@dataclass
class Source:
    """A scene file that is being read. name: its own. example: a built-in scene with all that is needed. files: names
    of further files, which reading adds. sizes: given once for all its parts. folder: in which files are looked for,
    its own if none."""

    name: str
    example: str = "NAME"
    files: list[str] = dataclasses.field(default_factory=list)
    sizes: Sizes | None = None
    folder: Path | None = None

    @property
    def cure(self) -> str:
        return f"see 'geomech scenes --show {self.example}'"

    def located(self, table: Mapping) -> dict:
        """Return a table whose file, if it names one, is a path from the scene's folder; add that to ``files``."""
        table = dict(table)
        for key in FILES:
            if isinstance(table.get(key), str):
                table[key] = str(
                    (self.folder or Path(self.name).absolute().parent) / table[key]
                )
                self.files.append(table[key])
        return table


def read(scene: type[Built], tables: Mapping, name: str, text: str) -> Built:
    """Return the scene of the tables of a TOML text; Refusal, which names the place, if they make none."""
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
    """Raise Refusal unless the tables are those that a scene declares, and none is missing."""
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
    """Raise Refusal unless a table is one, or a list of tables where a section is one for each part."""
    if isinstance(section, Each):
        if not (
            isinstance(table, list) and all(isinstance(each, Mapping) for each in table)
        ):
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
    """Return the fields of a scene that its sections make; those of a missing section have their defaults."""
    parts = {}
    for name, (section, *_) in sections_of(scene).items():
        if name in tables:
            part = read_section(source, name, tables[name], section)
            parts |= part if isinstance(part, dict) else {name: part}
    return parts


def read_section(source: Source, path: str, table: Any, section: Section) -> Any:
    """Return the part of a scene that a section makes. path: its name, after those of the sections that it is within."""
    if isinstance(section, Each):
        return tuple(_read_one(source, f"[{path}]", each, section) for each in table)
    return _read_one(source, path, table, section)


def _read_one(source: Source, path: str, table: Mapping, section: Section) -> Any:
    place = f"{source.name}: [{path}]"
    variant, table = _chosen(place, source.located(table), section)
    if isinstance(section, OneOf) and section.sized and source.sizes:
        table = source.sizes.fill(place, table, variant.kind)
    label, inner = (
        variant.label or (f"no {section.key!r}" if isinstance(section, OneOf) else ""),
        {},
    )
    if variant.inner:
        _check_keys(place, table, variant.kind, label)
    for field, part in variant.inner.items():
        within = (
            field if variant.named.get("kind") == section.short else f"{path}.{field}"
        )
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


def _choose(place: str, word: object, section: OneOf) -> str:
    if isinstance(section.kinds, Registry):
        return choose_part(section.kinds, place, word)
    if isinstance(word, str) and word in section.elsewhere:
        raise Refusal(
            f"{word!r} is not among {', '.join(section.kinds)}",
            where=place,
            instead=section.elsewhere[word],
        )
    return choose(place, word, section.kinds)


def _chosen(place: str, table: dict, section: Keys | OneOf) -> tuple[Variant, dict]:
    """Return which of the classes a section names, and its other keys."""
    if isinstance(section, Keys):
        return Variant({}, section.kind), table
    if section.key in table:
        name = _choose(f"{place} {section.key}", table[section.key], section)
        table = {key: value for key, value in table.items() if key != section.key}
        if not isinstance(section.kinds[name], OneOf):
            return variant_of(section, name), table
        variant, table = _chosen(place, table, section.kinds[name])
        return variant._replace(named={section.key: name} | dict(variant.named)), table
    alternatives = {
        dataclasses.fields(kind)[0].name: kind for kind in section.otherwise
    }
    for key, kind in alternatives.items():
        if key in table:
            return Variant({}, kind), table
    instead = "".join(f", or {key}" for key in alternatives)
    raise Refusal(
        f"has no {section.key!r}",
        where=place,
        instead=f"add {section.key} = one of {', '.join(section.kinds)}{instead}",
    )


def _from_file(place: str, table: dict, variant: Variant) -> dict:
    """Return the keys of a section with those of its file in place of the file."""
    if not variant.file.keys and {*table} != {"file"}:
        raise Refusal(
            f"{variant.label} takes 'file' and nothing else",
            where=place,
            because=f"a {variant.file.meaning}",
        )
    if "file" not in table:
        return table
    if variant.file.keys:
        variant.alternatives.check(
            place, [spellings(variant.kind).get(key, (key,))[0] for key in table]
        )
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
    """Return a part of a class, or the part that a form of its keys makes, from a table of keys; else raise Refusal.

    inner: fields that are already read. label: how the table names the class."""
    _check_keys(place, table, kind, label)
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
    if alternatives := getattr(kind, "alternatives", None):
        alternatives.check(place, values)
    for field, word in words_of(kind).items():
        if field in values:
            choose(f"{place} {field}", values[field], word.choices)
    if inner and {
        f.name for f in dataclasses.fields(kind) if f.default is f.default_factory
    } <= {*inner}:
        return kind(**inner | values)  # a swimmer, of types that msgspec does not know
    try:
        part = msgspec.convert({**values, **(inner or {})}, kind)
        return (
            part.to_part(source, place, {*values}) if hasattr(kind, "to_part") else part
        )
    except Refusal as refusal:
        raise refusal.within(place) from None
    except (ValueError, OverflowError) as error:
        if isinstance(
            refusal := error.__cause__, Refusal
        ):  # of a class that checks its own values
            refusal.instead = refusal.instead or hints.value_hint(
                refusal.what, table, kind
            )
            raise refusal.within(place) from None
        reason = str(error).replace(" - at `$", " - at `").replace(" - at ``", "")
        message = reason.replace(
            "Object missing required field", "has no"
        )  # msgspec's words
        raise Refusal(
            message, where=place, instead=hints.value_hint(reason, table, kind)
        ) from None


def _check_keys(place: str, table: Mapping, kind: type, label: str) -> None:
    """Raise Refusal for a key that a class has not. label: how the table names the class."""
    try:
        for key in table:
            choose(f"{place} key", key, spellings(kind))
    except Refusal as refusal:
        refusal.instead += f" ({label})" if label else ""
        raise


def _check_degrees(place: str, value) -> None:
    """Warn (`UnitWarning`) of an angle of grains below a degree: measured ones are ten to twenty."""
    if isinstance(value, (int, float)) and 0 < value < 1:
        text = f"{place} = {value:g} is less than a degree: if that is in rad, write gamma0 = {value:g}"
        warnings.warn(text, UnitWarning, stacklevel=2)


def _radians(degrees):
    """Return numbers, and numbers in lists, converted from degrees; other values unchanged, to be refused later."""
    if isinstance(degrees, list):
        return [_radians(x) for x in degrees]
    if (
        isinstance(degrees, (int, float))
        and not isinstance(degrees, bool)
        and abs(degrees) < 1e300
    ):
        return math.radians(degrees)
    return degrees
