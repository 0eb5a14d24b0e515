"""How the TOML file of a scene is read; those that ship with the toolkit are in builtin/."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geomech.core.errors import SceneError, choose, named, short
from geomech.gaits import KINDS as GAITS
from geomech.io.files import note, read_text
from geomech.scene import slips
from geomech.scene.frames import framed
from geomech.scene.medium import with_files
from geomech.scene.model import Numerics, Scene, checked_scene
from geomech.scene.parts import LARGEST, build, build_kind, kind_in
from geomech.scene.sizes import Sizes
from geomech.systems import KINDS as SYSTEMS
from geomech.systems.base import kind_of
from geomech.systems.framed import NAME as FITTED
from geomech.systems.swimmer import MEDIA, PARTS, Swimmer

if TYPE_CHECKING:
    from geomech.scene.intruding import Intruding
    from geomech.scene.walker import WalkerScene

TABLES = ("medium", "body", "gait", "numerics", "effects", "system", "physical", "frame")
PIPE = "pipe"  # name of a scene that comes through one, as from /dev/stdin or <(...)
INTRUDERS = "intruders"  # folder, beside the scenes with a gait, of those without
WALKERS = "walkers"  # and of robots that walk


def builtin_names() -> list[str]:
    """Names of the scenes with a gait that ship with the package."""
    return _names(_folder())


def intruder_names() -> list[str]:
    """Names of the intruder scenes that ship with the package."""
    return _names(_folder() / INTRUDERS)


def walker_names() -> list[str]:
    """Names of the scenes of walking robots that ship with the package."""
    return _names(_folder() / WALKERS)


def _names(folder) -> list[str]:
    return sorted(p.name.removesuffix(".toml") for p in folder.iterdir() if p.name.endswith(".toml"))


def _folder():
    return resources.files("geomech.scene") / "builtin"


def builtin_text(name: str) -> str | None:
    """The TOML of a built-in scene; None if there is none of that name."""
    for folder, names in (
        (_folder(), builtin_names()),
        (_folder() / INTRUDERS, intruder_names()),
        (_folder() / WALKERS, walker_names()),
    ):
        if name in names:
            return (folder / f"{name}.toml").read_text(encoding="utf-8")
    return None


def load(scene: str | Path) -> Scene | Any:
    """The scene of a built-in name or a TOML file, an intruder scene if it has an [intruder], a `WalkerScene` if a [robot]
    (Any, so that no type checker asks which); SceneError, one line, if it is not one."""
    if not isinstance(scene, (str, Path)):
        raise SceneError(f"scene must be a name or a TOML file, got {short(scene)}")
    if (text := builtin_text(str(scene))) is not None:
        return parse(text, str(scene))
    path, names = Path(scene), builtin_names()
    try:
        if path.suffix != ".toml" and not path.exists():
            choose("scene", str(scene), names + intruder_names() + walker_names())
        text = read_text(path, LARGEST, pipes=True)
        scene = PIPE if path.is_fifo() else scene  # files that it names are looked for from here
    except SceneError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise SceneError(
            f"cannot read scene {str(scene)!r}: {reason}; give a TOML file or one of {', '.join(names)}"
        ) from None
    made = parse(text, str(scene))
    for line in getattr(getattr(made, "system", None), "assumed", ()):
        note(line)
    return made


def in_medium(scene: Scene, file: str | Path) -> Scene:
    """The scene in another medium, from a file as ``[medium] file`` takes it, or a table of drag if its name ends in .csv;
    relative to the current folder. SceneError if that holds none, or the scene's system takes none."""
    if not isinstance(scene.system, Swimmer):
        raise SceneError(f"{scene.name}: a {kind_of(scene.system)} takes no medium")
    table = {"file": str(Path(file).absolute())}
    if Path(file).suffix.lower() == ".csv":
        table["law"] = "table"
    tables, files = with_files({"medium": table}, scene.name)
    return scene.changed(medium=_medium(f"{scene.name}: [medium]", tables["medium"]), files=files)


def inputs(scene: Scene | Intruding | WalkerScene) -> list[Path]:
    """The files that a scene was read from: its own, unless it is built in or came through a pipe, and those of its medium,
    gait and system, or of an intruder scene's parts."""
    parts = () if hasattr(scene, "intruder") or hasattr(scene, "robot") else (checked_scene(scene).gait, scene.system)
    own = [] if scene.name in [PIPE, *builtin_names(), *intruder_names(), *walker_names()] else [scene.name]
    return [Path(x) for x in (*own, *scene.files, *(getattr(part, "file", None) for part in parts)) if x]


def parse(text: str, name: str = "scene") -> Scene | Any:
    """The scene of a TOML text; SceneError if it is not one."""
    if not isinstance(text, str):
        raise SceneError(f"{short(name)}: a scene is a TOML text, got {short(text)}")
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a ValueError may be an integer of too many digits
        raise SceneError(f"{name} is not TOML: {error}{slips.at_line(text, error)}") from None
    return from_tables(tables, name, text)


