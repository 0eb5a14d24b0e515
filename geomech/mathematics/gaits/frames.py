"""CSV files of measured frames: rows of numbers under a header line with their
names."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from geomech.io.rows import Column, Rows
from geomech.io.rows import read as read_rows
from rft.core.refusal import Refusal

HEADERS = (("t", "s", "curvature"), ("t", "point", "x", "y"), ("t", "x", "y"))
COLUMNS = {  # curvature, s and points have one unit only, so their names have none
    "t": Column("t", "time", "s", ("t", "time")),
    "s": Column("s"),
    "curvature": Column("curvature"),
    "point": Column("point"),
    "x": Column("x", "length", "m", ("x",)),
    "y": Column("y", "length", "m", ("y",)),
}
UNTIMED = ("frame", "phase")  # names that may stand for t, and are not in s
LARGEST_FILE = 100_000_000  # bytes, a few million rows
SMALLEST_NUMBER = 1e-300  # of a period
MOST_FRAMES = 10_000
FEWEST = 4  # frames, and points or values of s in each: a cubic spline takes as many


@dataclass(frozen=True, eq=False)
class Frames:
    """The rows of a file, sorted by t, then by s or point where the file has them, else
    in the file's order.

    name, sha256: of the file. columns: of its header, with t for the column of time.
    timed: t may be in s. rows: (N, columns). lines: (N,), the rows' line numbers. t:
    (F,), ascending. starts: (F,), the first row of each frame."""

    name: str
    sha256: str
    columns: tuple[str, ...]
    rows: np.ndarray
    lines: np.ndarray
    t: np.ndarray
    starts: np.ndarray
    timed: bool = True

    def wrong(self, what: str, row: int | None = None, **facts: Any) -> Refusal:
        """Return the refusal of a row, or of the whole file. facts: of `Refusal`."""
        where = self.name
        if row is not None:
            where = f"{self.name}, line {self.lines[row]}"
        return Refusal(what, where=where, **facts)

    @property
    def counts(self) -> np.ndarray:
        """Numbers of rows of each frame, (F,)."""
        return np.diff(self.starts, append=len(self.rows))


def read(path: str | Path) -> Frames:
    """Return the frames of a CSV file; Refusal for a file without usable frames."""
    source = read_rows(path, LARGEST_FILE, "file must be a CSV file of one period")
    columns, clock = _columns(source)
    found = source.find([clock, *(COLUMNS[name] for name in columns[1:])])
    values, notes = source.values(found)
    if {"x", "y"} <= {*columns} and found["x"].unit != found["y"].unit:
        raise Refusal(
            "x and y are in different units",
            where=source.place,
            instead=("use the same unit for both"),
        )
    source.issue(notes)
    rows = np.stack([*values.values()], -1)
    keyed = columns[1] in ("s", "point")
    along = np.arange(len(rows))
    if keyed:
        along = rows[:, 1]
    order = np.lexsort((along, rows[:, 0]))
    rows = rows[order]
    t, starts = np.unique(rows[:, 0], return_index=True)
    frames = Frames(
        source.name,
        source.sha256,
        columns,
        rows,
        source.lines[order],
        t,
        starts,
        timed=clock.name not in UNTIMED,
    )
    _check_counts(frames)
    if keyed:
        _check_grid(frames)
    return frames


def _columns(source: Rows) -> tuple[tuple[str, ...], Column]:
    """Return the columns in the order of one of `HEADERS`, and the column of the
    time."""
    candidates = (COLUMNS["t"], *(Column(name) for name in UNTIMED))
    clocks = source.find((), candidates)
    for header in HEADERS:
        rest = source.find((), [COLUMNS[name] for name in header[1:]])
        has_all = len(rest) == len(header) - 1
        if len(clocks) == 1 and has_all and len(source.words) == len(header):
            clock = next(x for x in candidates if x.name in clocks)
            return header, clock
    headers = " or ".join(",".join(header) for header in HEADERS)
    raise Refusal(
        f"the header must be {headers}", where=source.place, because=source.header_text
    )


def _check_counts(frames: Frames) -> None:
    """Refuse too few or too many frames, and frames of too few rows."""
    if not FEWEST <= len(frames.t) <= MOST_FRAMES:
        raise frames.wrong(
            f"one period must have {FEWEST} to {MOST_FRAMES} frames (values of t)",
            value=len(frames.t),
        )
    if (frames.counts < FEWEST).any():
        k = int(frames.counts.argmin())
        items = "values of s" if frames.columns[1] == "s" else "points"
        raise frames.wrong(
            f"the frame at t = {frames.t[k]:g} has {frames.counts[k]} {items}:"
            f" give at least {FEWEST}",
            frames.starts[k],
        )


def _check_grid(frames: Frames) -> None:
    """Refuse frames without some s or point, or with one twice."""
    key = frames.columns[1]
    keys = frames.rows[:, 1]
    twice = np.flatnonzero((np.diff(frames.rows[:, :2], axis=0) == 0).all(1))
    if twice.size:
        row = max(twice[0], twice[0] + 1, key=lambda r: frames.lines[r])
        raise frames.wrong(
            f"t = {frames.rows[row, 0]:g}, {key} = {keys[row]:g} is given twice",
            row,
            instead="keep one of them",
        )
    places = np.unique(keys)
    if (frames.counts != len(places)).any():
        k = int(frames.counts.argmin())
        missing = np.setdiff1d(places, keys[frames.starts[k] :][: frames.counts[k]])[0]
        raise frames.wrong(
            f"the frame at t = {frames.t[k]:g} has no {key} = {missing:g}: give every "
            f"{key} at every t, or leave it out at every t",
            frames.starts[k],
        )
