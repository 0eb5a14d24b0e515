"""The TOML of a scene, however it was made: reading it gives the same scene."""

from __future__ import annotations

import dataclasses
import json
import math
import textwrap
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from geomech.core.errors import SceneError
from geomech.gaits import KINDS as GAITS
from geomech.gaits import Gait
from geomech.scene.medium import with_files
from geomech.scene.model import Scene, checked_scene
from geomech.scene.read import from_tables
from geomech.systems import KINDS as SYSTEMS
from geomech.systems.base import Given
from geomech.systems.capabilities import solver_of
from geomech.systems.framed import Framed
from geomech.systems.swimmer import PARTS, Swimmer, name_in

if TYPE_CHECKING:
    from geomech.scene.intruding import Intruding
    from geomech.scene.walker import WalkerScene


def toml(scene: Scene | Intruding | WalkerScene) -> str:
    """The text it was read from where that still holds by itself and in any folder, comments and all; else a new one, in
    which a medium that came from a file stands, and other files with their folders. SceneError if it has a part that no
    scene file can name."""
    other = not isinstance(scene, Scene) and hasattr(scene, "tables")  # without a gait
    whole = scene.text if other else checked_scene(scene).text and not (scene.files or _beside(scene.text))
    if whole and from_tables(tomllib.loads(scene.text), scene.name, scene.text) == scene:
        return scene.text
    return _text(scene.tables() if other else _anew(scene))


def _beside(text: str) -> bool:
    """Whether a scene's text names a file by its place beside the scene's own."""
    tables = tomllib.loads(text)
    files = [tables.get(place, {}).get("file", "") for place in ("gait", "system")]
    return any(file and not Path(file).is_absolute() for file in files)


def table(name: str, values: dict) -> str:
    """One table as TOML."""
    return _text({name: values})


def gait_table(gait: Gait) -> dict:
    """What stands in [gait]."""
    return _of_kind(gait, "kind", GAITS)


def medium_toml(name: str, entry) -> str:
    """The table of a medium of the catalogue (`rft.laws.catalogue.Entry`), with its source above."""
    lines = textwrap.wrap(f"{name}: {entry.source}", 110)
    if entry.axial_stress is not None:
        lines.append(f"axial drag over projected area at 7.62 cm depth: {entry.axial_stress:g} Pa")
    angles = [
        f"{x} = {math.degrees(getattr(entry.medium, x)):.6g} degrees" for x in getattr(entry.medium, "angles", ())
    ]
    head = "".join(f"# {line}\n" for line in [*lines, *angles])
    return head + table("medium", _of_kind(entry.medium, *PARTS["medium"]))


def vertical_toml(name: str, entry) -> str:
    """The table of a medium of intruder scenes (`rft.plates.VerticalEntry`), with its source above."""
    head = "".join(f"# {line}\n" for line in textwrap.wrap(f"{name}: {entry.source}", 110))
    from rft.plates.stress import COEFFICIENTS

    told = dataclasses.asdict(entry.stress)
    values = {**{key.replace("m", "-"): told[key] for key in COEFFICIENTS}, "zeta": told["zeta"]}
    return f"{head}# coefficients in N/cm^3, times zeta\n{table('medium', values)}"


def tables(scene: Scene) -> dict:
    """The tables of its text, with the numerics of now, where these make the scene; else those written anew."""
    numerics = _numerics(checked_scene(scene))
    if scene.text:
        read = {**with_files(tomllib.loads(scene.text), scene.name)[0], "numerics": numerics}
        if from_tables(read, scene.name, scene.text) == scene:
            return read
    return _anew(scene)


def spelled_out(tables: dict, scene: Scene) -> dict:
    """The scene's tables with the law and its parameters in place of the name of its medium."""
    if "name" not in tables.get("medium", {}):
        return tables
    return {**tables, "medium": _of_kind(scene.system.medium, *PARTS["medium"])}


def _anew(scene: Scene) -> dict:
    system, out = _named(scene.system), {}
    if isinstance(system, Swimmer):
        out["medium"] = _of_kind(system.medium, *PARTS["medium"])
        out["body"] = _of_kind(system.body, *PARTS["body"])
        effects = [_of_kind(effect, *PARTS["effects"]) for effect in system.effects]
    else:
        out["system"], effects = _of_kind(system, "kind", SYSTEMS), []
        out["system"].pop("solver", None)
    for part in (out.get("body"), out.get("system")):
        if part and "frame" in part:
            del part["frame"]  # the scene's
            if scene.frame != "mean":
                out = {"frame": scene.frame, **out}
    out["gait"] = gait_table(scene.gait)
    if "frequency" in out["gait"]:
        for effect in effects:
            effect.pop("frequency", None)  # the gait's
    out["numerics"] = _numerics(scene)
    if effects:
        out["effects"] = effects
    if from_tables(out, scene.name) != scene:
        raise SceneError(f"{scene.name}: a part of this scene is of no kind that a scene file can name")
    return out


def _named(system):
    """Return the object inside a system that a scene file can name."""
    if isinstance(system, Framed):
        return _named(system.inner)
    return system.given if isinstance(system, Given) else system


def _numerics(scene: Scene) -> dict:
    return _fields(scene.numerics) | (_fields(solver_of(scene.system)) if solver_of(scene.system) else {})


def _of_kind(thing, key: str, kinds: dict) -> dict:
    name = name_in(kinds, thing)
    if name not in kinds:
        raise SceneError(f"a {name} is of no kind that a scene file can name: use one of {', '.join(kinds)}")
    return {key: name, **_fields(thing)}


def _fields(thing) -> dict:
    """Those that are told at construction and have a value."""
    values = {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing) if f.init}
    return {k: _plain(v) for k, v in values.items() if v is not None}


def _plain(value):
    """NumPy's numbers and rows as Python's own."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return [_plain(x) for x in value] if isinstance(value, (tuple, list)) else value


def _text(tables: dict) -> str:
    lines = [f"{key} = {_value(x)}" for key, x in tables.items() if not isinstance(x, (dict, list))]
    for name, table in tables.items():
        for each in table if isinstance(table, list) else [table] if isinstance(table, dict) else []:
            lines += ["", f"[[{name}]]" if isinstance(table, list) else f"[{name}]"]
            lines += [f"{key} = {_value(x)}" for key, x in each.items()]
    return "\n".join(lines).lstrip("\n") + "\n"


def _value(x) -> str:
    """As TOML; its strings and lists are JSON's, its numbers Python's."""
    if isinstance(x, list):
        return f"[{', '.join(map(_value, x))}]"
    if isinstance(x, dict):
        return f"{{ {', '.join(f'{key} = {_value(y)}' for key, y in x.items())} }}"
    return json.dumps(x, ensure_ascii=False) if isinstance(x, (str, bool)) else repr(x)
