"""Columns of numbers that a scene takes from CSV files, whatever their order."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from geomech.io import rows
from rft.refusal import Refusal, located

LARGEST_FILE = 20_000_000  # bytes


def columns(
    place: str, path, required: tuple, optional: tuple[str, ...] = ()
) -> dict[str, np.ndarray]:
    """Return the columns ``required``, and those of ``optional`` that the file has. A required column may be a tuple of
    names for the same, returned under the first. Refusal, with ``place`` and the line, for any other file."""
    if not isinstance(path, (str, Path)):
        raise Refusal("file must be the name of a CSV file", value=path, where=place)
    words = [(w,) if isinstance(w, str) else w for w in required]
    header = ",".join(w[0] for w in words)
    with located(place):
        source = rows.read(
            path, LARGEST_FILE, f"give a CSV file with the header {header}"
        )
        line, names = source.header
        allowed = [n for w in words for n in w] + [*optional]
        if (
            [n for n in names if n not in allowed]
            or len({*names}) < len(names)
            or any(not {*w} & {*names} for w in words)
        ):
            more = f", and {','.join(optional)} if wanted" if optional else ""
            raise Refusal(
                f"the header must be {header}{more}",
                where=f"{source.name}, line {line}",
            )
        values = dict(zip(names, source.numbers(names).T))
    result = {w[0]: next(values[n] for n in w if n in values) for w in words}
    return result | {n: values[n] for n in optional if n in values}


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
    """Return a function (place, file) that reads columns of a CSV file as the rows of one key."""
    return lambda place, file: {
        key: np.stack([*columns(place, file, required).values()], -1).tolist()
    }
