"""Declarations: which section of a scene file a field of a scene is, and what may stand in it.

A scene is a dataclass whose fields say so in their annotations:

    @dataclass(frozen=True)
    class IntruderScene:
        medium: Annotated[PlateStress, Keys(StressKeys)]
        intruder: Annotated[Shape, OneOf(SHAPES)]
        elements: Annotated[int, Within("numerics"), Number(1, 5000, "-", "of the outline", whole=True)] = 100
        effects: Annotated[tuple[GroundEffect, ...], Each(EFFECTS)] = ()

`reader`, `write`, `keys` and `schema` walk over these declarations. The keys of a section are the fields of a class, whose
units, bounds and meanings stand there (`geomech.scenes.key`). A class that is not itself the part, but a form of its keys,
has a method ``to_part(source, place, given)`` that returns the part, or a dict of several fields of the scene; given: the
fields that the file gives. makes: the class that it can be written from.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, get_args, get_type_hints

from geomech.scenes.key import Key, keys_of, text_key
from rft.core.refusal import Refusal


class FromFile(NamedTuple):
    """A file, ``key file``, that stands in place of keys of a class: of some, or of all, which a scene can then not give.

    read: function (place, file) that returns values by key. meaning: for lists of keys.
    """

    read: Callable[[str, str], dict[str, Any]]
    meaning: str
    keys: tuple[str, ...] = ()


@dataclass(frozen=True)
class Keys:
    """A section whose keys are the fields of a class. owner: the kind of scene to which it belongs, for lists of keys,
    where several kinds have one."""

    kind: type
    owner: str = ""


@dataclass(frozen=True)
class OneOf:
    """A section that names one of several classes by a key.

    kinds: the classes by name; in place of a class another `OneOf` takes the section's other keys. key: that has the name.
    otherwise: classes of sections without that key, each known by its first field. inner: sections within those of a kind,
    by kind and field. files: that stand in place of keys, by kind. sized: keys that the scene gives once for all its
    parts are put in. short: the kind whose inner sections may stand alone, in place of the section. implied: names that a
    file may leave out. owner: as `Keys.owner`. meaning: of the key, where other sections' lists of keys have the rest.
    elsewhere: by names that it does not take, where these are to be had.
    """

    kinds: Mapping[str, Any]
    key: str = "kind"
    otherwise: tuple[type, ...] = ()
    inner: Mapping[str, Mapping[str, Section]] = field(default_factory=dict)
    files: Mapping[str, FromFile] = field(default_factory=dict)
    sized: bool = False
    short: str = ""
    implied: tuple[str, ...] = ()
    owner: str = ""
    meaning: str = ""
    elsewhere: Mapping[str, str] = field(default_factory=dict)


class Each(OneOf):
    """A list of such sections, one for each part."""


Section = Keys | OneOf


@dataclass(frozen=True)
class Alternatives:
    """Groups of keys of which a section has one.

    groups: the keys that each must have, and those that it may have. cure: what to give. missing: what a section
    without any of the keys lacks.
    """

    groups: tuple[tuple[set[str], set[str]], ...]
    cure: str
    missing: str = ""

    @property
    def keys(self) -> set[str]:
        """The keys of all groups."""
        return set().union(*(needed | allowed for needed, allowed in self.groups))

    def check(self, place: str, given: Collection[str]) -> None:
        """Raise Refusal unless the keys given make one of the groups."""
        present = self.keys & {*given}
        if any(
            needed <= present <= needed | allowed for needed, allowed in self.groups
        ):
            return
        lacking = [
            sorted(needed - present)
            for needed, allowed in self.groups
            if present <= needed | allowed
        ]
        reason = f" has no {', '.join(lacking[0])}" if len(lacking) == 1 else ""
        if self.missing and not present:
            reason = f" has no {self.missing}"
        raise Refusal(f"{place}{reason}", instead=self.cure)


class Within(NamedTuple):
    """The field is a key of a section. owner: as `Keys.owner`."""

    section: str
    owner: str = ""


class Variant(NamedTuple):
    """One kind of a section: keys that name it, with their values, and the class of its other keys."""

    named: Mapping[str, str]
    kind: type
    inner: Mapping[str, Section] = {}
    file: FromFile | None = None
    implied: bool = False

    @property
    def alternatives(self) -> Alternatives | None:
        """Groups of its keys of which one is given, if it has such."""
        if self.file and self.file.keys:
            cure = f"give either 'file' or {', '.join(map(repr, self.file.keys))}"
            return Alternatives((({*self.file.keys}, set()), ({"file"}, set())), cure)
        return getattr(self.kind, "alternatives", None)

    @property
    def needed(self) -> list[str]:
        """Names of the sections within it that a file must have."""
        optional = {
            f.name
            for f in dataclasses.fields(self.kind)
            if f.default is not f.default_factory
        }
        return [name for name in self.inner if name not in optional]

    @property
    def label(self) -> str:
        """The keys that name it, as a file has them."""
        return ", ".join(f'{key} = "{name}"' for key, name in self.named.items())


class Declared(NamedTuple):
    """A section of a file, or a key above all sections. required: it must be there, unless the section ``instead`` is."""

    section: Section | Key
    required: bool = False
    instead: str = ""


def variants(section: Keys | OneOf) -> Iterator[Variant]:
    """Yield the variants of a section."""
    if isinstance(section, Keys):
        yield Variant({}, section.kind)
        return
    for kind in section.otherwise:
        yield Variant({}, kind)
    for name, kind in section.kinds.items():
        if isinstance(kind, OneOf):
            for other in variants(kind):
                yield other._replace(named={section.key: name} | dict(other.named))
        else:
            yield variant_of(section, name)


def variant_of(section: OneOf, name: str) -> Variant:
    """Return the variant of a section that a name selects."""
    more = section.inner.get(name, {}), section.files.get(name), name in section.implied
    return Variant({section.key: name}, section.kinds[name], *more)


def keys_in(variant: Variant) -> list[Key]:
    """Return the keys of a section, but for those that name it and those of sections within it."""
    keys = [key for key in keys_of(variant.kind) if key.name not in variant.inner]
    if not variant.file:
        return keys
    file = text_key("file", variant.file.meaning, required=not variant.file.keys)
    return [file, *keys] if variant.file.keys else [file]


@functools.cache
def sections_of(scene: type) -> dict[str, Declared]:
    """Return the sections that the fields of a scene declare, by name. Fields within one section make one, of a class of
    their own."""
    hints = get_type_hints(scene, include_extras=True)
    declared: dict[str, Declared] = {}
    within: dict[Within, list] = {}
    for part in dataclasses.fields(scene):
        for mark in get_args(hints[part.name])[1:]:
            if isinstance(mark, Section):
                required = part.default is part.default_factory is dataclasses.MISSING
                declared[part.name] = Declared(mark, required)
            elif isinstance(mark, Within):
                within.setdefault(mark, []).append(
                    (part.name, hints[part.name], part.default)
                )
    for (name, owner), keys in within.items():
        form = {
            "makes": scene,
            "to_part": lambda self, source, place, given: vars(self),
        }
        kind = dataclasses.make_dataclass(name.title(), keys, namespace=form)
        kind.__doc__ = ""  # in place of a signature
        declared[name] = Declared(Keys(kind, owner))
    return declared


def file_sections(scene: type) -> dict[str, Declared]:
    """Return the sections that a scene's file may have: those of its fields, those that replace another one, and those
    that apply to the whole scene (``once``)."""
    declared: dict[str, Declared] = {}
    for name, (section, required, _) in sections_of(scene).items():
        parts = (
            section.inner[section.short]
            if isinstance(section, OneOf) and section.short
            else {}
        )
        declared |= {
            part: Declared(inner, not isinstance(inner, Each), name)
            for part, inner in parts.items()
        }
        declared[name] = Declared(section, required and not parts)
    return declared | {
        name: Declared(section) for name, section in getattr(scene, "once", {}).items()
    }