def from_tables(tables: dict, name: str = "scene", text: str = "") -> Scene | Any:
    """The scene of the tables of a TOML text; SceneError if they make none."""
    if not isinstance(tables, Mapping):
        raise SceneError(f"{short(name)}: a scene is a dict of tables, got {short(tables)}")
    if "robot" in tables:
        from geomech.scene import walker

        return walker.from_tables(tables, name, text)
    if {"intruder", "motion"} & {*tables}:
        from geomech.scene import intruder  # which reads tables with what is here

        return intruder.from_tables(tables, name, text)
    for table in tables:
        choose(f"{name}: table", table, TABLES)
    for table in ("gait",) if "system" in tables else ("medium", "body", "gait"):
        if table not in tables:
            raise SceneError(f"{name}: the table [{table}] is missing: add it, see 'geomech scenes --show NAME'")
    for table, value in tables.items():
        if table not in ("effects", "frame") and not isinstance(value, dict):
            raise SceneError(f"{name}: {table} must be a table [{table}], got {type(value).__name__}")
    tables, fitted = _without_fitted(tables, name)
    tables, files = with_files(tables, name)
    sizes = Sizes(name, tables)
    gait = build_kind(f"{name}: [gait]", _located(tables["gait"], name), "kind", GAITS, sizes.timed)
    kind, parts = _system(tables, name, sizes)
    solver = getattr(kind, "solver", None)
    own = {f.name for f in dataclasses.fields(solver)} if solver else set()
    numerics = tables.get("numerics", {})
    for key in numerics:
        plain = key.removesuffix("_deg") if key.removesuffix("_deg") in Numerics.angles else key
        choose(f"{name}: [numerics] key", plain, [f.name for f in dataclasses.fields(Numerics)] + sorted(own))
    if own:
        keys = {k: v for k, v in numerics.items() if k in own}
        parts["solver"] = build(f"{name}: [numerics]", keys, type(solver))
    finely = build(f"{name}: [numerics]", {k: v for k, v in numerics.items() if k not in own}, Numerics)
    with named(name):
        system = kind(**parts)
        return Scene(
            system=framed(system, finely) if fitted else system,
            gait=gait,
            numerics=finely,
            name=name,
            text=text,
            files=files,
        )


def _without_fitted(tables: Mapping, name: str) -> tuple[dict, bool]:
    """The tables without the frame that is fitted to the whole system on the grid, and whether one asks for it: it stands
    above all tables, in [body] or in [system], as any other."""
    own, places = tables.get("frame"), []

    def plain(place: str, table):
        if not isinstance(table, Mapping) or table.get("frame") != FITTED:
            return table
        places.append(place)
        return {k: v for k, v in table.items() if k != "frame"}

    tables = {k: plain(k, v) if k in ("body", "system") else v for k, v in plain("", tables).items()}
    if "body" in tables.get("system", {}):
        tables["system"] = {**tables["system"], "body": plain("system.body", tables["system"]["body"])}
    if places and own not in (None, FITTED):
        raise SceneError(f"{name}: [{places[0]}] frame = {FITTED!r}, but the scene's frame = {own!r}: keep one")
    return tables, bool(places)


def _system(tables: Mapping, name: str, sizes: Sizes) -> tuple[type, dict]:
    """The class of the scene's system and its fields. [medium], [body] and [[effects]] are short for a swimmer, whose
    they may also be in its own table."""
    table = dict(_located(tables.get("system", {"kind": "swimmer"}), name))
    kind = SYSTEMS[kind_in(f"{name}: [system]", table, "kind", SYSTEMS)]
    del table["kind"]
    if kind is not Swimmer:
        if strangers := sorted({"medium", "body", "effects"} & {*tables}):
            raise SceneError(f"{name}: a {kind.kind} takes no {strangers[0]!r}: drop it, or the table [system]")
        place = f"{name}: [system]"
        parts = _fields(build(place, sizes.fill(place, table, kind), kind))
    else:
        parts = _swimmer({**{k: tables[k] for k in PARTS if k in tables}, **table}, name, sizes)
    sizes.all_used()
    return kind, parts


def _fields(thing) -> dict:
    return {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing)}


def _swimmer(parts: dict, name: str, sizes: Sizes) -> dict:
    """The fields of a swimmer but for the solver."""
    for part in parts:
        choose(f"{name}: [system] key", part, PARTS)
    effects = parts.get("effects", [])
    if not (isinstance(effects, list) and all(isinstance(e, dict) for e in effects)):
        raise SceneError(f"{name}: effects must be tables [[effects]], one for each")
    for part in ("medium", "body"):
        if not isinstance(parts.get(part), dict):
            raise SceneError(f"{name}: the table [{part}] is missing: add it, see 'geomech scenes --show NAME'")
    made = {"medium": _medium(f"{name}: [medium]", parts["medium"])}
    made["body"] = build_kind(f"{name}: [body]", parts["body"], *PARTS["body"], sizes.fill)
    places = [(f"{name}: [[effects]]", e) for e in effects]
    made["effects"] = tuple(build_kind(place, e, *PARTS["effects"], sizes.fill) for place, e in places)
    return made


def _located(table: dict, name: str) -> dict:
    """The table with its data file, if it names one, looked for from the folder of the scene file ``name``."""
    file = table.get("file")
    return {**table, "file": str(Path(name).absolute().parent / file)} if isinstance(file, str) else table


def _medium(place: str, table: dict):
    if "name" not in table:
        return build_kind(place, table, *PARTS["medium"])
    if extra := sorted(set(table) - {"name"}):
        raise SceneError(
            f"{place}: a medium given by name takes no {extra[0]!r}: drop it, or give 'law' in place of 'name'"
        )
    return MEDIA[choose(f"{place} name", table["name"], MEDIA)]
