"""CSV files of measured displacements, to be drawn beside computed ones."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from geomech.io import rows
from geomech.scenes.columns import LARGEST_FILE
from geomech.scenes.key import angles_of
from geomech.scenes.model import Scene
from geomech.systems.base import length_unit
from rft.bodies.base import body_size
from rft.refusal import Refusal, located

COLUMNS = ("amplitude", "value", "error")
ANGLES = {"": 1.0, "rad": 1.0, "deg": math.pi / 180}
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
HEADER = "amplitude,value,error"


def read(path: str | Path, scene: Scene, angle: bool = False) -> dict[str, np.ndarray]:
    """Return amplitude, value and error (N,) of measured displacements per cycle, in the units of the scene's results.

    The header names the columns amplitude and value, and error if wanted, in any order, with the unit behind it where that
    is another, as amplitude_deg, value_mm or error_BL. angle: values are headings. Refusal, with the line, for any other."""
    source = rows.read(path, LARGEST_FILE, f"give a CSV file with the header {HEADER}")
    line, words = source.header
    units, found = _units(scene, angle), {}
    for word in words:
        match = re.fullmatch(
            r"(amplitude|value|error)(?:[ _]*[\(\[]?([a-z]+)[\)\]]?)?", word
        )
        if match is None or match[1] in found:
            raise Refusal(
                f"the header must be {HEADER}",
                value=word,
                where=f"{source.name}, line {line}",
            )
        with located(f"{source.name}, line {line}"):
            found[match[1]] = _scale(match[1], match[2] or "", units[match[1]], scene)
    if not {"amplitude", "value"} <= {*found}:
        raise Refusal(
            f"the header must be {HEADER}",
            value=",".join(words),
            where=f"{source.name}, line {line}",
        )
    table = source.numbers(words)
    if not len(table):
        raise Refusal(
            "it has no measurement",
            where=source.name,
            instead=f"add rows below the header {HEADER}",
        )
    columns = {name: scale * x for (name, scale), x in zip(found.items(), table.T)}
    if (columns.get("error", np.zeros(1)) < 0).any():
        bad = int(source.lines[int((columns["error"] < 0).argmax())])
        raise Refusal(
            "an error must not be negative", where=f"{source.name}, line {bad}"
        )
    return columns


def _units(scene: Scene, angle: bool) -> dict[str, dict[str, float]]:
    """Return, by column, the units that it may have, in that of the scene's results."""
    amplitude = ANGLES if "amplitude" in angles_of(type(scene.gait)) else {"": 1.0}
    lengths = {"": 1.0, "bl": body_size(scene.system)}
    lengths |= METRES if length_unit(scene.system) == "m" else {}
    value = ANGLES if angle else lengths
    return {"amplitude": amplitude, "value": value, "error": value}


def _scale(name: str, unit: str, units: dict[str, float], scene: Scene) -> float:
    """Return the factor from the unit of a column to that of the results; Refusal for a unit that the column cannot have."""
    if unit in units:
        return units[unit]
    such = [f"{name}_{'BL' if x == 'bl' else x}" for x in units if x]
    why = (
        f"lengths of {scene.name} are in body lengths"
        if unit in METRES and "bl" in units
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
