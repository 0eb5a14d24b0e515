"""JSON Schema of a scene file, from the declarations by which it is read: for editors, which complete and check scenes."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Collection, Iterator
from typing import Any

from geomech.core.entry_points import unloaded
from geomech.scenes.key import Key, first_sentence, keys_of
from geomech.scenes.keys import SCENES, all_variants, registry_of
from geomech.scenes.sections import (
    Alternatives,
    Declared,
    Each,
    OneOf,
    Section,
    Variant,
    file_sections,
    keys_in,
)
from geomech.scenes.sizes import NOT_OF_THE_BODY, Physical
from geomech.scenes.solid import KINDS as SOLIDS


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file, with a gait, an intruder or a robot that walks; its classes are those
    registered now."""
    declared = {group: file_sections(scene) for group, scene in SCENES.items()}
    groups = {
        group: {name: _section(section) for name, (section, *_) in sections.items()}
        for group, sections in declared.items()
    }
    named = {
        group: {name: {"$ref": f"#/$defs/{group}/{name}"} for name in sections}
        for group, sections in groups.items()
    }
    schemas = {group: _scene_schema(named[group], declared[group]) for group in groups}
    solid = {"required": ["kind"], "properties": {"kind": {"enum": [*SOLIDS]}}}
    all_names = dict.fromkeys(name for sections in named.values() for name in sections)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "geomech scene",
        "type": "object",
        "properties": {
            name: {
                "anyOf": [
                    sections[name] for sections in named.values() if name in sections
                ]
            }
            for name in all_names
        },
        "additionalProperties": False,
        "if": {"required": ["robot"]},
        "then": schemas["walkers"],
        "else": {
            "if": {"anyOf": [{"required": ["intruder"]}, {"required": ["motion"]}]},
            "then": {
                "if": {"required": ["intruder"], "properties": {"intruder": solid}},
                "then": schemas["meshes"],
                "else": schemas["outlines"],
            },
            "else": schemas["gaits"],
        },
        "$defs": groups,
    }


def _scene_schema(
    named: dict[str, Any], declared: dict[str, Declared]
) -> dict[str, Any]:
    """Return the schema of a scene of sections, by their names in ``named``."""
    scene = _table(
        "",
        named,
        [
            name
            for name, (_, required, instead) in declared.items()
            if required and not instead
        ],
    )
    for name in {each.instead for each in declared.values() if each.instead}:
        parts = [
            part
            for part, (_, required, instead) in declared.items()
            if required and instead == name
        ]
        scene |= {"if": {"required": [name]}, "else": {"required": parts}}
    sizes = [
        rule
        for name, (section, *_) in declared.items()
        for rule in _sizes_needed(name, section)
    ]
    return scene | ({"allOf": sizes} if sizes else {})


def _section(section: Section | Key) -> dict[str, Any]:
    if isinstance(section, Key):
        return {**section.schema, "description": section.meaning}
    if not isinstance(section, OneOf):
        one, *others = (_variant(variant) for variant in all_variants(section))
        for other in others:
            one["properties"] |= other["properties"]
        return one
    kinds = [
        _variant(each, _shared(each) if section.sized else (), section.short)
        for each in all_variants(section)
    ]
    if (
        registry := registry_of(section)
    ) is not None:  # the keys of what packages offer are known when it is loaded
        for other in unloaded(registry)[0]:
            kinds.append(
                {
                    "type": "object",
                    "properties": {section.key: {"const": other}},
                    "required": [section.key],
                }
            )
    one = {"anyOf" if len(section.implied) > 1 else "oneOf": kinds}
    return {"type": "array", "items": one} if isinstance(section, Each) else one


def _variant(
    variant: Variant, elsewhere: Collection[str] = (), short: str = ""
) -> dict[str, Any]:
    """Return the schema of a section of one class. elsewhere: keys that may be given in another section. short: the kind
    whose inner sections may be, too."""
    alternatives = variant.alternatives
    either = alternatives.keys if alternatives else ()
    keys = [
        key._replace(required=key.required and key.name not in either)
        for key in keys_in(variant)
    ]
    named = {key: {"const": name} for key, name in variant.named.items()}
    inner = {field: _section(section) for field, section in variant.inner.items()}
    needed = [*(named if not variant.implied else ())]
    needed += [
        key.name
        for key in keys
        if key.required and not key.degrees and key.name not in elsewhere
    ]
    if short not in variant.named.values():
        needed += variant.needed
    rules = [_spelled(key) for key in keys if len(key.spellings) > 1]
    for names in _either(variant.kind):
        rules.append(_once(names, names[0] not in elsewhere and _lacks(keys, names)))
    if alternatives:
        rules.append(
            _alternatives(alternatives, {key.alias or key.name: key for key in keys})
        )
    table = _table(
        first_sentence(variant.kind), {**named, **_properties(keys), **inner}, needed
    )
    return table | ({"allOf": rules} if rules else {})


