"""Columns of numbers that a scene takes from CSV files, whatever their order."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from geomech.io import rows
from geomech.io.rows import Column
from rft.core.refusal import Refusal, formatted, located

LARGEST_FILE = 20_000_000  # bytes
KINDS = {  # of columns by their names, with the unit that a scene has them in
    "t": ("time", "s"),
    "x": ("length", "m"),
    "y": ("length", "m"),
    "z": ("length", "m"),
    "angle": ("angle", "rad"),
    "rx": ("angle", "rad"),
    "ry": ("angle", "rad"),
    "rz": ("angle", "rad"),
    "beta": ("angle", "deg"),
    "gamma": ("angle", "deg"),
    "alpha_x": ("stress per depth", "N/cm3"),
    "alpha_z": ("stress per depth", "N/cm3"),
}
OTHER_NAMES = {"t": ("t", "time")}


def column(name: str) -> Column:
    """Return the column of a name in `KINDS`."""
    kind, unit = KINDS[name]
    return Column(name, kind, unit, OTHER_NAMES.get(name, (name,)))


def columns(
    place: str, path, required: tuple[str, ...], optional: tuple[str, ...] = ()
) -> dict[str, np.ndarray]:
    """Return the columns ``required``, and those of ``optional`` that the file has, in
    the units of `KINDS`. Refusal, with ``place`` and the line, for any other file."""
    if not isinstance(path, (str, Path)):
        raise Refusal("file must be the name of a CSV file", value=path, where=place)
    header = ",".join(required)
    needed = [column(name) for name in required]
    wanted = [column(name) for name in optional]
    with located(place):
        source = rows.read(
            path, LARGEST_FILE, f"give a CSV file with the header {header}"
        )
        found = source.find((), [*needed, *wanted])
        used = {x.index for x in found.values()}
        unknown = [x for k, x in enumerate(source.words) if k not in used]
        if unknown or not {*required} <= {*found}:
            more = f", and {','.join(optional)} if wanted" if optional else ""
            because = source.found
            if unknown and because:
                because = (
                    f"{because}, of which {formatted(unknown[0])} is none of these"
                )
            raise Refusal(
                f"the header must be {header}{more}",
                where=source.place,
                because=because,
            )
        values, notes = source.values(found)
        source.tell(notes)
    return {name: values[name] for name in (*required, *optional) if name in values}


def columns_reader(
    required: tuple[str, ...], optional: tuple[str, ...] = ()
) -> Callable[[str, str], dict[str, list]]:
    """Return a function (place, file) that reads a column of a CSV file for each key."""
    return lambda place, file: {
        key: x.tolist() for key, x in columns(place, file, required, optional).items()
    }


def rows_reader(
    key: str, required: tuple[str, ...]
) -> Callable[[str, str], dict[str, list]]:
    """Return a function (place, file) that reads columns of a CSV file as the rows of
    one key."""
    return lambda place, file: {
        key: np.stack([*columns(place, file, required).values()], -1).tolist()
    }
