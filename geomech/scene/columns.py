"""Columns of numbers that a scene takes from CSV files, whatever their order."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from geomech.io import rows
from rft.refusal import Refusal, located

LARGEST_FILE = 20_000_000  # bytes


def columns(place: str, path, wanted: tuple, optional: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
    """The columns ``wanted``, and those of ``optional`` that are there. One of wanted may be a tuple of names for the same,
    found under the first. Refusal, with ``place`` and the line, for what is no such file."""
    if not isinstance(path, (str, Path)):
        raise Refusal("file must be the name of a CSV file", value=path, where=place)
    wanted = [(w,) if isinstance(w, str) else w for w in wanted]
    header = ",".join(w[0] for w in wanted)
    with located(place):
        source = rows.read(path, LARGEST_FILE, f"give a CSV file with the header {header}")
        line, names = source.header
        known = [n for w in wanted for n in w] + [*optional]
        if (
            [n for n in names if n not in known]
            or len({*names}) < len(names)
            or any(not {*w} & {*names} for w in wanted)
        ):
            more = f", and {','.join(optional)} if wanted" if optional else ""
            raise Refusal(f"the header must be {header}{more}", where=f"{source.name}, line {line}")
        values = dict(zip(names, source.numbers(names).T))
    found = {w[0]: next(values[n] for n in w if n in values) for w in wanted}
    return found | {n: values[n] for n in optional if n in values}


def series(wanted: tuple[str, ...], optional: tuple[str, ...] = ()) -> Callable[[str, str], dict[str, list]]:
    """Return a function (place, file) that reads a column of a CSV file for each key."""
    return lambda place, file: {key: x.tolist() for key, x in columns(place, file, wanted, optional).items()}


def rows_of(key: str, wanted: tuple[str, ...]) -> Callable[[str, str], dict[str, list]]:
    """Return a function (place, file) that reads columns of a CSV file as the rows of one key."""
    return lambda place, file: {key: np.stack([*columns(place, file, wanted).values()], -1).tolist()}
