"""The writer of a scene's TOML: reading it gives the same scene."""

from __future__ import annotations

import dataclasses
import json
import math
import textwrap
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geomech.mathematics.gaits import Circle, Gait
from geomech.mathematics.gaits.wound import unwound
from geomech.mathematics.systems.base import unwrapped
from geomech.mathematics.systems.capabilities import solver_of
from geomech.mathematics.systems.framed import Framed
from geomech.mathematics.systems.swimmer import Swimmer, name_in
from geomech.mathematics.systems.table import Table
from geomech.scenes.format.key import angles_of, key_fields
from geomech.scenes.format.sections import (
    Each,
    Keys,
    Section,
    Variant,
    sections_of,
    variants,
)
from geomech.scenes.medium import MEDIUM
from geomech.scenes.model import SWIMMER, Scene, checked_scene
from geomech.scenes.read import from_tables
from rft.core.refusal import Refusal, located
from rft.terradynamics.plates.stress import COEFFICIENTS

if TYPE_CHECKING:
    from geomech.scenes.terradynamics.intruding import Intruding
    from geomech.scenes.terradynamics.walker import WalkerScene

COMMENT_WIDTH = 110  # characters of a line of comments, without the mark


def toml(scene: Scene | Intruding | WalkerScene) -> str:
    """Return a scene as a TOML text that is valid by itself and in any folder.

    It is the text from which the scene was read, with its comments, if that is valid by
    itself; else a new one, with the law and numbers of a medium that came from a file,
    and the folders of other files. Refusal if the scene has a part that no scene file
    can name.

    Examples
    --------
    >>> import geomech
    >>> medium = geomech.media.Viscous(3.0)
    >>> gait = geomech.mathematics.gaits.Circle(0.5)
    >>> scene = geomech.study(medium, geomech.bodies.Chain(), gait).scene
    >>> print(geomech.toml(scene).partition("[body]")[0].strip())
    [medium]
    law = "viscous"
    ratio = 3.0
    """
    tables = tomllib.loads(_checked(scene).text)
    needs_files = isinstance(scene, Scene) and (
        scene.files or _names_relative_file(tables)
    )
    if scene.text and not needs_files and _describe(tables, scene):
        return scene.text
    return text_of(_written_tables(scene))


def _describe(tables: dict, scene: Scene | Intruding | WalkerScene) -> bool:
    """Return whether tables describe a scene as it is now."""
    return from_tables(tables, scene.name, scene.text) == scene


def _checked(scene: Scene | Intruding | WalkerScene) -> Scene | Intruding | WalkerScene:
    """Return a scene of any kind; Refusal if it is none."""
    if hasattr(type(scene), "example"):
        return scene
    return checked_scene(scene)


def _names_relative_file(tables: dict) -> bool:
    """Return whether tables name a file by a path relative to the scene's own."""
    files = [tables.get(place, {}).get("file", "") for place in ("gait", "system")]
    return any(file and not Path(file).is_absolute() for file in files)


def table(name: str, values: dict) -> str:
    """Return one table as TOML."""
    return text_of({name: values})


def gait_table(gait: Gait) -> dict:
    """Return the table [gait] of a gait."""
    return _section(unwound(gait), sections_of(Scene)["gait"].section)


def medium_toml(name: str, entry) -> str:
    """Return the table of a medium of the catalogue (`rft.laws.catalogue.Entry`), with
    its source in comments above."""
    lines = textwrap.wrap(f"{name}: {entry.source}", COMMENT_WIDTH)
    if entry.axial_stress is not None:
        lines.append(
            "axial drag over projected area at 7.62 cm depth: "
            f"{entry.axial_stress:g} Pa"
        )
    for key in sorted(angles_of(type(entry.medium))):
        degrees = math.degrees(getattr(entry.medium, key))
        lines.append(f"{key} = {degrees:.6g} degrees")
    return _comments(lines) + table("medium", _section(entry.medium, MEDIUM))


def vertical_toml(name: str, entry) -> str:
    """Return the table of a medium of intruder scenes
    (`rft.terradynamics.plates.VerticalEntry`), with its source in comments above."""
    lines = textwrap.wrap(f"{name}: {entry.source}", COMMENT_WIDTH)
    lines.append("coefficients in N/cm^3, times zeta")
    stress = dataclasses.asdict(entry.stress)
    values = {key.replace("m", "-"): stress[key] for key in COEFFICIENTS}
    values["zeta"] = stress["zeta"]
    return _comments(lines) + table("medium", values)


def _comments(lines: list[str]) -> str:
    return "".join(f"# {line}\n" for line in lines)


def tables(scene: Scene | Intruding | WalkerScene) -> dict:
    """Return the tables of a scene: those of its text, with its present numerics, if
    they describe it; else new ones.

    Examples
    --------
    >>> from geomech.scenes import load, tables
    >>> tables(load("three-link-viscous"))["gait"]["kind"]
    'circle'
    """
    read = tomllib.loads(_checked(scene).text)
    if isinstance(scene, Scene):
        read["numerics"] = _numerics(scene)
    # A medium from a file can be swept only if the scene itself has its numbers.
    needs_files = isinstance(scene, Scene) and scene.files
    if scene.text and not needs_files and _describe(read, scene):
        return read
    return _written_tables(scene)


