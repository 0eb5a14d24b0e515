"""Declarations of the sections of a scene file, and of what may stand in them.

A scene is a dataclass whose fields declare their sections in annotations:

    @dataclass(frozen=True)
    class IntruderScene:
        medium: Annotated[PlateStress, Keys(StressKeys)]
        intruder: Annotated[Shape, OneOf(SHAPES)]
        elements: Annotated[
            int, Within("numerics"), Number(1, 5000, "-", "of the outline", whole=True)
        ] = 100
        effects: Annotated[tuple[GroundEffect, ...], Each(EFFECTS)] = ()

`reader`, `write`, `keys` and `schema` follow these declarations. The keys of a section
are the fields of a class, where their units, bounds and meanings stand
(`geomech.scenes.format.key`). The class is that of the part, or only has its keys. In
the second case it has a method ``to_part(source, place, given)`` that returns the part,
or a dict of several fields of the scene (given: the fields in the file), and an
attribute ``makes``, the class of parts that it can write.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, get_args, get_type_hints

from geomech.scenes.format.key import Key, keys_of, text_key
from rft.core.refusal import Refusal


class FromFile(NamedTuple):
    """A file, by the key ``file``, in place of keys of a class.

    read: function (place, file) that returns values by key. meaning: for lists of keys.
    keys: that a scene may give in place of the file; if empty the file has all keys.
    """

    read: Callable[[str, str], dict[str, Any]]
    meaning: str
    keys: tuple[str, ...] = ()


@dataclass(frozen=True)
class Keys:
    """A section whose keys are the fields of a class. owner: the kind of scene to which
    it belongs, for lists of keys, where several kinds have such a section."""

    kind: type
    owner: str = ""


@dataclass(frozen=True)
class OneOf:
    """A section that names one of several classes by a key.

    kinds: the classes by name; in place of a class may stand another `OneOf`, for the
    section's other keys. key: that has the name. otherwise: classes of sections without
    that key, each recognised by its first field. inner: sections within a kind, by kind
    and field. files: in place of keys, by kind. sized: whether sizes that the scene
    gives once for all parts are filled in. short: the kind whose inner sections may
    stand by themselves, in place of the section. implied: names that a file may leave
    out. owner: as `Keys.owner`. meaning: of the key, where the other keys are listed
    with another section. elsewhere: what to use instead, by names that it does not
    take.
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

    groups: (keys that the group must have, keys that it may have). cure: what to give.
    missing: what a section without any of the keys lacks, in words.
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
        lacking = []  # keys, of the groups that have all that are present
        for needed, allowed in self.groups:
            if present <= needed | allowed:
                if needed <= present:
                    return
                lacking.append(sorted(needed - present))
        what = place
        if self.missing and not present:
            what = f"{place} has no {self.missing}"
        elif len(lacking) == 1:
            what = f"{place} has no {', '.join(lacking[0])}"
        raise Refusal(what, instead=self.cure)


class Within(NamedTuple):
    """The field is a key of a section. owner: as `Keys.owner`."""

    section: str
    owner: str = ""


class Variant(NamedTuple):
    """One kind of a section.

    named: keys that name it, with their values. kind: the class of its other keys.
    inner, file, implied: as in `OneOf`."""

    named: Mapping[str, str]
    kind: type
    inner: Mapping[str, Section] = {}
    file: FromFile | None = None
    implied: bool = False

    @property
    def alternatives(self) -> Alternatives | None:
        """Groups of its keys of which one is given; None where there are none."""
        if self.file and self.file.keys:
            no_keys: set[str] = set()
            by_keys = ({*self.file.keys}, no_keys)
            by_file = ({"file"}, no_keys)
            cure = f"give either 'file' or {', '.join(map(repr, self.file.keys))}"
            return Alternatives((by_keys, by_file), cure)
        return getattr(self.kind, "alternatives", None)

    @property
    def needed(self) -> list[str]:
        """Names of the sections within it that a file must have."""
        fields = dataclasses.fields(self.kind)
        optional = {f.name for f in fields if f.default is not f.default_factory}
        return [name for name in self.inner if name not in optional]

    @property
    def label(self) -> str:
        """The keys that name it, as in a file."""
        return ", ".join(f'{key} = "{name}"' for key, name in self.named.items())


class Declaration(NamedTuple):
    """A section of a file, or a key above all sections. required: it must be there,
    unless the section ``instead`` is."""

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
    return Variant(
        {section.key: name},
        section.kinds[name],
        inner=section.inner.get(name, {}),
        file=section.files.get(name),
        implied=name in section.implied,
    )


def keys_in(variant: Variant) -> list[Key]:
    """Return the keys of a section, without those that name it and those of sections
    within it."""
    keys = [key for key in keys_of(variant.kind) if key.name not in variant.inner]
    if not variant.file:
        return keys
    file = text_key("file", variant.file.meaning, required=not variant.file.keys)
    if variant.file.keys:
        return [file, *keys]
    return [file]


@functools.cache
def sections_of(scene: type) -> dict[str, Declaration]:
    """Return the sections that the fields of a scene declare, by name. Fields that are
    keys of a section (`Within`) are put together into a class."""
    hints = get_type_hints(scene, include_extras=True)
    declared: dict[str, Declaration] = {}
    within: dict[Within, list] = {}
    for part in dataclasses.fields(scene):
        for mark in get_args(hints[part.name])[1:]:
            if isinstance(mark, Section):
                required = part.default is part.default_factory is dataclasses.MISSING
                declared[part.name] = Declaration(mark, required)
            elif isinstance(mark, Within):
                within.setdefault(mark, []).append(
                    (part.name, hints[part.name], part.default)
                )

    def to_part(self, source, place, given):
        return vars(self)

    for (name, owner), keys in within.items():
        members = {"makes": scene, "to_part": to_part}
        kind = dataclasses.make_dataclass(name.title(), keys, namespace=members)
        kind.__doc__ = ""  # in place of a signature
        declared[name] = Declaration(Keys(kind, owner))
    return declared


def file_sections(scene: type) -> dict[str, Declaration]:
    """Return the sections that a scene's file may have, by name: those of its fields,
    those that replace another one, and those that apply to the whole scene
    (``once``)."""
    declared: dict[str, Declaration] = {}
    for name, (section, required, _) in sections_of(scene).items():
        parts: Mapping[str, Section] = {}
        needed: list[str] = []
        if isinstance(section, OneOf) and section.short:
            short = variant_of(section, section.short)
            parts = short.inner
            needed = short.needed
        for part, inner in parts.items():
            declared[part] = Declaration(inner, part in needed, instead=name)
        declared[name] = Declaration(section, required and not parts)
    for name, section in getattr(scene, "once", {}).items():
        declared[name] = Declaration(section)
    return declared
