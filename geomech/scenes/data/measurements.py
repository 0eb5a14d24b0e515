"""CSV files of measured displacements, which figures show with computed ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from geomech.io import rows
from geomech.io.rows import plain, split_unit
from geomech.mathematics.gaits.wound import unwound
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.scenes.format.columns import LARGEST_FILE
from geomech.scenes.format.key import angles_of
from geomech.scenes.model import Scene
from rft.core.checks import unmasked
from rft.core.refusal import Refusal, located

LENGTHS = ("x", "y", "net_distance")  # quantities that are lengths
QUANTITIES = (*LENGTHS, "heading")
COLUMNS = (
    "amplitude",
    "value",
    "error",
    *QUANTITIES,
    *(f"{name}_error" for name in QUANTITIES),
)
SYNONYMS = {"distance": "net_distance", "theta": "heading"}
ANGLES = {"": 1.0, "rad": 1.0, "deg": math.pi / 180}
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
HEADER = "amplitude,value,error"
NAMED_HEADER = "amplitude,x,x_error,net_distance,net_distance_error"


def read(path: str | Path, scene: Scene, angle: bool = False) -> dict[str, np.ndarray]:
    """Return columns (N,) of measured displacements per cycle, in the units of the
    scene's results.

    The header has the columns amplitude and value, and optionally error, in any order;
    or, in place of value, some of x, y, net_distance (or distance) and heading, each
    with its error, such as x_error. A name may have another unit, as amplitude_deg,
    value_mm or x_error_BL; an error without one has that of its quantity. angle: values
    are headings. Refusal, with the line, for any other file."""
    source = rows.read(path, LARGEST_FILE, f"give a CSV file with the header {HEADER}")
    length = body_size(scene.system)
    in_angles = "amplitude" in angles_of(type(unwound(scene.gait)))
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
    for name in columns:
        is_negative = columns[name] < 0
        if name.endswith("error") and is_negative.any():
            line = source.lines[is_negative.argmax()]
            raise Refusal(
                "an error must not be negative", where=f"{source.name}, line {line}"
            )
    return columns


def converted(data: Mapping, units: dict[str, dict[str, float]]) -> dict:
    """Return columns (N,) of measurements in a table. Its columns have the names of
    those of a file; errors may be missing, and others are ignored. Refusal for a table
    without measurements."""
    words = [x for x in data if column_of(str(x))[0] in COLUMNS]
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
    if unit in METRES:
        value |= {name: size / METRES[unit] for name, size in METRES.items()}
    named = dict.fromkeys(LENGTHS, value) | {"heading": ANGLES}
    errors = {f"{name}_error": found for name, found in named.items()}
    if angle:
        value = ANGLES
    return {"amplitude": amplitude, "value": value, "error": value, **named, **errors}


def swept_points(
    data: str | Path | Mapping, parameter: str, units: Mapping[str, dict[str, float]]
) -> dict[str, np.ndarray]:
    """Return columns (N,) of what was measured at values of a swept parameter:
    parameter, value and, if there is one, error.

    data: a file or a table with a column of the parameter, named as a whole or by its
    last part, such as medium.C or C, and one of the quantities. units: the quantities
    that are drawn, such as net_distance, with the factors of their units; value stands
    for the first. Refusal, with the place, for anything else."""
    last = parameter.rpartition(".")[2]
    source = None
    place = "data"
    words = [str(word) for word in data] if isinstance(data, Mapping) else []
    if isinstance(data, str | Path):
        header = f"give a CSV file with the header {last},value,error"
        source = rows.read(data, LARGEST_FILE, header)
        words = [*source.words]
        place = source.place
    found: dict[str, tuple[str, float]] = {}
    for word in words:
        name, factor = word.strip(), 1.0
        if name.lower() not in (parameter.lower(), last.lower()):
            name, factor = _swept_column(word, words, units, place)
            if not name:
                continue
        else:
            name = "parameter"
        if name in found:
            raise Refusal(f"the header names {name} twice", where=place)
        found[name] = (word, factor)
    if not {"parameter", "value"} <= {*found}:
        raise Refusal(
            f"the header must be {last},value,error",
            value=",".join(words),
            where=place,
            instead=f"or name the quantity, such as {last},{next(iter(units))}",
        )
    if source is None:
        table = {name: unmasked(name, data[word]) for name, (word, _) in found.items()}
    else:
        wanted = [word for word, _ in found.values()]
        table = dict(zip(found, source.numbers(wanted).T))
        source.issue()
    return {name: factor * table[name] for name, (_, factor) in found.items()}


def _swept_column(
    word: str, words: Sequence[str], units: Mapping[str, dict[str, float]], place: str
) -> tuple[str, float]:
    """Return value or error for a column, with the factor of its unit; "" for one that
    is not drawn."""
    name, unit = column_of(word)
    unit = unit or dict(map(column_of, words)).get(quantity_of_error(name), "")
    ending = "error" if name.endswith("error") else "value"
    quantity = name.removesuffix("_error")
    if name in ("value", "error"):
        quantity = next(iter(units))
    if quantity not in units:
        return "", 1.0
    with located(place):
        return ending, _scale(name, unit, units[quantity], "the scene")


def points_of(
    columns: Mapping[str, np.ndarray], quantity: str, value_of: Sequence[str]
) -> dict[str, np.ndarray] | None:
    """Return amplitude, value and, if there is one, error (N,) of the measurements of a
    quantity; None without any.

    The net distance follows from x and y if both are there. value_of: quantities that a
    column value stands for, of the net distance by its size."""
    amplitude = columns["amplitude"]
    if quantity in columns:
        value = columns[quantity]
        error = columns.get(f"{quantity}_error")
    elif quantity == "net_distance" and "x" in columns and "y" in columns:
        x, y = columns["x"], columns["y"]
        value = np.hypot(x, y)
        error = None
        if "x_error" in columns and "y_error" in columns:
            length = np.where(value > 0, value, 1.0)
            parts = (x * columns["x_error"], y * columns["y_error"])
            error = np.hypot(*parts) / length
    elif "value" in columns and quantity in value_of:
        value = columns["value"]
        error = columns.get("error")
        if quantity == "net_distance":
            value = np.abs(value)
    else:
        return None
    found = {"amplitude": amplitude, "value": value}
    if error is not None:
        found["error"] = error
    return found


def scaled(
    columns: Mapping[str, np.ndarray], factor: float, angle: bool
) -> dict[str, np.ndarray]:
    """Return columns with their lengths times a factor. angle: values are headings."""
    found = {}
    for name, values in columns.items():
        is_value = name in ("value", "error") and not angle
        is_length = name.removesuffix("_error") in LENGTHS
        found[name] = factor * values if is_value or is_length else values
    return found


def column_of(word: str) -> tuple[str, str]:
    """Return the column that a word of a header names, and its unit."""
    name, unit = split_unit(word)
    name = plain(name).lower()
    ending = "_error" if name.endswith("_error") else ""
    quantity = name.removesuffix(ending)
    return SYNONYMS.get(quantity, quantity) + ending, unit


def _scales(
    words: Sequence[str], units: dict[str, dict[str, float]], place: str, owner: str
) -> dict[str, float]:
    """Return the factor of each column from the unit in its name to that of the
    results, by column; Refusal for other columns. owner: of the results, for a
    Refusal."""
    scales: dict[str, float] = {}
    named = dict(map(column_of, words))
    for word in words:
        name, unit = column_of(word)
        unit = unit or named.get(quantity_of_error(name), "")
        if name not in COLUMNS or name in scales:
            raise Refusal(
                f"the header must be {HEADER}",
                value=word,
                where=place,
                instead=f"or name quantities, such as {NAMED_HEADER}",
            )
        with located(place):
            scales[name] = _scale(name, unit, units[name], owner)
    measured = {"value", *QUANTITIES} & {*scales}
    errors = {name for name in scales if name.endswith("error")}
    without = errors - {"error" if x == "value" else f"{x}_error" for x in measured}
    if "amplitude" not in scales or not measured or without:
        header = ",".join(words)
        raise Refusal(f"the header must be {HEADER}", value=header, where=place)
    return scales


def quantity_of_error(name: str) -> str:
    """Return the column whose error is in a column, and whose unit an error without one
    has; "" for a column that is no error."""
    if name == "error":
        return "value"
    if name.endswith("_error"):
        return name.removesuffix("_error")
    return ""


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
