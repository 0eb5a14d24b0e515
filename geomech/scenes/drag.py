"""CSV files of drag on a rod: the measured rows, and the sizes that the header lines give."""

from __future__ import annotations

import math
import re
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
MOST_COMMENTS, LONGEST_COMMENT = (
    100,
    1000,
)  # lines, and letters of each, that are looked through for sizes
ANGLE = Column("psi_deg", "angle", "deg", ("psi", "attack_angle"))
ALONG = Column("F_parallel_N", "force", "N", ("f_parallel", "f_par"))
ACROSS = Column("F_perpendicular_N", "force", "N", ("f_perpendicular", "f_perp"))
WEIGHT = Column("weight")
NEEDED = (ANGLE, ALONG, ACROSS)
ENDS = (  # where the others are those on a flank as long as the rod
    Column("end_parallel_N", "force", "N", ("end_parallel", "end_par")),
    Column("end_perpendicular_N", "force", "N", ("end_perpendicular", "end_perp")),
)
SAMPLES = {  # that ship with the package
    "short-rod-drag": "short_rod_drag.csv",
    "flank-drag": "flank_drag.csv",
    "dem-rod-drag": "short_rod_drag.csv",  # its name before
}

NUMBER, CONNECTIVE = (
    r"((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)",
    r"\s*(?:of|is|=|:|about)?\s*",
)
LENGTHS = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "": 1.0}
DENSITIES = {"kg/m": 1.0, "kg m": 1.0, "g/c": 1000.0, "": 1.0}
LENGTH, PER_VOLUME = (
    NUMBER + r"\s*(um|mm|cm|m)\b",
    r"\s*\(?(kg/m|kg m|g/c)\^?[^\s,;:=)]*\)?",
)
DENSITY, PACKING = (
    r"(?<!packing )(?<!relative )\bdensity",
    r"\b(?:packing|volume|solid)(?: (?:fraction|density))?",
)
SIZES = {  # words of a header line, and the share of the number beside them that is meant
    "radius": (("radius", 1.0), ("diameter", 0.5)),
    "length": (("length", 1.0), ("long", 1.0)),
    "depth": (("depth", 1.0), ("deep", 1.0)),
}
COMMA = re.compile(r"(?<![\d,])(\d+,\d{1,2})\s*(?:um|mm|cm|m|kg|g/|%)")  # 8,5 mm
SIZE_WORDS = re.compile("radius|diameter|length|long|depth|deep|density|packing", re.I)
OWNERS = {  # what a size belongs to, by the nearest of these words
    "rod": r"\b(?:rod|cylinder|intruder|axis)s?\b",
    "grain": r"\b(?:grain|particle|bead|sphere)s?\b",
    "box": r"\b(?:bed|box|tank|container)s?\b",
}
EXCLUDED_OWNERS = {
    "radius": ("grain", "box"),
    "length": ("grain", "box"),
    "depth": ("box",),
}


class Measured(NamedTuple):
    """Measured drag on a rod. rows: psi (degrees), forces along and across (N), weight, (4, N). sizes: of radius,
    length, depth (m) and density (kg/m^3, of the bed), those in the header lines. name: of the file. ends: (2, N), forces on
    both ends along and across, N; None where they are part of the others."""

    rows: np.ndarray
    sizes: dict[str, float]
    name: str
    ends: np.ndarray | None = None


def read(path: str | Path) -> Measured:
    """Return the drag in a CSV file, or in one of `SAMPLES`; Refusal if it has none.

    Columns, by the header line and in any order: psi_deg, F_parallel_N, F_perpendicular_N and, if wanted, weight (of the
    squares; 1 where left out), end_parallel_N and end_perpendicular_N (of both ends, where the others are those on a flank as
    long as the rod); others are ignored. Lines that begin with # may give the rod's diameter or radius, length and
    depth, the grains' density and packing, in words as in the sample or as ``radius = 8 mm``.
    """
    if str(path) in SAMPLES:
        source = resources.files("geomech.scenes") / "builtin" / SAMPLES[str(path)]
        with resources.as_file(source) as file:
            return _measured(read_rows(file, LARGEST_FILE, ""))
    if Path(path).suffix != ".csv" and not Path(path).exists():
        choose("drag", str(path), [*SAMPLES, "a CSV file"])
    return _measured(
        read_rows(
            path,
            LARGEST_FILE,
            "give a CSV file with columns psi_deg,F_parallel_N,F_perpendicular_N",
        )
    )


def _measured(source: Rows) -> Measured:
    has_ends = bool(source.find((), ENDS))
    needed = (*NEEDED, *ENDS) if has_ends else NEEDED
    columns = source.take(needed, (WEIGHT,))
    values = [columns[x.name] for x in NEEDED]
    count = len(values[0])
    if not 0 < count <= MOST_ROWS:
        raise Refusal(
            f"it must have 1 to {MOST_ROWS} rows of drag, got {count}",
            where=source.name,
        )
    if (far := np.flatnonzero(np.abs(values[0]) > 360)).size:
        line = source.lines[far[0]]
        raise Refusal(
            f"{ANGLE.name} must be from -360 to 360, got {values[0][far[0]]:g}",
            where=f"{source.name}, line {line}",
        )
    weight = columns.get(WEIGHT.name, np.ones(count))
    ends = np.stack([columns[x.name] for x in ENDS]) if has_ends else None
    return Measured(np.stack([*values, weight]), sizes(source), source.name, ends)


