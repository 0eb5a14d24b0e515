"""CSV files of a level plate pushed straight down: depth, force, and the area of the
plate in a column or a header line."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np

from geomech.io.rows import Column, Rows, plain, split_unit
from geomech.scenes.data.drag import (
    CONNECTIVE,
    LENGTHS,
    LONGEST_COMMENT,
    MOST_COMMENTS,
    NUMBER,
)
from rft.core.refusal import Refusal

DEPTHS = ("depth", "penetration_depth", "sinkage", "penetration")
DEPTH = Column("depth", "length", "m", DEPTHS)
HEIGHT = Column("z", "length", "m", ("z",))  # upwards
FORCE = Column("force", "force", "N", ("force", "force_z", "f", "fz", "f_z"))
AREA = Column("area", "area", "m2", ("area", "plate_area"))
SQUARE = r"(um|mm|cm|m)\s*(?:\^|\*\*)?\s*[2²]"


class Penetration(NamedTuple):
    """A measured penetration test.

    depth: (N,), m, positive downwards. force: (N,), N, positive upwards. area: of the
    plate, m^2, (1,) or (N,); None if the file does not give it. name: of the file."""

    depth: np.ndarray
    force: np.ndarray
    area: np.ndarray | None
    name: str


def read(source: Rows) -> Penetration:
    """Return the test in a file; Refusal if it has none.

    Columns, in any order: depth and force, and optionally area, each in its SI unit or
    with another unit in its name, as depth_mm, force_N or area_cm2; others are ignored.
    In place of depth may stand sinkage, or z, upwards, and force_z for force. A header
    line may give the area: ``# plate area = 9.5 cm^2``, ``# plate 38 x 25 mm``, or
    ``# plate diameter 4 cm``."""
    places = source.find((), (DEPTH, HEIGHT, FORCE, AREA))
    if "depth" in places and "z" in places:
        raise Refusal(
            "the header has two columns of depth",
            where=source.place,
            instead="keep one of them",
        )
    for name, spellings in (("depth", {"depth", "z"}), ("force", {"force"})):
        if not spellings & {*places}:
            raise Refusal(
                f"the header has no column {name}",
                where=source.place,
                because=source.header_text,
                instead="it must have depth_m,force_N (or depth_mm, depth_cm; z_m, "
                "force_z)",
            )
    values, notes = source.values(places)
    if "depth" in places:
        depth = values["depth"]
        word, _ = split_unit(source.words[places["depth"].index])
        if plain(word) not in ("depth", "penetration_depth"):
            notes = (*notes, f"{word} is assumed to be the depth")
    else:
        depth = -values["z"]
    source.issue(notes)
    area = values.get("area")
    area_of_header = _area(source)
    if area_of_header is not None:
        if area is not None:
            raise Refusal(
                "the area is given both in a column and in a header line",
                where=source.name,
                instead="keep one of them",
            )
        area = np.array([area_of_header])
    return Penetration(depth, values["force"], area, source.name)


def is_penetration(source: Rows) -> bool:
    """Return whether a file has a depth, in any unit, or z and a force."""
    if any(plain(word).startswith(DEPTHS) for word in source.words):
        return True
    return _has(source, HEIGHT) and _has(source, FORCE)


def _has(source: Rows, column: Column) -> bool:
    return any(column.matches(word) is not None for word in source.words)


def _area(source: Rows) -> float | None:
    """Return the area in the header lines, m^2; None without one, Refusal if they give
    two."""
    areas: set[float] = set()
    for line in source.comments[:MOST_COMMENTS]:
        text = line[:LONGEST_COMMENT].lower()
        areas |= _areas_in(text) | _rectangles_in(text) | _circles_in(text)
    if len(areas) > 1:
        listed = " and ".join(f"{x:g}" for x in sorted(areas))
        raise Refusal(
            f"the header lines give areas {listed} m^2",
            where=source.name,
            instead="keep one of them",
        )
    return areas.pop() if areas else None


def _areas_in(text: str) -> set[float]:
    """Return the areas that a line gives as such, m^2: "area 9.5 cm^2", "area_cm2 =
    9.5", or "area = 9.5e-4" without a unit."""
    matches = re.findall(r"\barea" + CONNECTIVE + NUMBER + r"\s*" + SQUARE, text)
    unit_first = r"\barea[ _]*[\(\[]?" + SQUARE + r"[\)\]]?\s*[=:]?\s*" + NUMBER
    for unit, number in re.findall(unit_first, text):
        matches.append((number, unit))
    if matches:
        return {_rounded(float(x) * LENGTHS[unit] ** 2) for x, unit in matches}
    return set(map(float, re.findall(r"\barea\s*[=:]\s*" + NUMBER + r"\s*$", text)))


def _rectangles_in(text: str) -> set[float]:
    """Return the areas of plates that a line gives by two sides, m^2: "plate 38 x 25
    mm"."""
    side = NUMBER + r"\s*(mm|cm|m)"
    pattern = r"\bplate\b[^\d]*" + side + r"?\s*(?:x|by|times)\s*" + side + r"\b"
    areas = set()
    for a, unit_a, b, unit_b in re.findall(pattern, text):
        length = float(a) * LENGTHS[unit_a or unit_b]
        areas.add(_rounded(length * float(b) * LENGTHS[unit_b]))
    return areas


def _circles_in(text: str) -> set[float]:
    """Return the areas of plates that a line gives by a diameter, m^2: "plate diameter
    4 cm"."""
    diameter = r"\bdiameter" + CONNECTIVE + NUMBER + r"\s*(um|mm|cm|m)\b"
    areas = set()
    for number, unit in re.findall(r"\bplate\b[^\d,;]*" + diameter, text):
        areas.add(_rounded(math.pi / 4 * (float(number) * LENGTHS[unit]) ** 2))
    return areas


def _rounded(x: float) -> float:
    """Return x without the digits that a change of units adds."""
    return float(f"{x:.12g}")
