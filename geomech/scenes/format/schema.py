"""JSON Schema of a scene file, from the declarations by which the file is read. Editors
complete and check scenes by it."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Collection, Iterator
from typing import Any

from geomech.core.entry_points import unloaded
from geomech.scenes.format.key import Key, first_sentence, keys_of
from geomech.scenes.format.keys import SCENES, all_variants, registry_of
from geomech.scenes.format.sections import (
    Alternatives,
    Declaration,
    Each,
    OneOf,
    Section,
    Variant,
    file_sections,
    keys_in,
)
from geomech.scenes.format.sizes import NOT_OF_THE_BODY, Physical
from geomech.scenes.terradynamics.solid import KINDS as SOLIDS


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file, with a gait, an intruder or a walking
    robot, for the classes that are registered now."""
    declared = {group: file_sections(scene) for group, scene in SCENES.items()}
    groups: dict[str, dict[str, Any]] = {}
    references: dict[str, dict[str, Any]] = {}
    for group, sections in declared.items():
        groups[group] = {}
        references[group] = {}
        for name, (section, *_) in sections.items():
            groups[group][name] = _section(section)
            references[group][name] = {"$ref": f"#/$defs/{group}/{name}"}
    schemas = {
        group: _scene_schema(references[group], declared[group]) for group in groups
    }
    solid = {"required": ["kind"], "properties": {"kind": {"enum": [*SOLIDS]}}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "geomech scene",
        "type": "object",
        "properties": _all_sections(references),
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


def _all_sections(references: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the schemas of sections by name, each of any kind of scene that has it."""
    schemas: dict[str, Any] = {}
    for sections in references.values():
        for name, reference in sections.items():
            schemas.setdefault(name, {"anyOf": []})["anyOf"].append(reference)
    return schemas


def _scene_schema(
    references: dict[str, Any], declared: dict[str, Declaration]
) -> dict[str, Any]:
    """Return the schema of a scene with sections. references: to their schemas, by
    name."""
    required = []
    parts_by_section: dict[str, list[str]] = {}  # parts that may replace a section
    for name, (_, is_required, instead) in declared.items():
        if instead:
            parts = parts_by_section.setdefault(instead, [])
            if is_required:
                parts.append(name)
        elif is_required:
            required.append(name)
    scene = _table("", references, required)
    for section, parts in parts_by_section.items():
        scene |= {"if": {"required": [section]}, "else": {"required": parts}}
    rules = []
    for name, (section, *_) in declared.items():
        rules += _sizes_needed(name, section)
    if rules:
        scene["allOf"] = rules
    return scene


def _section(section: Section | Key) -> dict[str, Any]:
    if isinstance(section, Key):
        return {**section.schema, "description": section.meaning}
    if not isinstance(section, OneOf):
        table, *others = map(_variant, all_variants(section))
        for other in others:
            table["properties"] |= other["properties"]
        return table
    kinds = []
    for variant in all_variants(section):
        elsewhere = _shared(variant) if section.sized else set()
        kinds.append(_variant(variant, elsewhere, section.short))
    registry = registry_of(section)
    if registry is not None:
        # The keys of a part from a package are known once the package is loaded.
        for name in unloaded(registry)[0]:
            kinds.append(
                {
                    "type": "object",
                    "properties": {section.key: {"const": name}},
                    "required": [section.key],
                }
            )
    # With several names left out a table may fit several kinds.
    how = "anyOf" if len(section.implied) > 1 else "oneOf"
    kind = {how: kinds}
    if isinstance(section, Each):
        return {"type": "array", "items": kind}
    return kind


def _variant(
    variant: Variant, elsewhere: Collection[str] = (), short: str = ""
) -> dict[str, Any]:
    """Return the schema of a section of one class. elsewhere: keys that may be given in
    another section. short: the kind whose inner sections may stand by themselves."""
    alternatives = variant.alternatives
    keys = keys_in(variant)
    if alternatives:
        # Their rule says which of the keys are required.
        in_groups = alternatives.keys
        keys = [
            key._replace(required=key.required and key.name not in in_groups)
            for key in keys
        ]
    rules = [_given_once(key) for key in keys if len(key.spellings) > 1]
    for names in _metre_pairs(variant.kind):
        required = names[0] not in elsewhere and _have_no_default(keys, names)
        rules.append(_one_of(names, required))
    if alternatives:
        keys_by_field = {key.alias or key.name: key for key in keys}
        rules.append(_alternatives(alternatives, keys_by_field))

    named = {key: {"const": name} for key, name in variant.named.items()}
    inner = {field: _section(section) for field, section in variant.inner.items()}
    needed = [] if variant.implied else [*named]
    for key in keys:
        if key.required and not key.degrees and key.name not in elsewhere:
            needed.append(key.name)
    if short not in variant.named.values():
        needed += variant.needed
    properties = {**named, **_properties(keys), **inner}
    table = _table(first_sentence(variant.kind), properties, needed)
    if rules:
        table["allOf"] = rules
    return table


def _metre_pairs(kind: type) -> list[tuple[str, str]]:
    """Return the pairs of keys for the same size, in body lengths and in m."""
    metres = getattr(kind, "metres", {})  # of an effect
    return [(name, other.name) for name, other in metres.items()]


def _have_no_default(keys: list[Key], names: tuple[str, str]) -> bool:
    """Return whether neither of two keys has a default, so that one must be given."""
    return all(key.default is None for key in keys if key.name in names)


def _one_of(names: Collection[str], required: bool) -> dict[str, Any]:
    """Return the rule that one of several keys may be given, or must be if
    ``required``."""
    given = [{"required": [name]} for name in names]
    return {"oneOf": given} if required else {"not": {"allOf": given}}


def _given_once(key: Key) -> dict[str, Any]:
    """Return the rule that a key is given under one of its names."""
    return _one_of(key.spellings, key.required)


def _properties(keys: list[Key]) -> dict[str, Any]:
    """Return the schemas of keys by name, and by their other spellings."""
    schemas = {}
    for key in keys:
        schema = {**key.schema, "description": key.meaning}
        if key.unit not in ("", "-"):
            schema["description"] = f"{key.meaning} ({key.unit})"
        if not key.required and key.default is not None:
            schema["default"] = json.loads(key.value)
        schemas[key.name] = schema
        if key.alias:
            schemas[key.alias] = schema
        if key.degrees:
            schemas[f"{key.name}_deg"] = _schema_in_degrees(key)
    return schemas


def _schema_in_degrees(key: Key) -> dict[str, Any]:
    """Return the schema of a key's other spelling, in degrees."""
    schema = {**key.schema, "description": f"{key.meaning} (degrees)"}
    for bound in ("minimum", "maximum"):
        if bound in key.schema:
            schema[bound] = math.degrees(key.schema[bound])
    return schema


def _alternatives(alternatives: Alternatives, keys: dict[str, Key]) -> dict[str, Any]:
    """Return the rule that the keys of one group are given, and none of the others.
    keys: by field."""
    given = {}  # rules that a key is given, one for each of its spellings
    for name in sorted(alternatives.keys):
        given[name] = [{"required": [x]} for x in keys[name].spellings]
    groups = []
    for needed, allowed in alternatives.groups:
        others = []
        for name, rules in given.items():
            if name not in needed | allowed:
                others += rules
        with_one_name = sorted(name for name in needed if len(given[name]) == 1)
        with_several = sorted(name for name in needed if len(given[name]) > 1)
        group = {"required": with_one_name, "not": {"anyOf": others}}
        if with_several:
            group["allOf"] = [{"anyOf": given[name]} for name in with_several]
        groups.append(group)
    return {"oneOf": groups}


def _shared(variant: Variant) -> set[str]:
    """Return the keys of a kind that may be given in [physical]; `_sizes_needed`
    requires them in one of both places."""
    names = {*variant.named.values()}
    shared = set()
    for field in dataclasses.fields(Physical):
        if not names & {*NOT_OF_THE_BODY.get(field.name, ())}:
            shared.add(field.name)
    return shared


def _sizes_needed(name: str, section: Section | Key) -> Iterator[dict[str, Any]]:
    """Yield the rules that a size which a kind requires is given in its section or in
    [physical]."""
    if not isinstance(section, OneOf) or not section.sized:
        return
    for variant in all_variants(section):
        named = {key: {"const": kind} for key, kind in variant.named.items()}
        is_this_kind = {"required": [*named], "properties": named}
        for size in _required_sizes(variant):
            in_physical = {
                "required": ["physical"],
                "properties": {"physical": size},
            }
            rule: dict[str, Any] = {"if": is_this_kind, "then": size}
            if isinstance(section, Each):
                rule = {"items": rule}
            yield {"if": {"not": in_physical}, "then": {"properties": {name: rule}}}


def _required_sizes(variant: Variant) -> list[dict[str, Any]]:
    """Return the rules that the shared sizes which a kind requires are given."""
    keys = keys_of(variant.kind)
    shared = _shared(variant)
    sizes: list[dict[str, Any]] = []
    for key in keys:
        if key.required and key.name in shared:
            sizes.append({"required": [key.name]})
    for names in _metre_pairs(variant.kind):
        if names[0] in shared and _have_no_default(keys, names):
            sizes.append({"anyOf": [{"required": [name]} for name in names]})
    return sizes


def _table(about: str, values: dict[str, Any], required: list[str]) -> dict[str, Any]:
    schema = {
        "type": "object",
        "properties": values,
        "required": required,
        "additionalProperties": False,
    }
    if about:
        return {"description": about, **schema}
    return schema
