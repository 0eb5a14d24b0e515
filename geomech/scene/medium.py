"""Media that a scene takes from files: one that `geomech calibrate` wrote, or a table of measured drag."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from geomech.core.errors import SceneError, short
from geomech.io.files import read_text
from geomech.io.rows import Rows
from geomech.io.rows import read as read_rows
from geomech.scene.drag import LARGEST_FILE, header
from geomech.scene.key import Word
from geomech.systems.swimmer import MEDIA

LARGEST = 1_000_000  # bytes of a medium's file
FORCES = (("f_t", "f_n"), ("F_parallel_N", "F_perpendicular_N"))  # columns of a table, under either names


@dataclass(frozen=True)
class NamedMedium:
    """By name, with no key beside it."""

    name: Annotated[
        str, Word(MEDIA, f"a medium of the catalogue: {', '.join(MEDIA)}; 'geomech scenes --show NAME' prints one")
    ]

    def to_part(self, place: str, given) -> Any:
        """Return the medium of that name."""
        return MEDIA[self.name]


@dataclass(frozen=True)
class MediumFile:
    """From a file.

    file (-): TOML of a medium, as geomech calibrate writes it, with no key beside it; or, beside law = 'table', CSV of a table.
    """

    file: str
    law: Annotated[str | None, Word(("table",), "where the file is CSV")] = None

    def to_part(self, place: str, given) -> Any:
        raise NotImplementedError


def with_files(tables: Mapping, name: str) -> tuple[Mapping, tuple[str, ...]]:
    """(tables of a scene whose media stand there and not in files, these files). name: of the scene's file, from whose folder
    they are looked for. SceneError, one line, for a file that holds no medium."""
    out, files = dict(tables), []
    system = tables.get("system")
    for place, within in (("[medium]", out), ("[system] medium", dict(system) if isinstance(system, dict) else {})):
        table = within.get("medium")
        if isinstance(table, dict) and "file" in table:
            within["medium"] = _filled(f"{name}: {place}", table, Path(name).absolute().parent, files)
            if within is not out:
                out["system"] = within
    return (out, tuple(files)) if files else (tables, ())


def _filled(place: str, table: dict, folder: Path, files: list[str]) -> dict:
    """The table with what is in its file in place of the file's name, which is added to ``files``."""
    if not isinstance(table["file"], str):
        raise SceneError(f"{place} file must be the name of a file, got {short(table['file'])}")
    tabular = table.get("law") == "table"
    if not tabular and (extra := sorted(set(table) - {"file"})):
        raise SceneError(f"{place}: a medium from a file takes no {extra[0]!r}: drop it, or copy the file's keys here")
    if tabular and (extra := sorted(set(table) - {"file", "law"})):
        raise SceneError(f"{place}: a table from a file takes no {extra[0]!r}: drop it, or the file")
    path = folder / table["file"]
    files.append(str(path))
    if tabular:
        return {"law": "table", **_rows(place, path)}
    inner = _medium(place, path)
    return _filled(f"{place} {path.name}:", inner, path.parent, files) if "file" in inner else inner


def _medium(place: str, path: Path) -> dict:
    """The table of a medium's TOML file, which may stand under [medium] or alone."""
    try:
        tables = tomllib.loads(read_text(path, LARGEST))
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{place} {path.name} is not TOML: {error}{_table_instead(path)}") from None
    except RecursionError:
        raise SceneError(f"{place} {path.name} is not TOML: it is nested too deep") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise SceneError(f"{place} cannot read {path.name!r}: {reason}; geomech calibrate writes such files") from None
    table = tables.get("medium", tables)
    if not isinstance(table, dict) or (table is not tables and len(tables) > 1):
        raise SceneError(f"{place} {path.name} must hold one table [medium] and nothing else")
    if not {"law", "name"} & {*table}:
        raise SceneError(f"{place} {path.name} names no medium: it must have 'law' or 'name'")
    return table


def _table_instead(path: Path) -> str:
    return '; for a table of drag add law = "table"' if path.suffix.lower() == ".csv" else ""


def _rows(place: str, path: Path) -> dict:
    """psi (rad), f_t and f_n of a CSV file, as lists."""
    try:
        source = read_rows(path, LARGEST_FILE, "give a CSV file with columns psi_deg,f_t,f_n")
        angle, forces = _columns(source)
        psi, *f = source.numbers(header(source, (angle, *forces)), (angle, *(x.lower() for x in forces))).T
    except ValueError as error:
        raise SceneError(f"{place} {error}") from None
    psi = np.radians(psi) if angle == "psi_deg" else psi
    return {"psi": psi.tolist(), "f_t": f[0].tolist(), "f_n": f[1].tolist()}


def _columns(source: Rows) -> tuple[str, tuple[str, str]]:
    """Which of the names that are known a file uses."""
    there = source.header[1]
    angle = "psi" if "psi" in there and "psi_deg" not in there else "psi_deg"
    return angle, next((names for names in FORCES if names[0].lower() in there), FORCES[0])
