"""CSV files of a level plate pushed straight down: depth and force, and the area of the plate in a column or a header line."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np

from geomech.io.rows import Column, Rows, plain, split_unit
from geomech.scenes.drag import (
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
    """A measured penetration test. depth (m, positive downwards) and force (N, positive upwards): (N,). area: of the
    plate, m^2, (1,) or (N,), or None if the file has none. name: of the file."""

    depth: np.ndarray
    force: np.ndarray
    area: np.ndarray | None
    name: str


def read(source: Rows) -> Penetration:
    """Return the test in a file; Refusal if it has none.

    Columns, in any order: depth and force, and area if wanted, each in the SI unit or
    with another behind its name, as depth_mm, force_N or area_cm2; others are ignored.
    In place of depth may stand sinkage, or z, upwards, and force_z for force. A header
    line may give the area: ``# plate area = 9.5 cm^2``, ``# plate 38 x 25 mm``, or
    ``# plate diameter 4 cm``."""
    found = source.find((), (DEPTH, HEIGHT, FORCE, AREA))
    if "depth" in found and "z" in found:
        raise Refusal(
            "the header has two columns of depth",
            where=source.place,
            instead="keep one",
        )
    for name, present in (("depth", {"depth", "z"}), ("force", {"force"})):
        if not present & {*found}:
            raise Refusal(
                f"the header has no column {name}",
                where=source.place,
                because=source.found,
                instead="it must have depth_m,force_N (or depth_mm, depth_cm; z_m, "
                "force_z)",
            )
    values, notes = source.values(found)
    word = split_unit(source.words[found["depth"].index])[0] if "depth" in found else ""
    if plain(word) not in ("", "depth", "penetration_depth"):
        notes = (*notes, f"{word} is taken for the depth")
    source.tell(notes)
    depth = values["depth"] if "depth" in values else -values["z"]
    written = _area(source)
    if written is not None and "area" in values:
        raise Refusal(
            "the area is given in a column and in a header line",
            where=source.name,
            instead="keep one",
        )
    area = values.get("area", None if written is None else np.array([written]))
    return Penetration(depth, values["force"], area, source.name)


def is_penetration(source: Rows) -> bool:
    """Return whether a file has a depth, in whatever unit, or z and a force."""
    if any(plain(word).startswith(DEPTHS) for word in source.words):
        return True
    matched = [
        column
        for column in (HEIGHT, FORCE)
        if any(column.matches(word) is not None for word in source.words)
    ]
    return len(matched) == 2


def _area(source: Rows) -> float | None:
    """Return the area in the header lines, m^2; None without one, Refusal if they give two."""
    areas = set()
    for line in source.comments[:MOST_COMMENTS]:
        text = line[:LONGEST_COMMENT].lower()
        after = re.findall(r"\barea" + CONNECTIVE + NUMBER + r"\s*" + SQUARE, text)
        before = [
            (x, unit)
            for unit, x in re.findall(
                r"\barea[ _]*[\(\[]?" + SQUARE + r"[\)\]]?\s*[=:]?\s*" + NUMBER, text
            )
        ]
        areas |= {_rounded(float(x) * LENGTHS[unit] ** 2) for x, unit in after + before}
        if not after and not before:
            areas |= {
                float(x)
                for x in re.findall(r"\barea\s*[=:]\s*" + NUMBER + r"\s*$", text)
            }
        side = NUMBER + r"\s*(mm|cm|m)"
        sides = re.findall(
            r"\bplate\b[^\d]*" + side + r"?\s*(?:x|by|times)\s*" + side + r"\b", text
        )
        areas |= {
            _rounded(float(a) * LENGTHS[ua or ub] * float(b) * LENGTHS[ub])
            for a, ua, b, ub in sides
        }
        round_plate = (
            r"\bplate\b[^\d,;]*\bdiameter" + CONNECTIVE + NUMBER + r"\s*(um|mm|cm|m)\b"
        )
        areas |= {
            _rounded(math.pi / 4 * (float(x) * LENGTHS[unit]) ** 2)
            for x, unit in re.findall(round_plate, text)
        }
    if len(areas) > 1:
        listed = " and ".join(f"{x:g}" for x in sorted(areas))
        raise Refusal(
            f"the header lines give areas {listed} m^2",
            where=source.name,
            instead="keep one",
        )
    return areas.pop() if areas else None


def _rounded(x: float) -> float:
    """Return x without the digits that a change of units adds."""
    return float(f"{x:.12g}")
