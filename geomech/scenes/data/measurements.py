"""CSV files of measured displacements, which figures show with computed ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from geomech.io import rows
from geomech.io.rows import plain, split_unit
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.scenes.format.columns import LARGEST_FILE
from geomech.scenes.format.key import angles_of
from geomech.scenes.model import Scene
from rft.core.checks import unmasked
from rft.core.refusal import Refusal, located

COLUMNS = ("amplitude", "value", "error")
ANGLES = {"": 1.0, "rad": 1.0, "deg": math.pi / 180}
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
HEADER = "amplitude,value,error"


def read(path: str | Path, scene: Scene, angle: bool = False) -> dict[str, np.ndarray]:
    """Return amplitude, value and error (N,) of measured displacements per cycle, in
    the units of the scene's results.

    The header has the columns amplitude and value, and optionally error, in any order.
    A name may have another unit, as amplitude_deg, value_mm or error_BL. angle: values
    are headings. Refusal, with the line, for any other file."""
    source = rows.read(path, LARGEST_FILE, f"give a CSV file with the header {HEADER}")
    length = body_size(scene.system)
    in_angles = "amplitude" in angles_of(type(scene.gait))
    units = units_of(in_angles, length_unit(scene.system), length, angle)
    scales = _scales(source.words, units, source.place, scene.name)
    table = source.numbers(source.words)
    if not len(table):
        raise Refusal(
            "it has no measurements",
            where=source.name,
            instead=f"add rows below the header {HEADER}",
        )
    source.issue()
    columns = {name: scales[name] * x for name, x in zip(scales, table.T)}
    if "error" in columns:
        is_negative = columns["error"] < 0
        if is_negative.any():
            line = source.lines[is_negative.argmax()]
            raise Refusal(
                "an error must not be negative", where=f"{source.name}, line {line}"
            )
    return columns


def converted(data: Mapping, units: dict[str, dict[str, float]]) -> dict:
    """Return amplitude, value and error (N,) of measurements in a table. Its columns
    have the names of those of a file; error may be missing, and others are ignored.
    Refusal for other names."""
    words = [x for x in data if str(x).lower().startswith(COLUMNS)]
    scales = _scales([str(x) for x in words], units, "data", "the table")
    columns = {}
    for (name, scale), word in zip(scales.items(), words):
        columns[name] = scale * unmasked(name, data[word])
    return columns


def units_of(
    in_angles: bool, unit: str, length: float, angle: bool
) -> dict[str, dict[str, float]]:
    """Return the units that each column may have, with their factors to the units of
    the results, by column. in_angles: amplitudes are angles. unit: of lengths in
    results, "BL" or "m". length: of the body in that unit. angle: values are
    headings."""
    amplitude = {"": 1.0}
    if in_angles:
        amplitude = ANGLES
    value = {"": 1.0, "BL": length}
    if unit == "m":
        value |= METRES
    if angle:
        value = ANGLES
    return {"amplitude": amplitude, "value": value, "error": value}


def _scales(
    words: Sequence[str], units: dict[str, dict[str, float]], place: str, owner: str
) -> dict[str, float]:
    """Return the factor of each column from the unit in its name to that of the
    results, by column; Refusal for other columns. owner: of the results, for a
    Refusal."""
    scales: dict[str, float] = {}
    for word in words:
        name, unit = split_unit(word)
        name = plain(name).lower()
        if name not in COLUMNS or name in scales:
            raise Refusal(f"the header must be {HEADER}", value=word, where=place)
        with located(place):
            scales[name] = _scale(name, unit, units[name], owner)
    if not {"amplitude", "value"} <= {*scales}:
        header = ",".join(words)
        raise Refusal(f"the header must be {HEADER}", value=header, where=place)
    return scales


def _scale(name: str, unit: str, units: dict[str, float], owner: str) -> float:
    """Return the factor from the unit of a column to that of the results; Refusal for a
    unit that the column cannot have."""
    if unit in units:
        return units[unit]
    because = ""
    if unit in METRES and "BL" in units:
        because = f"lengths of {owner} are in body lengths"
    cure = f"write {name} without a unit"
    spellings = [f"{name}_{x}" for x in units if x]
    if spellings:
        cure = f"give {' or '.join(spellings)}"
    raise Refusal(
        f"the unit of column {name}_{unit} differs from the scene's",
        because=because,
        instead=cure,
    )
