"""Media that a scene takes from files: of `geomech fit-medium`, or tables of measured
drag."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from geomech.io.files import read_text
from geomech.io.rows import ENDINGS, Column
from geomech.io.rows import read as read_rows
from geomech.io.toml import tables_of
from geomech.mathematics.systems.swimmer import MEDIA, PARTS
from geomech.scenes.data.drag import ACROSS, ALONG, ANGLE, LARGEST_FILE
from geomech.scenes.format.reader import Source, read_section
from geomech.scenes.format.sections import FromFile, OneOf
from rft.core.checks import Word
from rft.core.refusal import Refusal, located

LARGEST = 1_000_000  # bytes of a medium's file
ANGLE_RAD = Column("psi", "angle", "rad")
FORCES = (Column("f_t"), Column("f_n"))  # in place of the forces on a rod


@dataclass(frozen=True)
class NamedMedium:
    """A medium of the catalogue, without other keys."""

    name: Annotated[
        str,
        Word(
            MEDIA,
            f"name of a medium in the catalogue: {', '.join(MEDIA)}; "
            "'geomech scenes --show NAME' prints one",
        ),
    ]

    def to_part(self, source: Source, place: str, given) -> Any:
        """Return the medium of that name."""
        return MEDIA[self.name]


@dataclass(frozen=True)
class MediumFile:
    """A medium from a file.

    file (-): name of a TOML file with a medium, such as geomech fit-medium writes,
    without other keys.
    """

    file: str

    def to_part(self, source: Source, place: str, given) -> Any:
        """Return the medium of the file, which may name another file with a table of
        drag."""
        path = Path(self.file)
        within = Source(f"{place} {path.name}", files=source.files, folder=path.parent)
        return read_section(within, "medium", _medium_table(place, path), MEDIUM)


def _medium_table(place: str, path: Path) -> dict:
    """Return the table of a medium's TOML file: [medium], or the keys of one alone."""
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
            instead=_cure_of_table(path),
        ) from None
    table = tables.get("medium", tables)
    if not isinstance(table, dict) or (table is not tables and len(tables) > 1):
        raise Refusal(
            f"{path.name} must contain one table [medium] and nothing else", where=place
        )
    if not {"law", "name"} & {*table}:
        raise Refusal(
            f"{path.name} names no medium",
            where=place,
            because="it must have 'law' or 'name'",
        )
    return table


def _cure_of_table(path: Path) -> str:
    if path.suffix.lower() in ENDINGS:
        return 'for a table of drag add law = "table"'
    return ""


def _drag_table(place: str, file: str) -> dict[str, list]:
    """Return the columns of a CSV file by name: psi, rad, and f_t and f_n, or the
    forces on a rod under these names."""
    with located(place):
        source = read_rows(
            file, LARGEST_FILE, "give a CSV file with columns psi_deg,f_t,f_n"
        )
        is_in_rad = bool(source.find((), (ANGLE_RAD,)))
        angle = ANGLE_RAD if is_in_rad else ANGLE
        is_of_rod = bool(source.find((), (ALONG, ACROSS)))
        along, across = (ALONG, ACROSS) if is_of_rod else FORCES
        columns = source.take((angle, along, across))
    psi = columns[angle.name]
    if not is_in_rad:
        psi = np.radians(psi)
    return {
        "psi": psi.tolist(),
        "f_t": columns[along.name].tolist(),
        "f_n": columns[across.name].tolist(),
    }


DRAG = FromFile(
    _drag_table,
    "CSV with the header psi_deg,f_t,f_n, instead of psi, f_t and f_n",
    ("psi", "f_t", "f_n"),
)
MEDIUM = OneOf(
    PARTS["medium"], "law", otherwise=(NamedMedium, MediumFile), files={"table": DRAG}
)