def _either(kind: type) -> list[tuple[str, str]]:
    """Return the pairs of keys of which one is in body lengths and the other in m."""
    metres = getattr(kind, "metres", {})  # of an effect
    return [(name, other.name) for name, other in metres.items()]


def _lacks(keys: list[Key], names: tuple[str, str]) -> bool:
    """Return whether neither of two keys has a value where both are left out."""
    return all(key.default is None for key in keys if key.name in names)


def _once(names: Collection[str], required: bool) -> dict[str, Any]:
    """Return the rule that one of several keys is given, if it must be, and not two."""
    given = [{"required": [name]} for name in names]
    return {"oneOf": given} if required else {"not": {"allOf": given}}


def _properties(keys: list[Key]) -> dict[str, Any]:
    """Return the schemas of keys by name, and by their other spellings."""
    schemas = {}
    for key in keys:
        unit = f" ({key.unit})" if key.unit not in ("", "-") else ""
        more = (
            {}
            if key.required or key.default is None
            else {"default": json.loads(key.value)}
        )
        for name in (key.name, *[key.alias] * bool(key.alias)):
            schemas[name] = {
                **key.schema,
                "description": f"{key.meaning}{unit}",
                **more,
            }
        if key.degrees:
            bounds = {
                x: math.degrees(key.schema[x])
                for x in ("minimum", "maximum")
                if x in key.schema
            }
            schemas[f"{key.name}_deg"] = {
                **key.schema,
                **bounds,
                "description": f"{key.meaning} (degrees)",
            }
    return schemas


def _spelled(key: Key) -> dict[str, Any]:
    """Return the rule that a key is given once, if it must be given, and not twice."""
    return _once(key.spellings, key.required)


def _alternatives(alternatives: Alternatives, keys: dict[str, Key]) -> dict[str, Any]:
    """Return the rule that one group of keys is given, and none of the others."""
    given = {
        name: [{"required": [spelling]} for spelling in keys[name].spellings]
        for name in sorted(alternatives.keys)
    }
    groups = []
    for needed, allowed in alternatives.groups:
        several = [
            {"anyOf": given[name]} for name in sorted(needed) if len(given[name]) > 1
        ]
        others = [
            rule
            for name in given
            if name not in needed | allowed
            for rule in given[name]
        ]
        groups.append(
            {
                "required": sorted(name for name in needed if len(given[name]) == 1),
                "not": {"anyOf": others},
            }
        )
        groups[-1] |= {"allOf": several} if several else {}
    return {"oneOf": groups}


def _shared(variant: Variant) -> set[str]:
    """Return the keys of a kind that [physical] may give; `_sizes_needed` asks for them there."""
    names = {*variant.named.values()}
    return {
        f.name
        for f in dataclasses.fields(Physical)
        if not names & {*NOT_OF_THE_BODY.get(f.name, ())}
    }


def _sizes_needed(name: str, section: Section | Key) -> Iterator[dict[str, Any]]:
    """Yield the rules that a size which a kind must have is given there or in [physical]."""
    for variant in (
        all_variants(section) if isinstance(section, OneOf) and section.sized else ()
    ):
        keys = keys_of(variant.kind)
        sizes = [
            {"required": [key.name]}
            for key in keys
            if key.required and key.name in _shared(variant)
        ]
        for names in _either(variant.kind):
            if names[0] in _shared(variant) and _lacks(keys, names):
                sizes.append({"anyOf": [{"required": [name]} for name in names]})
        for size in sizes:
            given = {
                "required": ["physical"],
                "properties": {"physical": size},
            }
            named = {key: {"const": kind} for key, kind in variant.named.items()}
            rule = {
                "if": {"required": [*named], "properties": named},
                "then": size,
            }
            within = {"items": rule} if isinstance(section, Each) else rule
            yield {"if": {"not": given}, "then": {"properties": {name: within}}}


def _table(about: str, values: dict[str, Any], required: list[str]) -> dict[str, Any]:
    schema = {
        "type": "object",
        "properties": values,
        "required": required,
        "additionalProperties": False,
    }
    return {"description": about, **schema} if about else schema
