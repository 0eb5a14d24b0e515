"""CSV files of measurements: rows of numbers under a header line, # starts a comment."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geomech.io import files
from rft.refusal import Refusal

LARGEST_NUMBER = 1e12


@dataclass(frozen=True, eq=False)
class Rows:
    """Contents of a CSV file. name, sha256: of the file. filled: (line number, text) of lines that are neither comment
    nor empty, the header first. comments: texts after #, line by line."""

    name: str
    sha256: str
    filled: list[tuple[int, str]]
    comments: list[str]

    @property
    def header(self) -> tuple[int, tuple[str, ...]]:
        """Line number and words of the first line that is no comment, in small letters, without quotes."""
        line, text = self.filled[0] if self.filled else (1, "")
        return line, tuple(
            word.strip().strip('"').strip().lower() for word in text.split(",")
        )

    def numbers(
        self, columns: tuple[str, ...], selected: tuple[str, ...] | None = None
    ) -> np.ndarray:
        """Return the numbers under the header (N, columns), or in ``selected`` columns; Refusal naming the line of a
        row with anything else."""
        selected = columns if selected is None else selected
        picks = [columns.index(name) for name in selected]
        rows = [_row(self.name, k, line, columns, picks) for k, line in self.filled[1:]]
        return np.array(rows).reshape(-1, len(selected))

    @property
    def lines(self) -> np.ndarray:
        """Line numbers (N,) of the rows."""
        return np.array([k for k, _ in self.filled[1:]], int)


def read(path: str | Path, largest: int, what: str) -> Rows:
    """Return the rows of a CSV file of at most ``largest`` bytes; Refusal with what the file should be (``what``) if it
    is no text."""
    try:
        raw = files.read(path, largest)
        text = raw.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
        if "\0" in text:
            raise ValueError
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise Refusal(
            f"cannot read {str(path)!r}", because=reason, instead=what
        ) from None
    parts = [line.partition("#") for line in text.split("\n")]
    filled = [
        (k, line.strip()) for k, (line, _, _) in enumerate(parts, 1) if line.strip()
    ]
    comments = [comment.strip() for _, _, comment in parts if comment.strip()]
    return Rows(Path(path).name, hashlib.sha256(raw).hexdigest(), filled, comments)


def _row(
    name: str, line: int, text: str, columns: tuple[str, ...], picks: list[int]
) -> list[float]:
    cells = text.split(",")
    if len(cells) == len(columns):
        row = [_cell(cells[k]) for k in picks]
        if all(abs(x) <= LARGEST_NUMBER for x in row):
            return row
    expected = f"{len(columns)} finite numbers ({','.join(columns)}), at most {LARGEST_NUMBER:g}"
    column = next(
        (
            columns[k]
            for k in picks
            if len(cells) == len(columns) and not abs(_cell(cells[k])) <= LARGEST_NUMBER
        ),
        "",
    )
    raise Refusal(
        f"a row must be {expected}" + f", column {column}" * bool(column),
        value=text[:40],
        where=f"{name}, line {line}",
    )


def _cell(text: str) -> float:
    """Return the number in a cell; nan if it has none."""
    try:
        return float(text.strip(' "'))
    except ValueError:
        return math.nan