def sizes(source: Rows) -> dict[str, float]:
    """Return the radius, length, depth and density that the comments give, by name; Refusal if they give two values of
    one."""
    values_by_name: dict[str, set[float]] = {}
    bulk = False
    for line in source.comments[:MOST_COMMENTS]:
        comma = COMMA.search(line[:LONGEST_COMMENT])
        if comma and SIZE_WORDS.search(line[:LONGEST_COMMENT]):
            raise Refusal(
                f"{comma[1]} in the header lines may be one number or two",
                where=source.name,
                instead="write a decimal point, or a blank after the comma",
            )
    for part, before in _parts(
        [line[:LONGEST_COMMENT] for line in source.comments[:MOST_COMMENTS]]
    ):
        for name, value, place in _lengths(part):
            if _owner(part, place, before) not in EXCLUDED_OWNERS[name]:
                values_by_name.setdefault(name, set()).add(value)
        if "rod density" not in part and "density of the rod" not in part:
            values_by_name.setdefault("density", set()).update(_densities(part))
            bulk |= "density" in part and bool(re.search("bulk|effective", part))
        for number, percent in re.findall(
            PACKING + CONNECTIVE + NUMBER + r"\s*(%?)", part
        ):
            values_by_name.setdefault("packing", set()).add(
                float(number) / (100 if percent else 1)
            )
    for name, values in values_by_name.items():
        if len(values) > 1:
            listed = " and ".join(f"{x:g}" for x in sorted(values))
            raise Refusal(
                f"the header lines give {name} = {listed}",
                where=source.name,
                instead="keep one",
            )
    out = {name: value for name, values in values_by_name.items() for value in values}
    packing = out.pop("packing", 1.0)
    return {
        name: x * packing if name == "density" and not bulk else x
        for name, x in out.items()
    }


def _parts(comments: list[str]):
    """Yield (words between commas, the object whose sizes they are unless they name another: the one named last in the
    sentence, or "")."""
    text = re.sub(r"(?<=\d),(?=\d{3}\b)", "", "\n".join(comments).lower())  # 1,030
    for sentence in re.split(r";|\n|\. ", text):
        before = ""
        for part in sentence.split(","):
            yield part.replace("_", " "), before
            before = _owner(part, len(part), before)


def _owner(part: str, place: int, before: str) -> str:
    candidates = [
        (abs(m.start() - place), owner)
        for owner, words in OWNERS.items()
        for m in re.finditer(words, part)
    ]
    return min(candidates)[1] if candidates else before


def _lengths(part: str):
    """Yield (name, m, place) of all lengths that are named in some words."""
    for name, words in SIZES.items():
        for word, share in words:
            pattern = rf"\b{word}\b"
            matches = [
                (*m.groups(), m.start())
                for m in re.finditer(LENGTH + r"\s*(?:in\s+)?" + pattern, part)
            ]
            matches += [
                (*m.groups(), m.start())
                for m in re.finditer(pattern + CONNECTIVE + LENGTH, part)
            ]
            # radius_mm = 8, radius = 0.008
            in_unit = rf"{pattern}\s*\(?(um|mm|cm|m|)\)?\s*[=:]\s*{NUMBER}\s*(?![\s\d.e]*[cmu]?m)"
            matches += [(m[2], m[1], m.start()) for m in re.finditer(in_unit, part)]
            yield from (
                (name, _rounded(float(x) * LENGTHS[str(unit)] * share), place)
                for x, unit, place in matches
            )
    for m in re.finditer(r"(?:diameter|radius)\s*(?:x|by|times)\s*" + LENGTH, part):
        yield "length", _rounded(float(m[1]) * LENGTHS[m[2]]), m.start()


def _densities(part: str) -> set[float]:
    """Return densities, kg/m^3."""
    matches = re.findall(DENSITY + CONNECTIVE + NUMBER + PER_VOLUME, part)
    matches += re.findall(NUMBER + PER_VOLUME + r"\s+density", part)
    matches += [
        (x, per)
        for per, x in re.findall(DENSITY + PER_VOLUME + CONNECTIVE + NUMBER, part)
    ]
    matches = matches or [
        (x, "") for x in re.findall(DENSITY + CONNECTIVE + NUMBER, part)
    ]
    return {_rounded(float(x) * DENSITIES[per]) for x, per in matches}


def _rounded(x: float) -> float:
    """Return x without the digits that a change of units adds."""
    return float(f"{x:.12g}") if math.isfinite(x) else x
