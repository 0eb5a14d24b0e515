"""The writer of a scene's TOML: reading it gives the same scene."""

from __future__ import annotations

import dataclasses
import json
import math
import textwrap
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geomech.gaits import Circle, Gait
from geomech.scenes.key import angles_of
from geomech.scenes.medium import MEDIUM
from geomech.scenes.model import SWIMMER, Scene, checked_scene
from geomech.scenes.read import from_tables
from geomech.scenes.sections import Each, Keys, Section, sections_of, variants
from geomech.systems.base import unwrapped
from geomech.systems.capabilities import solver_of
from geomech.systems.framed import Framed
from geomech.systems.swimmer import Swimmer, name_in
from geomech.systems.table import Table
from rft.core.refusal import Refusal, located

if TYPE_CHECKING:
    from geomech.scenes.intruding import Intruding
    from geomech.scenes.walker import WalkerScene


def toml(scene: Scene | Intruding | WalkerScene) -> str:
    """Return the text that the scene was read from where it is valid by itself and in any folder, comments and all;
    else a new one, which spells out a medium that came from a file, and names other files with their folders. Refusal
    if it has a part that no scene file can name.

    Examples
    --------
    >>> import geomech
    >>> scene = geomech.study(geomech.media.Viscous(3.0), geomech.bodies.Chain(), geomech.gaits.Circle(0.5)).scene
    >>> print(geomech.toml(scene).partition("[body]")[0].strip())
    [medium]
    law = "viscous"
    ratio = 3.0
    """
    self_contained = not isinstance(_checked(scene), Scene) or not (
        scene.files or _names_relative_file(tomllib.loads(scene.text))
    )
    if (
        scene.text
        and self_contained
        and from_tables(tomllib.loads(scene.text), scene.name, scene.text) == scene
    ):
        return scene.text
    return text_of(_written_tables(scene))


def _checked(scene: Scene | Intruding | WalkerScene) -> Scene | Intruding | WalkerScene:
    """Return a scene of any kind; Refusal if it is none."""
    return scene if hasattr(type(scene), "example") else checked_scene(scene)


def _names_relative_file(tables: dict) -> bool:
    """Return whether tables name a file by its place relative to the scene's own."""
    files = [tables.get(place, {}).get("file", "") for place in ("gait", "system")]
    return any(file and not Path(file).is_absolute() for file in files)


def table(name: str, values: dict) -> str:
    """Return one table as TOML."""
    return text_of({name: values})


def gait_table(gait: Gait) -> dict:
    """Return the table [gait] of a gait."""
    return _section(gait, sections_of(Scene)["gait"].section)


def medium_toml(name: str, entry) -> str:
    """Return the table of a medium of the catalogue (`rft.laws.catalogue.Entry`), with its source above."""
    lines = textwrap.wrap(f"{name}: {entry.source}", 110)
    if entry.axial_stress is not None:
        lines.append(
            f"axial drag over projected area at 7.62 cm depth: {entry.axial_stress:g} Pa"
        )
    angles = [
        f"{x} = {math.degrees(getattr(entry.medium, x)):.6g} degrees"
        for x in sorted(angles_of(type(entry.medium)))
    ]
    head = "".join(f"# {line}\n" for line in [*lines, *angles])
    return head + table("medium", _section(entry.medium, MEDIUM))


def vertical_toml(name: str, entry) -> str:
    """Return the table of a medium of intruder scenes (`rft.terradynamics.plates.VerticalEntry`), with its source above."""
    head = "".join(
        f"# {line}\n" for line in textwrap.wrap(f"{name}: {entry.source}", 110)
    )
    from rft.terradynamics.plates.stress import COEFFICIENTS

    stress = dataclasses.asdict(entry.stress)
    values = {
        **{key.replace("m", "-"): stress[key] for key in COEFFICIENTS},
        "zeta": stress["zeta"],
    }
    return f"{head}# coefficients in N/cm^3, times zeta\n{table('medium', values)}"


def tables(scene: Scene | Intruding | WalkerScene) -> dict:
    """Return the tables of a scene's text, with its present numerics, where these make the scene; else newly written
    ones.

    Examples
    --------
    >>> from geomech.scenes import load, tables
    >>> tables(load("three-link-viscous"))["gait"]["kind"]
    'circle'
    """
    read = tomllib.loads(_checked(scene).text)
    if isinstance(scene, Scene):
        read["numerics"] = _numerics(scene)
    self_contained = not (
        isinstance(scene, Scene) and scene.files
    )  # whose medium can be swept only where it stands
    return (
        read
        if scene.text
        and self_contained
        and from_tables(read, scene.name, scene.text) == scene
        else _written_tables(scene)
    )


