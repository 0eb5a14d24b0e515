"""Media that a scene takes from files: one that `geomech fit-medium` wrote, or a table of measured drag."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from geomech.io.files import read_text
from geomech.io.rows import Rows
from geomech.io.rows import read as read_rows
from geomech.io.toml import tables_of
from geomech.scenes.drag import LARGEST_FILE, header
from geomech.scenes.key import Word
from geomech.scenes.reader import Source, read_section
from geomech.scenes.sections import FromFile, OneOf
from geomech.systems.swimmer import MEDIA, PARTS
from rft.refusal import Refusal, located

LARGEST = 1_000_000  # bytes of a medium's file
FORCES = (
    ("f_t", "f_n"),
    ("F_parallel_N", "F_perpendicular_N"),
)  # columns of a table, under either names


@dataclass(frozen=True)
class NamedMedium:
    """By name, with no key beside it."""

    name: Annotated[
        str,
        Word(
            MEDIA,
            f"a medium of the catalogue: {', '.join(MEDIA)}; 'geomech scenes --show NAME' prints one",
        ),
    ]

    def to_part(self, source: Source, place: str, given) -> Any:
        """Return the medium of that name."""
        return MEDIA[self.name]


@dataclass(frozen=True)
class MediumFile:
    """From a file.

    file (-): TOML of a medium, as geomech fit-medium writes it, with no key beside it.
    """

    file: str

    def to_part(self, source: Source, place: str, given) -> Any:
        """Return the medium of the file, which may name another one, of a table of drag."""
        path = Path(self.file)
        within = Source(f"{place} {path.name}", files=source.files, folder=path.parent)
        return read_section(within, "medium", _medium(place, path), MEDIUM)


def _medium(place: str, path: Path) -> dict:
    """Return the table of a medium's TOML file, which may stand under [medium] or alone."""
    try:
        text = read_text(path, LARGEST)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise Refusal(
            f"cannot read {path.name!r}",
            where=place,
            because=reason,
            instead="geomech fit-medium writes such files",
        ) from None
    try:
        tables = tables_of(text)
    except ValueError as error:
        raise Refusal(
            f"{path.name} is not TOML",
            where=place,
            because=str(error),
            instead=_table_instead(path),
        ) from None
    table = tables.get("medium", tables)
    if not isinstance(table, dict) or (table is not tables and len(tables) > 1):
        raise Refusal(
            f"{path.name} must hold one table [medium] and nothing else", where=place
        )
    if not {"law", "name"} & {*table}:
        raise Refusal(
            f"{path.name} names no medium",
            where=place,
            because="it must have 'law' or 'name'",
        )
    return table


def _table_instead(path: Path) -> str:
    return (
        'for a table of drag add law = "table"' if path.suffix.lower() == ".csv" else ""
    )


def _rows(place: str, file: str) -> dict[str, list]:
    """Return psi (rad), f_t and f_n of a CSV file."""
    with located(place):
        source = read_rows(
            file, LARGEST_FILE, "give a CSV file with columns psi_deg,f_t,f_n"
        )
        angle, forces = _columns(source)
        psi, *f = source.numbers(
            header(source, (angle, *forces)), (angle, *(x.lower() for x in forces))
        ).T
    psi = np.radians(psi) if angle == "psi_deg" else psi
    return {"psi": psi.tolist(), "f_t": f[0].tolist(), "f_n": f[1].tolist()}


def _columns(source: Rows) -> tuple[str, tuple[str, str]]:
    """Return the names of the angle and the forces that a file uses."""
    present = source.header[1]
    angle = "psi" if "psi" in present and "psi_deg" not in present else "psi_deg"
    return angle, next(
        (names for names in FORCES if names[0].lower() in present), FORCES[0]
    )


DRAG = FromFile(
    _rows,
    "CSV with the header psi_deg,f_t,f_n, in place of psi, f_t and f_n",
    ("psi", "f_t", "f_n"),
)
MEDIUM = OneOf(
    PARTS["medium"], "law", otherwise=(NamedMedium, MediumFile), files={"table": DRAG}
)
