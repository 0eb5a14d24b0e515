"""Every key of a scene file, from the declarations by which it is read: as text to read (`geomech.scenes.schema` has them for
editors)."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from importlib.metadata import EntryPoints, entry_points
from typing import Any, NamedTuple

from geomech.core.entry_points import unloaded
from geomech.core.errors import choose
from geomech.scenes.intruder import IntruderScene
from geomech.scenes.key import Key, first_sentence
from geomech.scenes.model import SWIMMER, Scene
from geomech.scenes.sections import (
    Each,
    Keys,
    OneOf,
    Section,
    Variant,
    file_sections,
    keys_in,
    variants,
)
from geomech.scenes.solid import MeshScene
from geomech.scenes.swimming import solvers
from geomech.scenes.walker import WalkerScene
from geomech.tiers.base import Numerics
from rft.core.registry import Registry

SCENES = {
    "gaits": Scene,
    "outlines": IntruderScene,
    "meshes": MeshScene,
    "walkers": WalkerScene,
}
WORDS = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
}
PLURALS = {
    "number": "numbers",
    "integer": "whole numbers",
    "string": "texts",
    "boolean": "truths",
}
WIDTH = 120


class Part(NamedTuple):
    """One kind of a section, as it is listed."""

    title: str
    about: str
    keys: list[Key]


def sections() -> dict[str, list[Part]]:
    """Return the kinds of every section of a scene file; a class that several kinds of scene have is listed once."""
    parts_of: dict[str, list[Part]] = {"frame": []}
    listed, installed = set(), entry_points()
    for scene in SCENES.values():
        for name, (section, *_) in file_sections(scene).items():
            parts = parts_of.setdefault(name, [])
            if isinstance(section, Key):
                parts.append(Part("above all tables", "", [section]))
                continue
            if isinstance(section, OneOf) and section.meaning:
                names = {"type": "string", "enum": [*section.kinds]}
                key = Key(section.key, names, "-", section.meaning, False, None, False)
                parts.append(
                    Part(
                        f"[{name}] of {section.owner}", "Besides the keys above.", [key]
                    )
                )
                continue
            for variant in all_variants(section):
                if (name, variant.label, variant.kind) not in listed:
                    parts.append(_part(name, section, variant))
                    listed.add((name, variant.label, variant.kind))
            parts += _package_parts(section, installed)
    return parts_of


def all_variants(section: Section) -> list[Variant]:
    """Return the variants of a section; [numerics] has those of the tiers and of systems' solvers together."""
    kinds = (
        [Numerics, *solvers()]
        if isinstance(section, Keys) and section.kind is Numerics
        else []
    )
    return [Variant({}, kind) for kind in kinds] or [*variants(section)]


def _part(name: str, section: Section, variant: Variant) -> Part:
    head = f"[[{name}]]" if isinstance(section, Each) else f"[{name}]"
    about = [first_sentence(variant.kind)]
    if isinstance(section, OneOf) and section.short in variant.named.values():
        inner = ", ".join(
            f"[[{x}]]" if isinstance(part, Each) else f"[{x}]"
            for x, part in variant.inner.items()
        )
        about.append(f"Its tables, {inner}, may as well stand by themselves.")
    elif variant.inner:
        inner = " and ".join(f"[{name}.{part}]" for part in variant.inner)
        where = [part for part in variant.inner if part in SWIMMER] or ["intruder"]
        about.append(f"'geomech reference {where[0]}' has the keys of {inner}.")
    if variant.implied:
        about.append(f"It need not say its {section.key}.")
    owner = f" of {section.owner}" if section.owner else ""
    return Part(
        f"{head} {variant.label}".strip() + owner,
        "\n".join(about).strip(),
        keys_in(variant),
    )


def _package_parts(section: Section, entries: EntryPoints) -> Iterator[Part]:
    """Yield the parts of installed packages."""
    if (registry := registry_of(section)) is not None:
        new, refused = unloaded(registry, entries)
        for name, package in new.items():
            yield Part(
                f'{section.key} = "{name}"',
                f"Of {package}, which is loaded when a scene asks for it.",
                [],
            )
        for name, package in refused.items():
            reason = f"Not that of {package}, which is refused: the one that is built in has this name."
            yield Part(f'{section.key} = "{name}"', reason, [])


def registry_of(section: Section) -> Registry | None:
    """Return the registry of the names that a section may have, None if these are fixed."""
    return (
        section.kinds
        if isinstance(section, OneOf) and isinstance(section.kinds, Registry)
        else None
    )


def names() -> list[str]:
    """Return the names of all sections, those of scenes with a gait first."""
    return [*sections()]


def text(section: str | None = None) -> str:
    """Return the text of all keys, or of those of one section."""
    parts = sections()
    names = [*parts] if section is None else [choose("SECTION", section, parts)]
    return "\n\n".join(_lines(part) for name in names for part in parts[name]) + "\n"


def _lines(part: Part) -> str:
    """Return the keys of a part as lines."""
    rows = [(key.name, worded(key.schema), key.unit, key.value) for key in part.keys]
    widths = [max(map(len, column)) for column in zip(*rows)]  # none without keys
    lines = [part.title]
    for about in part.about.split("\n"):
        lines += textwrap.wrap(about, WIDTH)
    for key, row in zip(part.keys, rows):
        start = "  " + "".join(f"{x:{width}}  " for x, width in zip(row, widths))
        meaning = key.meaning + f"; in degrees as {key.name}_deg" * key.degrees
        lines += textwrap.wrap(
            meaning,
            WIDTH,
            initial_indent=start,
            subsequent_indent=" " * min(len(start), 60),
        )
    return "\n".join(lines)


def worded(schema: dict[str, Any], several: bool = False) -> str:
    """Return the values that a JSON Schema admits, in words."""
    if "anyOf" in schema:
        return " or ".join(
            worded(x, several) for x in schema["anyOf"] if x.get("type") != "null"
        )
    if schema.get("type") == "array":
        inner = schema.get("items") or schema["prefixItems"][0]
        count = f"{schema['minItems']} " if "minItems" in schema else ""
        return f"list{'s' * several} of {count}{worded(inner, True)}"
    return (PLURALS if several else WORDS).get(schema.get("type", ""), "value")
