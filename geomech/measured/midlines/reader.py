"""Files of tracked points, CSV: a row a point, a row a frame, or as DeepLabCut and SLEAP write them.

    t,point,x,y[,likelihood]          a row for each point of each frame, in any order of the rows
    t,x,y                             the same without numbers; every frame has all points, in order
    t,x1,y1,x2,y2,... (nose_x, nose.y, y_nose, ... likewise)   a row for each frame
    scorer / bodyparts / coords       three header rows, then a row for each frame (DeepLabCut)

frame may stand for t. A name may end in a unit: x_mm, y (px), time_ms. Empty cells and nan are points that the tracker
did not find."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core.errors import choose
from geomech.io.rows import LARGEST_NUMBER, Rows
from geomech.io.rows import read as read_rows
from geomech.measured.log import JOINT
from geomech.measured.midlines.trial import UNITS, Trial
from rft.checks import in_range
from rft.refusal import Refusal, formatted

LARGEST_FILE = 200_000_000  # bytes
FEWEST_FRAMES, FEWEST_POINTS, MOST_POINTS = 12, 5, 1000
TIMES = {"t": 1.0, "time": 1.0, "seconds": 1.0, "sec": 1.0}
FRAMES = ("frame", "frames", "frame_idx", "frame_number", "index", "")
POINTS = ("point", "bodypart", "node", "id", "point_id", "keypoint")
SCORES = ("likelihood", "score", "confidence")
HEADS = ("scorer", "individuals", "bodyparts", "coords")  # rows of DeepLabCut
UNIT = re.compile(r"(?<![ _])[ _]*(?:_(mm|cm|m|px|bl|ms|s)|[\[(] *(\w+) *[\])])$")
LAST = re.compile(rf"(.+?)[_. -]?(x|y|{'|'.join(SCORES)})")
FIRST = re.compile(rf"(x|y|{'|'.join(SCORES)})[_. -]?(.+)")
MISSING = ("", "nan", "na", "none", "null")
LEAST_SCORE = 0.6  # below which DeepLabCut itself draws no point
WHAT = "give a CSV file with a header such as t,point,x,y or t,x1,y1,x2,y2, or one of DeepLabCut"


class Table(NamedTuple):
    """A file as a table of frames: t (F,), values (F, P, 3) of x, y and score, names and lines (F, P), the unit that the
    header says, whether t is a time, and columns that are not used."""

    t: np.ndarray
    values: np.ndarray
    names: tuple[str, ...]
    lines: np.ndarray
    unit: str
    timed: bool
    unused: tuple[str, ...] = ()


def is_midlines(header: tuple[str, ...]) -> bool:
    """Return whether the header of a file is that of points along a body, not of a log of joint angles."""
    bare = {_split(name)[0] for name in header}
    if (
        {*header[:1]} & {*HEADS}
        or {"s", "curvature"} <= bare
        or {*POINTS[:2]} & bare
        or len(_pairs(header)) > 1
    ):
        return True
    return (
        {"x", "y"} <= bare
        and not {"heading", "theta", "yaw"} & bare
        and not any(map(JOINT.fullmatch, bare))
    )


def read(
    path: str | Path, *, points: Sequence[str] = (), units: str | None = None, scale: float | None = None,
    fps: float | None = None, y: str | None = None, least_score: float = LEAST_SCORE, body_length: float | None = None,
) -> Trial:  # fmt: skip
    """Return the trial in a file; Refusal, with the line, for one that cannot be read.

    points: names of the points to take, in the order of the body. units: of x and y, m, cm, mm, px or BL, where the
    header does not say. scale: mm per pixel. fps: frames per second, of a file that counts frames. least_score: points
    of a lower likelihood are taken for missing. y: up, or down as in images, which pixels are taken for. body_length:
    in ``units``, where the points do not reach both ends."""
    for name, value, low, high in (
        ("scale", scale, 1e-9, 1e6),
        ("fps", fps, 1e-6, 1e6),
    ):
        if value is not None:
            in_range(f"``{name}``", value, low, high)
    in_range("``least_score``", least_score, 0, 1)
    if units is not None:
        choose("``units``", units, (*UNITS, "px", "BL"))
    source = read_rows(path, LARGEST_FILE, WHAT)
    table = _selected(_table(source), source.name, points)
    _check(table, source.name)
    unit, size, notes = _unit(table, source.name, units, scale)
    t, timed, timing = _time(table, fps)
    xy = table.values[..., :2] * size
    low = table.values[..., 2] < least_score
    xy[low] = np.nan
    pixels = "px" in (table.unit, units) or scale is not None
    if y is not None:
        choose("``y``", y, ("up", "down"))
    elif pixels:
        notes.append(
            "y is taken to run down, as in images, else heading and turn have the other sign: say y up"
        )
    if y == "down" or (y is None and pixels):
        xy[..., 1] *= -1
    xy[np.isnan(xy).any(-1)] = np.nan
    notes = [*timing, *notes, *_missing_note(xy, low)]
    if table.unused:
        notes.append(f"columns that are not used: {', '.join(table.unused[:6])}")
    length = (
        body_length * size if body_length is not None and unit != "BL" else body_length
    )
    return Trial(
        source.name,
        t,
        xy,
        table.names,
        table.lines,
        unit,
        timed,
        length,
        notes=tuple(notes),
    )


def _missing_note(xy: np.ndarray, low: np.ndarray) -> list[str]:
    lost = np.isnan(xy[..., 0])
    if not lost.any():
        return []
    score = f", {low.mean():.2g} of all by their likelihood" if low.any() else ""
    return [
        f"{lost.mean():.2g} of all points are missing{score}: modes along the body stand for them"
    ]


def _table(source: Rows) -> Table:
    """Return the table of a file, whichever form it has."""
    line, header = source.header
    where = f"{source.name}, line {line}"
    if header and header[0] in HEADS:
        return _deeplabcut(source)
    bare = {_split(name)[0]: k for k, name in enumerate(header)}
    if {"s", "curvature"} <= {*bare}:
        raise Refusal(
            "curvature alone says nothing of where the body went",
            where=where,
            instead='give points of the midline, or take the file for [gait] kind = "centreline"',
        )
    if twice := [c for k, c in enumerate(header) if c in header[:k]]:
        raise Refusal(
            f"the column {formatted(twice[0])} is there twice",
            where=where,
            instead="rename one",
        )
    if {"x", "y"} <= {*bare}:
        return _long(source, header, bare)
    return _wide(source, header, _pairs(header))


def _split(name: str) -> tuple[str, str]:
    """Return the name of a column without its unit, and the unit."""
    match = UNIT.search(name)
    return (
        (name[: match.start()], match[1] or match[2])
        if match and match.start()
        else (name, "")
    )


def _pairs(header: Sequence[str]) -> dict[str, dict[str, int]]:
    """Return the columns of x, y and likelihood by the names of points that have both x and y."""
    found: dict[str, dict[str, int]] = {}
    for k, name in enumerate(header):
        bare = _split(name)[0]
        if match := FIRST.fullmatch(bare):
            coordinate, point = match[1], match[2]
        elif match := LAST.fullmatch(bare):
            point, coordinate = match[1], match[2]
        else:
            continue
        found.setdefault(point, {})["score" if coordinate in SCORES else coordinate] = k
    return {
        point: columns for point, columns in found.items() if {"x", "y"} <= {*columns}
    }


def _clock(header: Sequence[str], name: str, line: int) -> tuple[int, float, bool]:
    """Return the column of the time, its unit in s (1 of frames), and whether it is a time."""
    for k, word in enumerate(header):
        bare, unit = _split(word)
        if bare in TIMES:
            if unit not in ("", "s", "ms"):
                raise Refusal(
                    f"{word} is in {unit}",
                    where=f"{name}, line {line}",
                    instead="give t in s or ms",
                )
            return k, 1e-3 if unit == "ms" else 1.0, True
    for k, word in enumerate(header):
        if word in FRAMES:
            return k, 1.0, False
    raise Refusal(
        "no column t or frame",
        where=f"{name}, line {line}",
        because=f"it has {formatted(', '.join(header), 120)}",
        instead="name the column of the time t",
    )


def _cells(source: Rows, first: int, columns: Sequence[str]) -> np.ndarray:
    """Return the numbers of the rows from number ``first`` on (N, columns), nan where a cell is empty; Refusal with line
    and column of anything else."""
    rows = np.full((len(source.filled) - first, len(columns)), np.nan)
    for k, (line, text) in enumerate(source.filled[first:]):
        cells = text.split(",")
        if len(cells) != len(columns):
            raise Refusal(
                f"{len(cells)} cells under {len(columns)} columns",
                where=f"{source.name}, line {line}",
                instead="mend that row; a point that was not found is an empty cell between two commas",
            )
        for j, cell in enumerate(cells):
            rows[k, j] = _number(cell, source.name, line, columns[j])
    return rows


def _number(cell: str, name: str, line: int, column: str) -> float:
    cell = cell.strip(' "')
    if cell.lower() in MISSING:
        return math.nan
    try:
        if abs(number := float(cell)) <= LARGEST_NUMBER:
            return number
    except ValueError:
        pass
    raise Refusal(
        f"{formatted(cell, 30)} is no number up to {LARGEST_NUMBER:g}",
        where=f"{name}, line {line}, column {column}",
        instead="mend it, or leave the cell empty where the point was not found",
    )


def _common_unit(names: Sequence[str], where: str) -> str:
    units = {_split(name)[1] for name in names}
    if len(units) > 1:
        raise Refusal(
            f"columns in {' and in '.join(sorted(u or 'no unit' for u in units))}",
            where=where,
            instead="give all x and y in one unit",
        )
    return {"pixel": "px", "pixels": "px", "bl": "BL"}.get(unit := units.pop(), unit)


def _long(source: Rows, header: tuple[str, ...], bare: dict[str, int]) -> Table:
    """Return the table of a file with a row for each point."""
    line = source.header[0]
    clock, second, timed = _clock(header, source.name, line)
    key = next((bare[name] for name in POINTS if name in bare), None)
    score = next((bare[name] for name in SCORES if name in bare), None)
    unit = _common_unit(
        [header[bare["x"]], header[bare["y"]]], f"{source.name}, line {line}"
    )
    if key is not None:  # names need not be numbers
        labels = [
            text.split(",")[key].strip(' "') if text.count(",") >= key else ""
            for _, text in source.filled[1:]
        ]
        blank = [
            (n, ",".join("0" if k == key else c for k, c in enumerate(x.split(","))))
            for n, x in source.filled
        ]
        source = Rows(
            source.name, source.sha256, [source.filled[0], *blank[1:]], source.comments
        )
    rows = _cells(source, 1, header)
    moments = _moments(rows[:, clock] * second, source)
    t, frame = np.unique(moments, return_inverse=True)
    if key is None:
        names, point = _unnamed(t, frame, source)
    else:
        numeric = all(re.fullmatch(r"\d+(\.0*)?", label) for label in labels)
        names = sorted({*labels}, key=float) if numeric else list(dict.fromkeys(labels))
        point = np.array([names.index(label) for label in labels])
        _check_once(t, frame, point, names, source)
    values, lines = (
        np.full((len(t), len(names), 3), np.nan),
        np.zeros((len(t), len(names)), int),
    )
    values[..., 2] = np.inf
    columns = [bare["x"], bare["y"], *([] if score is None else [score])]
    values[frame, point, : len(columns)] = rows[:, columns]
    lines[frame, point] = source.lines
    lines = np.where(lines, lines, lines.max(1, keepdims=True))
    used = {clock, key, *columns}
    unused = tuple(name for k, name in enumerate(header) if k not in used)
    return Table(t, values, tuple(names), lines, unit, timed, unused)


def _moments(t: np.ndarray, source: Rows) -> np.ndarray:
    if (bad := np.flatnonzero(np.isnan(t))).size:
        raise Refusal(
            "no time",
            where=f"{source.name}, line {source.lines[bad[0]]}",
            instead="give every row its t or frame",
        )
    return t


def _unnamed(
    t: np.ndarray, frame: np.ndarray, source: Rows
) -> tuple[list[str], np.ndarray]:
    counts = np.bincount(frame)
    if (bad := np.flatnonzero(counts != np.bincount(counts).argmax())).size:
        line = source.lines[np.flatnonzero(frame == bad[0])[0]]
        raise Refusal(
            f"{counts[bad[0]]} points at t = {t[bad[0]]:g}, and {np.bincount(counts).argmax()} at most others",
            where=f"{source.name}, line {line}",
            instead="number the points in a column `point`, so that missing ones have a place",
        )
    point = np.zeros(len(frame), int)
    for k in range(len(t)):
        point[frame == k] = np.arange(counts[0])
    return [str(k + 1) for k in range(counts[0])], point


def _check_once(t, frame, point, names, source: Rows) -> None:
    keys = frame * len(names) + point
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    if (count > 1).any():
        again = np.flatnonzero(keys == keys[first[count > 1][0]])[1]
        raise Refusal(
            f"point {names[point[again]]} is given twice at t = {t[frame[again]]:g}",
            where=f"{source.name}, line {source.lines[again]}",
            instead="keep one, or give each animal a file",
        )


def _wide(
    source: Rows, header: tuple[str, ...], pairs: dict[str, dict[str, int]]
) -> Table:
    """Return the table of a file with a row for each frame."""
    line = source.header[0]
    if len(pairs) < 2:
        other = (
            "; columns must be parted by commas"
            if re.search("[;\\t]", ",".join(header))
            else ""
        )
        raise Refusal(
            f"no columns of points{other}",
            where=f"{source.name}, line {line}",
            because=f"it has {formatted(', '.join(header), 120)}",
            instead=WHAT,
        )
    clock, second, timed = _clock(header, source.name, line)
    names = [header[columns[c]] for columns in pairs.values() for c in "xy"]
    unit = _common_unit(names, f"{source.name}, line {line}")
    return _framed(source, 1, header, pairs, clock, second, timed, unit)


def _framed(
    source: Rows,
    first: int,
    header,
    pairs,
    clock: int,
    second: float,
    timed: bool,
    unit: str,
) -> Table:
    texts = [
        k for k, name in enumerate(header) if name in ("track", "individual", "scorer")
    ]
    used = {clock, *(k for columns in pairs.values() for k in columns.values())}
    if texts:  # names of tracks are no numbers
        numbers = lambda text: ",".join(
            "0" if k in texts else c for k, c in enumerate(text.split(","))
        )
        many = {
            text.split(",")[k]
            for _, text in source.filled[first:]
            for k in texts
            if text.count(",") >= k
        }
        if len(many) > 1:
            raise Refusal(
                f"{len(many)} animals are in it: {', '.join(sorted(many)[:4])}",
                where=source.name,
                instead="give each a file",
            )
        filled = [
            *source.filled[:first],
            *((n, numbers(x)) for n, x in source.filled[first:]),
        ]
        source = Rows(source.name, source.sha256, filled, source.comments)
    rows = _cells(source, first, header)
    t = rows[:, clock] * second
    lines = np.array([k for k, _ in source.filled[first:]], int)
    for k in np.flatnonzero(~(np.diff(t, prepend=-np.inf) > 0)):
        what = (
            "no time"
            if np.isnan(t[k])
            else f"t = {t[k]:.6g} comes after {t[k - 1]:.6g}"
        )
        raise Refusal(
            what,
            where=f"{source.name}, line {lines[k]}",
            instead="sort the rows by time, one for each",
        )
    values = np.full((len(t), len(pairs), 3), np.inf)
    for p, columns in enumerate(pairs.values()):
        for j, coordinate in enumerate(("x", "y", "score")):
            if coordinate in columns:
                values[:, p, j] = rows[:, columns[coordinate]]
    unused = tuple(
        name for k, name in enumerate(header) if k not in used and k not in texts
    )
    return Table(
        t,
        values,
        tuple(pairs),
        np.repeat(lines[:, None], len(pairs), 1),
        unit,
        timed,
        unused,
    )


def _deeplabcut(source: Rows) -> Table:
    """Return the table of a file of DeepLabCut: the first cell of each header row says what it holds."""
    heads = {}
    for _, text in source.filled[:4]:
        words = [word.strip(' "') for word in text.split(",")]
        if words[0].lower() in HEADS:
            heads[words[0].lower()] = words[1:]
    if (
        not {"bodyparts", "coords"} <= {*heads}
        or len({len(x) for x in heads.values()}) > 1
    ):
        raise Refusal(
            "a file of DeepLabCut has header rows scorer, bodyparts and coords of equal length",
            where=f"{source.name}, line {source.filled[0][0]}",
            instead="give the file as DeepLabCut writes it, or one header row such as frame,nose_x,nose_y",
        )
    animals = list(dict.fromkeys(heads.get("individuals", ())))
    if len(animals) > 1:
        raise Refusal(
            f"{len(animals)} individuals are in it: {', '.join(animals[:4])}",
            where=source.name,
            instead="give each a file",
        )
    header = (
        "frame",
        *(
            f"{part}.{c.lower()}"
            for part, c in zip(heads["bodyparts"], heads["coords"])
        ),
    )
    return _framed(source, len(heads), header, _pairs(header), 0, 1.0, False, "px")


def _selected(table: Table, name: str, points: Sequence[str]) -> Table:
    """Return the table of the named points alone, in this order."""
    if not points:
        return table
    lower = [x.lower() for x in table.names]
    for x in points:
        choose(f"{name}: ``columns``", x.strip().lower(), lower)
    if len({x.strip().lower() for x in points}) < len(points):
        raise Refusal(
            "``columns`` name a point twice",
            where=name,
            instead="name each once, from one end of the body",
        )
    picks = [lower.index(x.strip().lower()) for x in points]
    names = tuple(table.names[k] for k in picks)
    return table._replace(
        values=table.values[:, picks], names=names, lines=table.lines[:, picks]
    )


def _check(table: Table, name: str) -> None:
    frames, points = table.values.shape[:2]
    if not FEWEST_POINTS <= points <= MOST_POINTS:
        raise Refusal(
            f"{points} points along the body",
            where=name,
            instead=f"give {FEWEST_POINTS} to {MOST_POINTS}, better 10",
        )
    if frames < FEWEST_FRAMES:
        raise Refusal(
            f"{frames} frames",
            where=name,
            instead="give a whole trial, 20 frames a cycle for at least one cycle",
        )


def _unit(
    table: Table, name: str, units: str | None, scale: float | None
) -> tuple[str, float, list[str]]:
    """Return the unit of lengths, m or BL or "", that of the file in it, and what was taken for granted."""
    if units and table.unit and units != table.unit and table.unit != "px":
        raise Refusal(
            f"x and y are in {table.unit} by the names of their columns",
            where=name,
            instead="drop ``units``",
        )
    unit = units or table.unit
    if scale is not None and unit not in ("px", ""):
        raise Refusal(
            "``scale`` is that of pixels",
            where=name,
            instead=f"drop it, x and y are in {unit}",
        )
    if scale is not None:
        return "m", scale * 1e-3, []
    if unit in UNITS:
        return "m", UNITS[unit], []
    if unit == "BL":
        return "BL", 1.0, []
    return "", 1.0, ["lengths are in body lengths alone: nobody says how long a pixel is" if unit == "px" else
                     "lengths are in body lengths alone: nobody says the unit of x and y, say units"]  # fmt: skip


def _time(table: Table, fps: float | None) -> tuple[np.ndarray, bool, list[str]]:
    """Return times (F,), whether they are in s, and what was taken for granted."""
    if table.timed:
        if fps is not None:
            raise Refusal(
                "``fps`` is that of a file that counts frames",
                instead="drop it, the file has a time",
            )
        return table.t, True, []
    if fps is not None:
        return table.t / fps, True, []
    return (
        table.t,
        False,
        ["times are in frames: nobody says how many there are in a second, say fps"],
    )
