"""The reader of a scene's TOML file. Built-in scenes are in builtin/."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geomech.core.errors import choose
from geomech.io.files import note, read_text
from geomech.io.foreign import refuse_program
from geomech.io.rows import ENDINGS
from geomech.io.toml import tables_of
from geomech.mathematics.systems.base import kind_of
from geomech.mathematics.systems.swimmer import MEDIA, Swimmer
from geomech.scenes import swimming
from geomech.scenes.format import hints, reader
from geomech.scenes.medium import MEDIUM
from geomech.scenes.model import Scene, checked_scene
from rft.core.refusal import Refusal, formatted
from rft.terradynamics.plates import VERTICAL

if TYPE_CHECKING:
    from geomech.scenes.terradynamics.intruding import Intruding
    from geomech.scenes.terradynamics.walker import WalkerScene

LARGEST = 10_000_000  # bytes of a scene file
PIPE = "pipe"  # name of a scene from a pipe, such as /dev/stdin or <(...)


def builtin_names() -> list[str]:
    """Return the names of the scenes with a gait that ship with the package.

    Examples
    --------
    >>> from geomech.scenes import builtin_names
    >>> "three-link-glass" in builtin_names()
    True
    """
    return _names("")


def intruder_names() -> list[str]:
    """Return the names of the intruder scenes that ship with the package.

    Examples
    --------
    >>> from geomech.scenes import intruder_names
    >>> "c-leg" in intruder_names()
    True
    """
    return _names("intruders")


def walker_names() -> list[str]:
    """Return the names of the scenes of walking robots that ship with the package.

    Examples
    --------
    >>> from geomech.scenes import walker_names
    >>> "xplorer" in walker_names()
    True
    """
    return _names("walkers")


def _folder(name: str) -> Traversable:
    return resources.files("geomech.scenes") / "builtin" / name


def _names(folder: str) -> list[str]:
    names = [path.name for path in _folder(folder).iterdir()]
    return sorted(x.removesuffix(".toml") for x in names if x.endswith(".toml"))


def _all_builtin_names() -> list[str]:
    return builtin_names() + intruder_names() + walker_names()


def builtin_text(name: str) -> str | None:
    """Return the TOML of a built-in scene; None if no scene has that name."""
    for folder in ("", "intruders", "walkers"):
        if name in _names(folder):
            return (_folder(folder) / f"{name}.toml").read_text(encoding="utf-8")
    return None


def load(scene: str | Path) -> Scene | Any:
    """Return the built-in scene of a name, or the scene of a TOML file; Refusal if
    there is none.

    With an [intruder] it is an intruder scene, with a [robot] a `WalkerScene`. The type
    is Any, so that type checkers do not ask which.

    Examples
    --------
    >>> import geomech
    >>> scene = geomech.load("three-link-glass")
    >>> scene.system.medium.C, scene.gait
    (1.8, Circle(amplitude=1.0, centre=(), reverse=True, frequency=None))
    """
    if not isinstance(scene, (str, Path)):
        raise Refusal("scene must be a name or a TOML file", value=scene)
    builtin = builtin_text(str(scene))
    if builtin is not None:
        return parse(builtin, str(scene))
    path = Path(scene)
    refuse_program(path)
    try:
        if path.suffix != ".toml" and not path.exists():
            choose("scene", str(scene), _all_builtin_names(), ".toml")
        text = read_text(path, LARGEST, pipes=True)
        # Files that a scene from a pipe names are relative to the current folder.
        name = PIPE if path.is_fifo() else str(scene)
    except Refusal:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise Refusal(
            f"cannot read scene {str(scene)!r}",
            because=reason,
            instead=f"give a TOML file or one of {', '.join(builtin_names())}",
        ) from None
    result = parse(text, name)
    system: Any = getattr(result, "system", None)
    for line in getattr(system, "assumed", ()):
        note(f"{system.file}: {line}")
    return result


def in_medium(scene: Scene, file: str | Path) -> Scene:
    """Return the scene in the medium of a file, as for ``[medium] file``, or of a table
    of drag if the file's name ends in .csv. Refusal if the file has no medium, or the
    scene's system takes none.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import geomech
    >>> from geomech.scenes import in_medium, load
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "sand.toml"
    >>> geomech.fit_medium("short-rod-drag").save(file)
    >>> round(in_medium(load("three-link-glass"), file).system.medium.C, 2)
    1.49
    """
    if not isinstance(scene.system, Swimmer):
        raise Refusal(f"a {kind_of(scene.system)} takes no medium", where=scene.name)
    medium, files = _medium_file(file, scene.name)
    return scene.changed(medium=medium, files=files)


def medium_of(name: str | Path) -> Any:
    """Return the medium of the catalogue with a name, or the medium of a file as for
    `in_medium`. Refusal if there is none."""
    if isinstance(name, Path) or name.lower().endswith((".toml", *ENDINGS)):
        medium, _ = _medium_file(name, "medium")
        return medium
    if name in VERTICAL:
        raise Refusal(
            f"{name!r} is a stress map of the vertical plane, for legs and wheels",
            where="medium",
            instead=f"for a body that undulates, use one of {', '.join(MEDIA)}",
        )
    builtin = builtin_text(name)
    if builtin is not None:
        named = tables_of(builtin).get("medium", {}).get("name")
        instead = f"use one of {', '.join(MEDIA)}"
        if named in MEDIA:
            instead = f"use its medium, {named!r}"
        raise Refusal(f"{name!r} is a scene", where="medium", instead=instead)
    return MEDIA[choose("medium", name, MEDIA, ".toml")]


def medium(name: str | Path) -> Any:
    """Return a medium of the catalogue by its name, or the medium of a file.

    It is a force law for bodies that undulate, such as `rft.Granular`, or a stress map
    of the vertical plane for legs and wheels, which `rft.mujoco.attach` takes.

    name: 'geomech scenes' lists the names. A file is TOML with a table [medium], or
    with the keys of one alone, as ``geomech fit-medium`` writes it, or CSV of plate
    drags. Refusal for anything else.

    Examples
    --------
    >>> import geomech
    >>> geomech.medium("glass-0.3mm-loose").C
    1.8
    >>> geomech.medium("poppy-seeds-loose").zeta
    1.0
    """
    from geomech.scenes.terradynamics.stress import stress_map

    word = str(name)
    if word in MEDIA:
        return MEDIA[word]
    path = Path(word)
    if word in VERTICAL or path.suffix.lower() in ENDINGS:
        return stress_map(word)
    if path.suffix.lower() != ".toml" and not path.exists():
        choose("medium", word, (*MEDIA, *VERTICAL), ".toml")
    if _has_law(path):
        law, _ = _medium_file(word, "medium")
        return law
    return stress_map(word)


def _has_law(path: Path) -> bool:
    """Return whether a TOML file has a force law; False for one that is not read."""
    try:
        tables = tables_of(read_text(path, LARGEST))
    except (OSError, ValueError):
        return False
    table = tables.get("medium", tables)
    return isinstance(table, Mapping) and "law" in table


def medium_in(text: str) -> Any:
    """Return the medium in the text of a file as `geomech fit-medium` writes it: a law,
    or a map of stress in the vertical plane."""
    from geomech.scenes.terradynamics.stress import StressKeys

    source = reader.Source("medium")
    table = tables_of(text)["medium"]
    if "law" in table:
        return reader.read_section(source, "medium", table, MEDIUM)
    return reader.build(source, "medium", table, StressKeys)


def _medium_file(file: str | Path, place: str) -> tuple[Any, tuple[str, ...]]:
    """Return the medium of a file, and the files from which it was read. place: for a
    Refusal."""
    table = {"file": str(Path(file).absolute())}
    if Path(file).suffix.lower() in ENDINGS:
        table["law"] = "table"
    source = reader.Source(place)
    return reader.read_section(source, "medium", table, MEDIUM), tuple(source.files)


def inputs(scene: Scene | Intruding | WalkerScene) -> list[Path]:
    """Return the files from which a scene was read: its own, unless it is built in or
    came from a pipe, and those of its parts.

    Examples
    --------
    >>> from geomech.scenes import inputs, load
    >>> inputs(load("three-link-glass"))  # of a built-in scene there are none
    []
    """
    names: list[str | None] = []
    if hasattr(scene, "intruder") or hasattr(scene, "robot"):
        names += scene.files
    else:
        scene = checked_scene(scene)
        names += scene.files
        for part in (scene.gait, scene.system):
            names.append(getattr(part, "file", None))
    if scene.name not in (PIPE, *_all_builtin_names()):
        names.insert(0, scene.name)
    return [Path(name) for name in names if name]


def parse(text: str, name: str = "scene") -> Scene | Any:
    """Return the scene of a TOML text; Refusal if it is none.

    Examples
    --------
    >>> from geomech.scenes import parse
    >>> text = '''
    ... [medium]
    ... law = "viscous"
    ... [body]
    ... kind = "chain"
    ... [gait]
    ... kind = "circle"
    ... amplitude = 0.5
    ... '''
    >>> parse(text).gait.amplitude
    0.5
    """
    if not isinstance(text, str):
        raise Refusal("a scene must be a TOML text", value=text, where=formatted(name))
    try:
        tables = tables_of(text)
    except ValueError as error:  # no TOML, or an integer with too many digits
        reason = f"{error}{hints.line_hint(text, error)}"
        raise Refusal(f"{name} is not TOML", because=reason) from None
    return from_tables(tables, name, text)


def _intruding(tables: Mapping, name: str) -> type[Intruding]:
    """Return the class of an intruder scene, by the kind of its body."""
    from geomech.scenes.terradynamics.intruder import OUTLINES, IntruderScene
    from geomech.scenes.terradynamics.solid import KINDS, MeshScene

    body = tables.get("intruder")
    kind = body.get("kind") if isinstance(body, Mapping) else None
    if kind is not None:
        choose(f"{name}: [intruder] kind", kind, [*OUTLINES.kinds, *KINDS])
    return MeshScene if kind in KINDS else IntruderScene


def from_tables(tables: dict, name: str = "scene", text: str = "") -> Scene | Any:
    """Return the scene of the tables of a TOML text; Refusal if they describe none.

    Examples
    --------
    >>> from geomech.scenes import from_tables
    >>> medium = {"law": "viscous"}
    >>> body = {"kind": "chain"}
    >>> gait = {"kind": "circle", "amplitude": 0.5}
    >>> scene = from_tables({"medium": medium, "body": body, "gait": gait})
    >>> scene.system.medium.ratio
    2.0
    """
    if not isinstance(tables, Mapping):
        raise Refusal(
            "a scene must be a dict of tables", value=tables, where=formatted(name)
        )
    if "robot" in tables:
        from geomech.scenes.terradynamics.walker import WalkerScene, with_implied_names

        return reader.read(WalkerScene, with_implied_names(tables, name), name, text)
    if {"intruder", "motion"} & {*tables}:
        return reader.read(_intruding(tables, name), tables, name, text)
    return swimming.from_tables(tables, name, text)
