"""CSV files of a level plate pushed straight down: depth and force, and the area of the plate in a column or a header line."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from geomech.io.rows import Rows
from geomech.scenes.drag import (
    CONNECTIVE,
    LENGTHS,
    LONGEST_COMMENT,
    MOST_COMMENTS,
    NUMBER,
)
from rft.refusal import Refusal

UNITS = {  # in small letters; without one it is the SI unit
    "depth": {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "z": {"": -1.0, "m": -1.0, "cm": -1e-2, "mm": -1e-3},
    "force": {"": 1.0, "n": 1.0, "kn": 1e3, "mn": 1e-3},
    "area": {"": 1.0, "m2": 1.0, "cm2": 1e-4, "mm2": 1e-6},
}
WORDS = {
    "depth": "(?:penetration[ _])?depth",
    "z": "z",
    "force": "(?:force|f)(?:[ _]?z)?",
    "area": "(?:plate[ _])?area",
}
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

    Columns, in any order: depth and force, and area if wanted, each in the SI unit or with another behind its name, as
    depth_mm, force_N or area_cm2; others are ignored. In place of depth may stand z, upwards, and force_z for force. A
    header line may give the area: ``# plate area = 9.5 cm^2``, or ``# plate 38 x 25 mm``."""
    line, words = source.header
    columns = {}
    for word in words:
        named = quantity(word)
        if named and named[0] in columns:
            raise Refusal(
                f"the header has two columns of {named[0]}",
                where=f"{source.name}, line {line}",
                instead="keep one",
            )
        if named:
            columns[named[0]] = (word, named[1])
    for name in ("depth", "force"):
        if name not in columns:
            instead = (
                "it must have depth_m,force_N (or depth_mm, depth_cm; z_m, force_z)"
            )
            raise Refusal(
                f"the header has no column {name}",
                where=f"{source.name}, line {line}",
                instead=instead,
            )
    rows = source.numbers(words, tuple(word for word, _ in columns.values())).T
    values = {
        name: scale * row for (name, (_, scale)), row in zip(columns.items(), rows)
    }
    written = _area(source)
    if written is not None and "area" in values:
        raise Refusal(
            "the area is given in a column and in a header line",
            where=source.name,
            instead="keep one",
        )
    area = values.get("area", None if written is None else np.array([written]))
    return Penetration(values["depth"], values["force"], area, source.name)


def quantity(word: str) -> tuple[str, float] | None:
    """Return (depth, force or area; its unit in SI) of a column, None if it is none of them."""
    for name, words in WORDS.items():
        match = re.fullmatch(words + r"[ _]*[\(\[]?([a-z]*)\s*\^?([2²]?)[\)\]]?", word)
        scale = (
            UNITS[name].get(match[1] + match[2].replace("²", "2")) if match else None
        )
        if scale is not None:
            return ("depth" if name == "z" else name), scale
    return None


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
