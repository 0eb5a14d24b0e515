"""CSV files of drag on a rod: the measured rows, and the sizes in the header lines."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core.errors import choose
from geomech.io.rows import Column, Rows
from geomech.io.rows import read as read_rows
from rft.core.refusal import Refusal

LARGEST_FILE = 10_000_000  # bytes
MOST_ROWS = 100_000
MOST_COMMENTS = 100  # lines in which sizes are looked for
LONGEST_COMMENT = 1000  # letters of each
ANGLE = Column("psi_deg", "angle", "deg", ("psi", "attack_angle"))
ALONG = Column("F_parallel_N", "force", "N", ("f_parallel", "f_par"))
ACROSS = Column("F_perpendicular_N", "force", "N", ("f_perpendicular", "f_perp"))
WEIGHT = Column("weight")
NEEDED = (ANGLE, ALONG, ACROSS)
ENDS = (  # forces on both ends, where the others are on a flank as long as the rod
    Column("end_parallel_N", "force", "N", ("end_parallel", "end_par")),
    Column("end_perpendicular_N", "force", "N", ("end_perpendicular", "end_perp")),
)
SAMPLES = {  # that ship with the package
    "short-rod-drag": "short_rod_drag.csv",
    "flank-drag": "flank_drag.csv",
    "dem-rod-drag": "short_rod_drag.csv",  # its former name
}

# Patterns of sizes in header lines.
NUMBER = r"((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)"
CONNECTIVE = r"\s*(?:of|is|=|:|about)?\s*"
LENGTHS = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "": 1.0}
DENSITIES = {"kg/m": 1.0, "kg m": 1.0, "g/c": 1000.0, "": 1.0}
LENGTH = NUMBER + r"\s*(um|mm|cm|m)\b"
PER_VOLUME = r"\s*\(?(kg/m|kg m|g/c)\^?[^\s,;:=)]*\)?"
DENSITY = r"(?<!packing )(?<!relative )\bdensity"
PACKING = r"\b(?:packing|volume|solid)(?: (?:fraction|density))?"
SIZES = {  # words of each size, and the factor from the number beside them to the size
    "radius": (("radius", 1.0), ("diameter", 0.5)),
    "length": (("length", 1.0), ("long", 1.0)),
    "depth": (("depth", 1.0), ("deep", 1.0)),
}
COMMA = re.compile(r"(?<![\d,])(\d+,\d{1,2})\s*(?:um|mm|cm|m|kg|g/|%)")  # 8,5 mm
SIZE_WORDS = re.compile("radius|diameter|length|long|depth|deep|density|packing", re.I)
OWNERS = {  # objects with sizes, and their words: the nearest one has the size
    "rod": r"\b(?:rod|cylinder|intruder|axis)s?\b",
    "grain": r"\b(?:grain|particle|bead|sphere)s?\b",
    "box": r"\b(?:bed|box|tank|container)s?\b",
}
EXCLUDED_OWNERS = {  # whose sizes of that name are not read
    "radius": ("grain", "box"),
    "length": ("grain", "box"),
    "depth": ("box",),
}


class RodDrag(NamedTuple):
    """Measured drag on a rod.

    rows: (4, N): psi, degrees; forces along and across, N; weight. sizes: in the header
    lines, by name: radius, length, depth, m, and density of the bed, kg/m^3. name: of
    the file. ends: (2, N): forces on both ends along and across, N; None where they are
    part of the others."""

    rows: np.ndarray
    sizes: dict[str, float]
    name: str
    ends: np.ndarray | None = None


def read(path: str | Path) -> RodDrag:
    """Return the drag in a CSV file, or in one of `SAMPLES`; Refusal if it has none.

    Columns, in any order: psi_deg, F_parallel_N, F_perpendicular_N. Optional ones:
    weight (of the squares, 1 if left out), and end_parallel_N and end_perpendicular_N
    (on both ends, where the others are on a flank as long as the rod). Other columns
    are ignored. Lines that begin with # may give the rod's diameter or radius, length
    and depth, and the grains' density and packing, in words as in the sample or as
    ``radius = 8 mm``.
    """
    if str(path) in SAMPLES:
        source = resources.files("geomech.scenes") / "builtin" / SAMPLES[str(path)]
        with resources.as_file(source) as file:
            return _rod_drag(read_rows(file, LARGEST_FILE, ""))
    if Path(path).suffix != ".csv" and not Path(path).exists():
        choose("drag", str(path), [*SAMPLES, "a CSV file"])
    return _rod_drag(
        read_rows(
            path,
            LARGEST_FILE,
            "give a CSV file with columns psi_deg,F_parallel_N,F_perpendicular_N",
        )
    )


def _rod_drag(source: Rows) -> RodDrag:
    has_ends = bool(source.find((), ENDS))
    required = (*NEEDED, *ENDS) if has_ends else NEEDED
    columns = source.take(required, (WEIGHT,))
    psi = columns[ANGLE.name]
    count = len(psi)
    if not 0 < count <= MOST_ROWS:
        raise Refusal(
            f"it must have 1 to {MOST_ROWS} rows of drag, got {count}",
            where=source.name,
        )
    too_large = np.flatnonzero(np.abs(psi) > 360)
    if too_large.size:
        k = too_large[0]
        raise Refusal(
            f"{ANGLE.name} must be from -360 to 360, got {psi[k]:g}",
            where=f"{source.name}, line {source.lines[k]}",
        )
    forces = [columns[ALONG.name], columns[ACROSS.name]]
    weight = columns.get(WEIGHT.name, np.ones(count))
    ends = None
    if has_ends:
        ends = np.stack([columns[x.name] for x in ENDS])
    rows = np.stack([psi, *forces, weight])
    return RodDrag(rows, sizes(source), source.name, ends)


def sizes(source: Rows) -> dict[str, float]:
    """Return the radius, length, depth and density that the comments give, by name;
    Refusal if they give two values of one."""
    comments = [line[:LONGEST_COMMENT] for line in source.comments[:MOST_COMMENTS]]
    for line in comments:
        comma = COMMA.search(line)
        if comma and SIZE_WORDS.search(line):
            raise Refusal(
                f"{comma[1]} in the header lines may be one number or two",
                where=source.name,
                instead="write a decimal point, or a space after the comma",
            )
    values_by_name: defaultdict[str, set[float]] = defaultdict(set)
    is_bulk = False  # the density is that of the bed, not of the grains
    for part, last_owner in _parts(comments):
        for name, value, place in _lengths(part):
            if _owner(part, place, last_owner) not in EXCLUDED_OWNERS[name]:
                values_by_name[name].add(value)
        if "rod density" not in part and "density of the rod" not in part:
            values_by_name["density"] |= _densities(part)
            if "density" in part and re.search("bulk|effective", part):
                is_bulk = True
        values_by_name["packing"] |= _packings(part)
    values: dict[str, float] = {}
    for name, found in values_by_name.items():
        if len(found) > 1:
            listed = " and ".join(f"{x:g}" for x in sorted(found))
            raise Refusal(
                f"the header lines give {name} = {listed}",
                where=source.name,
                instead="keep one of them",
            )
        if found:
            values[name] = found.pop()
    packing = values.pop("packing", 1.0)
    if "density" in values and not is_bulk:
        values["density"] *= packing
    return values


def _parts(comments: list[str]) -> Iterator[tuple[str, str]]:
    """Yield the words between commas, and the object whose sizes they give if they name
    none: the one that was named last in the sentence, or ""."""
    text = re.sub(r"(?<=\d),(?=\d{3}\b)", "", "\n".join(comments).lower())  # 1,030
    for sentence in re.split(r";|\n|\. ", text):
        last_owner = ""
        for part in sentence.split(","):
            yield part.replace("_", " "), last_owner
            last_owner = _owner(part, len(part), last_owner)


def _owner(part: str, place: int, last_owner: str) -> str:
    """Return the object that is named nearest to a place in some words; ``last_owner``
    if they name none."""
    candidates = []
    for owner, words in OWNERS.items():
        for match in re.finditer(words, part):
            candidates.append((abs(match.start() - place), owner))
    if not candidates:
        return last_owner
    _, owner = min(candidates)
    return owner


def _lengths(part: str) -> Iterator[tuple[str, float, int]]:
    """Yield name, value in m and place of all lengths that some words give."""
    for name, words in SIZES.items():
        for word, factor in words:
            for number, unit, place in _lengths_of(rf"\b{word}\b", part):
                yield name, _rounded(float(number) * LENGTHS[unit] * factor), place
    # diameter x 40 mm: the number after the x is the length
    for m in re.finditer(r"(?:diameter|radius)\s*(?:x|by|times)\s*" + LENGTH, part):
        yield "length", _rounded(float(m[1]) * LENGTHS[m[2]]), m.start()


def _lengths_of(pattern: str, part: str) -> Iterator[tuple[str, str, int]]:
    """Yield number, unit and place of the lengths beside a pattern in some words."""
    for m in re.finditer(LENGTH + r"\s*(?:in\s+)?" + pattern, part):
        yield m[1], m[2], m.start()
    for m in re.finditer(pattern + CONNECTIVE + LENGTH, part):
        yield m[1], m[2], m.start()
    # radius_mm = 8, radius = 0.008
    unit_first = (
        rf"{pattern}\s*\(?(um|mm|cm|m|)\)?\s*[=:]\s*{NUMBER}\s*(?![\s\d.e]*[cmu]?m)"
    )
    for m in re.finditer(unit_first, part):
        yield m[2], m[1], m.start()


def _densities(part: str) -> set[float]:
    """Return the densities that some words give, kg/m^3."""
    matches = re.findall(DENSITY + CONNECTIVE + NUMBER + PER_VOLUME, part)
    matches += re.findall(NUMBER + PER_VOLUME + r"\s+density", part)
    for unit, number in re.findall(DENSITY + PER_VOLUME + CONNECTIVE + NUMBER, part):
        matches.append((number, unit))
    if not matches:
        for number in re.findall(DENSITY + CONNECTIVE + NUMBER, part):
            matches.append((number, ""))
    return {_rounded(float(number) * DENSITIES[unit]) for number, unit in matches}


def _packings(part: str) -> set[float]:
    """Return the volume fractions of grains that some words give."""
    pattern = PACKING + CONNECTIVE + NUMBER + r"\s*(%?)"
    packings = set()
    for number, percent in re.findall(pattern, part):
        packings.add(float(number) / 100 if percent else float(number))
    return packings


def _rounded(x: float) -> float:
    """Return x without the digits that a change of units adds."""
    return float(f"{x:.12g}") if math.isfinite(x) else x