def without_gait(scene: Scene, spell_out: bool = False) -> dict:
    """Return the tables of a scene without its gait, valid in any folder: those of its
    text if they are, else new ones. Refusal if no file can name one of its parts, other
    than the gait. spell_out: replace the name of the medium by its law and parameters.

    Examples
    --------
    >>> from geomech.scenes import load
    >>> from geomech.scenes.write import without_gait
    >>> list(without_gait(load("three-link-viscous")))
    ['medium', 'body']
    """
    stand_in = Circle(frequency=getattr(checked_scene(scene).gait, "frequency", None))
    plain = scene.changed(gait=stand_in)
    read = tomllib.loads(scene.text) | {"gait": gait_table(stand_in)}
    needs_files = scene.files or _names_relative_file(read)
    if scene.text and not needs_files and _describe(read, plain):
        tables = read
    else:
        tables = _written_tables(plain)
    if spell_out:
        tables = with_law(tables, scene)
    return {name: table for name, table in tables.items() if name != "gait"}


def with_law(tables: dict, scene: Scene) -> dict:
    """Return the scene's tables with the law and its parameters in place of the name of
    its medium."""
    if "name" not in tables.get("medium", {}):
        return tables
    return {**tables, "medium": _section(scene.system.medium, MEDIUM)}


def _written_tables(scene: Scene | Intruding | WalkerScene) -> dict:
    """Return the tables of a scene's parts; Refusal if a file cannot name one of
    them."""
    with located(scene.name):
        tables = {}
        for name, (section, *_) in sections_of(type(scene)).items():
            # A section without a field of its own has fields of the scene as keys.
            part = getattr(scene, name, scene)
            table = section_tables(_nameable(unwound(part)), section)
            if table:
                tables[name] = table
        if isinstance(scene, Scene):
            tables = _shortened(tables, scene)
        if from_tables(tables, scene.name) != scene:
            raise Refusal("a part of this scene has no kind that a scene file can name")
        return tables


def section_tables(part: Any, section: Section) -> dict | list[dict]:
    """Return the table of a section, or a list of tables if the section is one for each
    part; Refusal if no file can name the part."""
    if isinstance(section, Each):
        return [_section(each, section) for each in part]
    return _section(part, section)


def _section(part: Any, section: Section) -> dict:
    for variant in variants(section):
        fits = type(part) is getattr(variant.kind, "makes", variant.kind)
        is_from_file = variant.file and not variant.file.keys
        if fits and not is_from_file:
            return _variant_table(part, variant)
        if fits or isinstance(section, Keys):
            raise Refusal(
                f"a {type(part).__name__} is stored in a separate CSV file",
                instead="write the scene that names this file yourself",
            )
    kind = name_in(section.kinds, part)
    raise Refusal(
        f"a {kind} has no kind that a scene file can name",
        instead=f"use one of {', '.join(section.kinds)}",
    )


def _variant_table(part: Any, variant: Variant) -> dict:
    """Return the table of a part of a kind, with the tables within it."""
    table = {**variant.named, **_keys(part, variant.kind)}
    for field, section in variant.inner.items():
        inner_part = getattr(part, field)
        if inner_part is not None:
            table[field] = section_tables(inner_part, section)
    return table


def _shortened(tables: dict, scene: Scene) -> dict:
    """Return tables with the parts of a swimmer in place of [system]. Values that apply
    to the whole scene appear once."""
    system = tables.pop("system")
    effects = []
    if isinstance(_nameable(scene.system), Swimmer):
        parts = {part: system[part] for part in SWIMMER if system.get(part)}
        tables = parts | tables
        effects = tables.get("effects", [])
    else:
        tables = {"system": system} | tables
    for part in ("body", "system"):
        table = tables.get(part, {})
        # A table keeps its frame: without one it would have that of its file.
        if "frame" in table and table.get("kind") != Table.kind:
            del table["frame"]
            if scene.frame != "mean":
                tables = {"frame": scene.frame} | tables
    if "frequency" in tables["gait"]:
        for effect in effects:
            effect.pop("frequency", None)
    return tables | {"numerics": _numerics(scene)}


def _nameable(part: Any) -> Any:
    """Return the object inside a part that a scene file can name."""
    if isinstance(part, Framed):
        return _nameable(part.inner)
    return unwrapped(part)


def _numerics(scene: Scene) -> dict:
    """Return [numerics]: the keys of the tiers, and those of the system's solver."""
    keys = _keys(scene.numerics, type(scene.numerics))
    solver = solver_of(scene.system)
    if solver:
        keys |= _keys(solver, type(solver))
    return keys


def _keys(part: Any, kind: type) -> dict:
    """Return the keys of a class, as in a file, for which a part has a value."""
    keys = {}
    for field in key_fields(kind):
        value = getattr(part, field.name, None)
        if value is not None:
            keys[field.name] = _plain(value)
    return keys


def _plain(value: Any) -> Any:
    """Return NumPy's numbers and arrays as Python's numbers and lists."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (tuple, list)):
        return [_plain(x) for x in value]
    return value


def text_of(tables: dict) -> str:
    """Return the tables of a scene as TOML."""
    # Keys above all tables come first, as TOML would take them for keys of a table.
    lines = [
        f"{key} = {_value(x)}"
        for key, x in tables.items()
        if not isinstance(x, (dict, list))
    ]
    for name, table in tables.items():
        if isinstance(table, dict):
            lines += _table_lines(f"[{name}]", table)
        elif isinstance(table, list):
            for each in table:
                lines += _table_lines(f"[[{name}]]", each)
    return "\n".join(lines).lstrip("\n") + "\n"


def _table_lines(header: str, table: dict) -> list[str]:
    return ["", header, *(f"{key} = {_value(x)}" for key, x in table.items())]


def _value(x: Any) -> str:
    """Return a value as TOML: strings and lists as in JSON, numbers as in Python."""
    if isinstance(x, list):
        return f"[{', '.join(map(_value, x))}]"
    if isinstance(x, dict):
        entries = ", ".join(f"{key} = {_value(y)}" for key, y in x.items())
        return f"{{ {entries} }}"
    if isinstance(x, (str, bool)):
        # TOML allows no DEL as it is, JSON does
        return json.dumps(x, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(x)
