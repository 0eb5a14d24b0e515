"""CSV files of measured displacements, to be drawn beside computed ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from geomech.io import rows
from geomech.io.rows import plain, split_unit
from geomech.scenes.columns import LARGEST_FILE
from geomech.scenes.key import angles_of
from geomech.scenes.model import Scene
from geomech.systems.base import body_size, length_unit
from rft.core.checks import unmasked
from rft.core.refusal import Refusal, located

COLUMNS = ("amplitude", "value", "error")
ANGLES = {"": 1.0, "rad": 1.0, "deg": math.pi / 180}
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
HEADER = "amplitude,value,error"


def read(path: str | Path, scene: Scene, angle: bool = False) -> dict[str, np.ndarray]:
    """Return amplitude, value and error (N,) of measured displacements per cycle, in the units of the scene's results.

    The header names the columns amplitude and value, and error if wanted, in any order, with the unit behind it where that
    is another, as amplitude_deg, value_mm or error_BL. angle: values are headings. Refusal, with the line, for any other."""
    source = rows.read(path, LARGEST_FILE, f"give a CSV file with the header {HEADER}")
    length = body_size(scene.system)
    in_angles = "amplitude" in angles_of(type(scene.gait))
    units = units_of(in_angles, length_unit(scene.system), length, angle)
    found = _scales(source.words, units, source.place, scene.name)
    table = source.numbers(source.words)
    if not len(table):
        raise Refusal(
            "it has no measurement",
            where=source.name,
            instead=f"add rows below the header {HEADER}",
        )
    source.tell()
    columns = {name: scale * x for (name, scale), x in zip(found.items(), table.T)}
    if (columns.get("error", np.zeros(1)) < 0).any():
        bad = int(source.lines[int((columns["error"] < 0).argmax())])
        raise Refusal(
            "an error must not be negative", where=f"{source.name}, line {bad}"
        )
    return columns


def converted(data: Mapping, units: dict[str, dict[str, float]]) -> dict:
    """Return amplitude, value and error (N,) of measurements that a caller has, named as
    the columns of a file are; error may be missing. Refusal for other names."""
    own = [x for x in data if str(x).lower().startswith(COLUMNS)]  # beside others
    scales = _scales([str(x) for x in own], units, "data", "the table")
    names = dict(zip(scales, own))
    return {
        name: scale * unmasked(name, data[names[name]])
        for name, scale in scales.items()
    }


def units_of(
    in_angles: bool, unit: str, length: float, angle: bool
) -> dict[str, dict[str, float]]:
    """Return, by column, the units that it may have, in those of results in ``unit``, "BL"
    or "m". in_angles: amplitudes are angles. length: of the body in that unit. angle:
    values are headings."""
    amplitude = {"": 1.0}
    if in_angles:
        amplitude = ANGLES
    lengths = {"": 1.0, "BL": length} | (METRES if unit == "m" else {})
    value = ANGLES if angle else lengths
    return {"amplitude": amplitude, "value": value, "error": value}


def _scales(
    words: Sequence[str], units: dict[str, dict[str, float]], place: str, owner: str
) -> dict[str, float]:
    """Return the factor of each column from the unit in its name to that of the results
    of ``owner``; Refusal for a header that is none."""
    found: dict[str, float] = {}
    for word in words:
        name, unit = split_unit(word)
        name = plain(name).lower()
        if name not in COLUMNS or name in found:
            raise Refusal(f"the header must be {HEADER}", value=word, where=place)
        with located(place):
            found[name] = _scale(name, unit, units[name], owner)
    if not {"amplitude", "value"} <= {*found}:
        given = ",".join(words)
        raise Refusal(f"the header must be {HEADER}", value=given, where=place)
    return found


def _scale(name: str, unit: str, units: dict[str, float], owner: str) -> float:
    """Return the factor from the unit of a column to that of the results; Refusal for a unit that the column cannot have."""
    if unit in units:
        return units[unit]
    such = [f"{name}_{x}" for x in units if x]
    why = (
        f"lengths of {owner} are in body lengths"
        if unit in METRES and "BL" in units
        else ""
    )
    instead = (
        f"give {' or '.join(such)}"
        if such
        else f"give {name} alone, it has no unit here"
    )
    raise Refusal(
        f"column {name}_{unit} has another unit than the scene's",
        because=why,
        instead=instead,
    )
