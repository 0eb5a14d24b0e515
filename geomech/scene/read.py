"""How the TOML file of a scene is read; those that ship with the toolkit are in builtin/."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

import msgspec

import rft
from geomech.errors import SceneError, choose, short
from geomech.files import read_text
from geomech.gaits import KINDS as GAITS
from geomech.scene.model import Numerics, Scene
from rft.bodies import KINDS as BODIES
from rft.effects import KINDS as EFFECTS
from rft.media import LAWS

LARGEST = 10_000_000  # bytes of a scene file


def builtin_names() -> list[str]:
    """Names of the scenes that ship with the package."""
    return sorted(p.name.removesuffix(".toml") for p in _folder().iterdir() if p.name.endswith(".toml"))


def _folder():
    return resources.files("geomech.scene") / "builtin"


def load(scene: str | Path) -> Scene:
    """The scene of a built-in name or a TOML file; SceneError, one line, if it is not one."""
    if not isinstance(scene, (str, Path)):
        raise SceneError(f"scene must be a name or a TOML file, got {short(scene)}")
    names = builtin_names()
    if str(scene) in names:
        return parse((_folder() / f"{scene}.toml").read_text(encoding="utf-8"), str(scene))
    path = Path(scene)
    try:
        if path.suffix != ".toml" and not path.exists():
            choose("scene", str(scene), names)
        text = read_text(path, LARGEST)
    except SceneError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise SceneError(
            f"cannot read scene {str(scene)!r}: {reason}; give a TOML file or one of {', '.join(names)}"
        ) from None
    return parse(text, str(scene))


def inputs(scene: Scene) -> list[Path]:
    """The files that a scene was read from: its own, unless it is built in, and its gait's."""
    own = [] if scene.name in builtin_names() else [scene.name]
    return [Path(x) for x in (*own, getattr(scene.gait, "file", None)) if x]


def parse(text: str, name: str = "scene") -> Scene:
    """The scene of a TOML text; SceneError if it is not one."""
    if not isinstance(text, str):
        raise SceneError(f"{short(name)}: a scene is a TOML text, got {short(text)}")
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a ValueError may be an integer of too many digits
        raise SceneError(f"{name} is not TOML: {error}") from None
    return from_tables(tables, name, text)


def from_tables(tables: dict, name: str = "scene", text: str = "") -> Scene:
    """The scene of the tables of a TOML text; SceneError if they make none."""
    if not isinstance(tables, Mapping):
        raise SceneError(f"{short(name)}: a scene is a dict of tables, got {short(tables)}")
    tables = dict(tables)
    for table in tables:
        choose(f"{name}: table", table, ("medium", "body", "gait", "numerics", "effects"))
    for table in ("medium", "body", "gait"):
        if table not in tables:
            raise SceneError(f"{name}: the table [{table}] is missing: add it, see 'geomech scenes --show NAME'")
    effects = tables.pop("effects", [])
    if not (isinstance(effects, list) and all(isinstance(e, dict) for e in effects)):
        raise SceneError(f"{name}: effects must be tables [[effects]], one for each")
    for table, value in tables.items():
        if not isinstance(value, dict):
            raise SceneError(f"{name}: {table} must be a table [{table}], got {type(value).__name__}")
    return Scene(
        medium=_medium(f"{name}: [medium]", tables["medium"]),
        body=_of_kind(f"{name}: [body]", tables["body"], "kind", BODIES),
        gait=_of_kind(f"{name}: [gait]", _located(tables["gait"], name), "kind", GAITS),
        numerics=_build(f"{name}: [numerics]", tables.get("numerics", {}), Numerics),
        effects=tuple(_of_kind(f"{name}: [[effects]]", e, "kind", EFFECTS) for e in effects),
        name=name,
        text=text,
    )


def _located(table: dict, name: str) -> dict:
    """The table with its data file, if it names one, looked for from the folder of the scene file ``name``."""
    file = table.get("file")
    return {**table, "file": str(Path(name).absolute().parent / file)} if isinstance(file, str) else table


def _medium(place: str, table: dict) -> rft.Medium:
    if "name" not in table:
        return _of_kind(place, table, "law", LAWS)
    if extra := sorted(set(table) - {"name"}):
        raise SceneError(
            f"{place}: a medium given by name takes no {extra[0]!r}: drop it, or give 'law' in place of 'name'"
        )
    return rft.CATALOGUE[choose(f"{place} name", table["name"], rft.CATALOGUE)].medium


def _of_kind(place: str, table: dict, key: str, kinds: Mapping[str, type]):
    if key not in table:
        raise SceneError(f"{place} has no {key!r}: add {key} = one of {', '.join(kinds)}")
    kind = kinds[choose(f"{place} {key}", table[key], kinds)]
    return _build(place, {k: v for k, v in table.items() if k != key}, kind)


def _build(place: str, table: dict, kind: type):
    """A dataclass from a table: keys are its fields, one of its ``angles`` may be given as ``x_deg``; else SceneError."""
    names = [f.name for f in dataclasses.fields(kind)]
    values = {}
    for key, value in table.items():
        in_degrees = key.endswith("_deg") and key.removesuffix("_deg") in getattr(kind, "angles", ())
        field = choose(f"{place} key", key.removesuffix("_deg") if in_degrees else key, names)
        if field in values:
            raise SceneError(f"{place}: {field} is given twice: keep one of {field} and {field}_deg")
        values[field] = _radians(value) if in_degrees else value
    try:
        return msgspec.convert(values, kind)
    except (ValueError, OverflowError) as error:
        raise SceneError(f"{place} {str(error).replace(' - at `$', ' - at `').replace(' - at ``', '')}") from None


def _radians(degrees):
    """Numbers, and numbers in lists, from degrees; anything else as it is, to be refused for what it is."""
    if isinstance(degrees, list):
        return [_radians(x) for x in degrees]
    if isinstance(degrees, (int, float)) and not isinstance(degrees, bool) and abs(degrees) < 1e300:
        return math.radians(degrees)
    return degrees