def without_gait(scene: Scene, spell_out: bool = False) -> dict:
    """Return the tables of a scene but for its gait, which hold in any folder: those of
    its text where these do, else newly written ones. Refusal if no file can name one of
    its parts; the gait may be one that none can. spell_out: the medium by its law and
    parameters, in place of its name.

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
    holds = (
        scene.text
        and not (scene.files or _names_relative_file(read))
        and from_tables(read, scene.name, scene.text) == plain
    )
    found = read if holds else _written_tables(plain)
    if spell_out:
        found = spelled_out(found, scene)
    return {name: table for name, table in found.items() if name != "gait"}


def spelled_out(tables: dict, scene: Scene) -> dict:
    """Return the scene's tables with the law and its parameters in place of the name of its medium."""
    if "name" not in tables.get("medium", {}):
        return tables
    return {**tables, "medium": _section(scene.system.medium, MEDIUM)}


def _written_tables(scene: Scene | Intruding | WalkerScene) -> dict:
    """Return the tables that a scene's parts make; Refusal if a file cannot name one of them."""
    with located(scene.name):
        out = {}
        for name, (section, *_) in sections_of(type(scene)).items():
            part = getattr(
                scene, name, scene
            )  # the scene itself where its own fields are keys
            if table := section_tables(_named(part), section):
                out[name] = table
        if isinstance(scene, Scene):
            out = _short(out, scene)
        if from_tables(out, scene.name) != scene:
            raise Refusal(
                "a part of this scene is of no kind that a scene file can name"
            )
        return out


def section_tables(part: Any, section: Section) -> dict | list[dict]:
    """Return the table of a section, or the tables of one for each part; Refusal if no file can name the part."""
    return (
        [_section(each, section) for each in part]
        if isinstance(section, Each)
        else _section(part, section)
    )


def _section(part: Any, section: Section) -> dict:
    for variant in variants(section):
        is_one = type(part) is getattr(variant.kind, "makes", variant.kind)
        if is_one and not (variant.file and not variant.file.keys):
            parts = {
                field: (getattr(part, field), one)
                for field, one in variant.inner.items()
            }
            inner = {
                field: section_tables(*each)
                for field, each in parts.items()
                if each[0] is not None
            }
            return {**variant.named, **_fields(part, variant.kind), **inner}
        if is_one or isinstance(section, Keys):
            raise Refusal(
                f"a {type(part).__name__} has a CSV file of its own",
                instead="write the scene that names it by hand",
            )
    reason = (
        f"a {name_in(section.kinds, part)} is of no kind that a scene file can name"
    )
    raise Refusal(reason, instead=f"use one of {', '.join(section.kinds)}")


def _short(tables: dict, scene: Scene) -> dict:
    """Return tables with a swimmer's parts in place of [system], and once the values that apply to the whole scene."""
    system, effects = tables.pop("system"), []
    if isinstance(_named(scene.system), Swimmer):
        tables = {part: system[part] for part in SWIMMER if system[part]} | tables
        effects = tables.get("effects", [])
    else:
        tables = {"system": system} | tables
    for part in ("body", "system"):
        if (
            "frame" in tables.get(part, {}) and tables[part].get("kind") != Table.kind
        ):  # which has its file's otherwise
            del tables[part]["frame"]
            if scene.frame != "mean":
                tables = {"frame": scene.frame} | tables
    if "frequency" in tables["gait"]:
        for effect in effects:
            effect.pop("frequency", None)
    return tables | {"numerics": _numerics(scene)}


def _named(part: Any) -> Any:
    """Return the object inside a system that a scene file can name."""
    if isinstance(part, Framed):
        return _named(part.inner)
    return unwrapped(part)


def _numerics(scene: Scene) -> dict:
    parts = [scene.numerics, solver_of(scene.system)]
    return {
        key: value
        for part in parts
        if part
        for key, value in _fields(part, type(part)).items()
    }


def _fields(part: Any, kind: type) -> dict:
    """Return the keys of a class, as in a file, for which a part has a value."""
    keys = [f.name for f in dataclasses.fields(kind) if f.init and f.name != "solver"]
    return {
        name: _plain(value)
        for name in keys
        if (value := getattr(part, name, None)) is not None
    }


def _plain(value):
    """Return NumPy's numbers and rows as Python's own."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return [_plain(x) for x in value] if isinstance(value, (tuple, list)) else value


def text_of(tables: dict) -> str:
    """Return the tables of a scene as TOML."""
    lines = [
        f"{key} = {_value(x)}"
        for key, x in tables.items()
        if not isinstance(x, (dict, list))
    ]
    for name, table in tables.items():
        for each in (
            table
            if isinstance(table, list)
            else [table]
            if isinstance(table, dict)
            else []
        ):
            lines += ["", f"[[{name}]]" if isinstance(table, list) else f"[{name}]"]
            lines += [f"{key} = {_value(x)}" for key, x in each.items()]
    return "\n".join(lines).lstrip("\n") + "\n"


def _value(x) -> str:
    """Return a value as TOML; its strings and lists are JSON's, its numbers Python's."""
    if isinstance(x, list):
        return f"[{', '.join(map(_value, x))}]"
    if isinstance(x, dict):
        return f"{{ {', '.join(f'{key} = {_value(y)}' for key, y in x.items())} }}"
    if isinstance(x, (str, bool)):
        # TOML allows no DEL as it is, JSON does
        return json.dumps(x, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(x)
