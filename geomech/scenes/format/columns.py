"""Columns of numbers that a scene takes from CSV files, in any order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geomech.io import rows
from geomech.io.rows import Column
from rft.core.refusal import Refusal, formatted, located

LARGEST_FILE = 20_000_000  # bytes
KINDS = {  # of columns, with their units in a scene, by name
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
    """Return the column of `KINDS` with a name."""
    kind, unit = KINDS[name]
    return Column(name, kind, unit, OTHER_NAMES.get(name, (name,)))


def columns(
    place: str, path, required: tuple[str, ...], optional: tuple[str, ...] = ()
) -> dict[str, np.ndarray]:
    """Return the columns ``required`` (N,), and those of ``optional`` that the file
    has, by name, in the units of `KINDS`. Refusal, with ``place`` and the line, for any
    other file."""
    header = ",".join(required)
    accepted = [column(name) for name in (*required, *optional)]
    with located(place):
        source = rows.read(
            path, LARGEST_FILE, f"give a CSV file with the header {header}"
        )
        places = source.find((), accepted)
        used = {x.index for x in places.values()}
        unknown = [x for k, x in enumerate(source.words) if k not in used]
        if unknown or not {*required} <= {*places}:
            what = f"the header must be {header}"
            if optional:
                what += f", and {','.join(optional)} if needed"
            because = source.header_text
            if unknown and because:
                because += f", but {formatted(unknown[0])} is not one of these"
            raise Refusal(what, where=source.place, because=because)
        values, notes = source.values(places)
        source.issue(notes)
    return {name: values[name] for name in (*required, *optional) if name in values}


def columns_reader(
    required: tuple[str, ...], optional: tuple[str, ...] = ()
) -> Callable[[str, str], dict[str, list]]:
    """Return a function (place, file) that reads a CSV file with a column per key."""

    def read(place: str, file: str) -> dict[str, list]:
        values = columns(place, file, required, optional)
        return {key: x.tolist() for key, x in values.items()}

    return read


def rows_reader(
    key: str, required: tuple[str, ...]
) -> Callable[[str, str], dict[str, list]]:
    """Return a function (place, file) that reads columns of a CSV file as the rows of
    one key."""

    def read(place: str, file: str) -> dict[str, list]:
        values = columns(place, file, required)
        return {key: np.stack([*values.values()], -1).tolist()}

    return read
