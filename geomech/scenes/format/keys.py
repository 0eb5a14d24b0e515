"""Every key of a scene file as text, from the declarations by which the file is read.

`geomech.scenes.format.schema` has them for editors.
"""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterator
from importlib.metadata import EntryPoints, entry_points
from typing import Any, NamedTuple

from geomech.core.entry_points import unloaded
from geomech.core.errors import choose
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes.format.key import Key, first_sentence
from geomech.scenes.format.sections import (
    Each,
    Keys,
    OneOf,
    Section,
    Variant,
    file_sections,
    keys_in,
    variants,
)
from geomech.scenes.model import SWIMMER, Scene
from geomech.scenes.swimming import solvers
from geomech.scenes.terradynamics.intruder import IntruderScene
from geomech.scenes.terradynamics.solid import MeshScene
from geomech.scenes.terradynamics.walker import WalkerScene
from rft.core.registry import Registry

SCENES = {
    "gaits": Scene,
    "outlines": IntruderScene,
    "meshes": MeshScene,
    "walkers": WalkerScene,
}
WORDS = {  # JSON Schema's names of types, in words
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
WIDTH = 120  # characters of a line


class Part(NamedTuple):
    """One kind of a section, as it is listed."""

    title: str
    about: str
    keys: list[Key]


def sections() -> dict[str, list[Part]]:
    """Return the kinds of every section of a scene file, by the section's name. A class
    that several kinds of scene have is listed once."""
    parts_by_section: dict[str, list[Part]] = {"frame": []}
    listed = set()
    installed = entry_points()
    for scene in SCENES.values():
        for name, (section, *_) in file_sections(scene).items():
            parts = parts_by_section.setdefault(name, [])
            if isinstance(section, Key):
                parts.append(Part("above all tables", "", [section]))
                continue
            if isinstance(section, OneOf) and section.meaning:
                parts.append(_naming_key(name, section))
                continue
            for variant in all_variants(section):
                if (name, variant.label, variant.kind) not in listed:
                    parts.append(_part(name, section, variant))
                    listed.add((name, variant.label, variant.kind))
            parts += _package_parts(section, installed)
    return parts_by_section


def _naming_key(name: str, section: OneOf) -> Part:
    """Return the key that names the kind of a section whose other keys are listed
    elsewhere."""
    names = {"type": "string", "enum": [*section.kinds]}
    key = Key(section.key, names, "-", section.meaning, False, None, False)
    title = f"[{name}] of {section.owner}"
    return Part(title, "A key in addition to those above.", [key])


def all_variants(section: Section) -> list[Variant]:
    """Return the variants of a section. [numerics] has those of the tiers and of the
    systems' solvers."""
    if isinstance(section, Keys) and section.kind is Numerics:
        return [Variant({}, kind) for kind in (Numerics, *solvers())]
    return [*variants(section)]


def _header(name: str, section: Section) -> str:
    """Return the line that begins a section."""
    return f"[[{name}]]" if isinstance(section, Each) else f"[{name}]"


def _part(name: str, section: Section, variant: Variant) -> Part:
    """Return a kind of a section, with what a reader needs besides its keys."""
    about = [first_sentence(variant.kind)]
    if isinstance(section, OneOf) and section.short in variant.named.values():
        inner = ", ".join(_header(x, part) for x, part in variant.inner.items())
        about.append(f"Its tables, {inner}, may also be written without this section.")
    elif variant.inner:
        inner = " and ".join(f"[{name}.{part}]" for part in variant.inner)
        listed_in = "intruder"
        for part in variant.inner:
            if part in SWIMMER:
                listed_in = part
                break
        about.append(
            f"The keys of {inner} are listed by 'geomech reference {listed_in}'."
        )
    if variant.implied:
        about.append(f"The key {section.key} may be left out.")
    title = f"{_header(name, section)} {variant.label}".strip()
    if section.owner:
        title += f" of {section.owner}"
    return Part(title, "\n".join(about).strip(), keys_in(variant))


def _package_parts(section: Section, entries: EntryPoints) -> Iterator[Part]:
    """Yield the kinds of a section that installed packages offer."""
    registry = registry_of(section)
    if registry is None:
        return
    new, refused = unloaded(registry, entries)
    for name, package in new.items():
        about = f"Provided by {package}, which is loaded when a scene uses it."
        yield Part(f'{section.key} = "{name}"', about, [])
    for name, package in refused.items():
        about = (
            f"Provided by {package}, but not used: the built-in part of this name "
            "takes precedence."
        )
        yield Part(f'{section.key} = "{name}"', about, [])


def registry_of(section: Section) -> Registry | None:
    """Return the registry of the kinds of a section, None if they are fixed."""
    if isinstance(section, OneOf) and isinstance(section.kinds, Registry):
        return section.kinds
    return None


def names() -> list[str]:
    """Return the names of all sections; those of scenes with a gait come first."""
    return [*sections()]


def text(section: str | None = None) -> str:
    """Return the text of all keys, or of those of one section."""
    parts_by_section = sections()
    names = [*parts_by_section]
    if section is not None:
        names = [choose("SECTION", section, parts_by_section)]
    parts = itertools.chain.from_iterable(parts_by_section[name] for name in names)
    return "\n\n".join(map(_lines, parts)) + "\n"


def _lines(part: Part) -> str:
    """Return the text of a part: title, description and a table of its keys."""
    rows = [(key.name, worded(key.schema), key.unit, key.value) for key in part.keys]
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = [part.title]
    for about in part.about.split("\n"):
        lines += textwrap.wrap(about, WIDTH)
    for key, row in zip(part.keys, rows):
        cells = [f"{x:{width}}" for x, width in zip(row, widths)]
        start = "  " + "  ".join(cells) + "  "
        meaning = key.meaning
        if key.degrees:
            meaning += f"; in degrees as {key.name}_deg"
        lines += textwrap.wrap(
            meaning,
            WIDTH,
            initial_indent=start,
            subsequent_indent=" " * min(len(start), 60),
        )
    return "\n".join(lines)


def worded(schema: dict[str, Any], plural: bool = False) -> str:
    """Return the values that a JSON Schema admits, in words."""
    if "anyOf" in schema:
        others = [x for x in schema["anyOf"] if x.get("type") != "null"]
        return " or ".join(worded(x, plural) for x in others)
    if schema.get("type") == "array":
        inner = schema.get("items") or schema["prefixItems"][0]
        content = worded(inner, plural=True)
        if "minItems" in schema:
            content = f"{schema['minItems']} {content}"
        return f"lists of {content}" if plural else f"list of {content}"
    words = PLURALS if plural else WORDS
    return words.get(schema.get("type", ""), "value")
