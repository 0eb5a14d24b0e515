"""Files of tracked points, CSV: a row a point, a row a frame, or as DeepLabCut and
SLEAP write them.

    t,point,x,y[,likelihood]          a row for each point of each frame, in any order
    of the rows
    t,x,y                             the same without numbers; every frame has all
    points, in order
    t,x1,y1,x2,y2,... (nose_x, nose.y, y_nose, ... likewise)   a row for each frame
    scorer / bodyparts / coords       three header rows, then a row for each frame
    (DeepLabCut)

frame may stand for t. A name may end in a unit: x_mm, y (px), time_ms. Empty cells and
nan are points that the tracker did not find. DeepLabCut and SLEAP count pixels, and y
downwards. The score of SLEAP, and whatever is not called likelihood, is no probability,
and has no limit unless one is asked for."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core.errors import choose
from geomech.io.rows import (
    DEEPLABCUT_WORDS,
    LARGEST_NUMBER,
    MISSING,
    UNITS,
    Rows,
    plain,
    split_unit,
)
from geomech.io.rows import read as read_rows
from geomech.studies.measured.log import JOINT
from geomech.studies.measured.midlines.trial import Trial
from rft.core.checks import in_range
from rft.core.refusal import Refusal, formatted

LARGEST_FILE = 200_000_000  # bytes
FEWEST_FRAMES = 12
FEWEST_POINTS = 5
MOST_POINTS = 1000
TIMES = ("t", "time", "timestamp", "seconds", "sec")
FRAMES = ("frame", "frames", "frame_idx", "frame_number", "fnum", "index", "")
POINTS = ("point", "bodypart", "node", "id", "point_id", "keypoint")
ANIMALS = (
    "track",
    "individual",
    "individuals",
    "animal",
    "animal_id",
    "track_id",
    "scorer",
)
LIKELIHOOD = "likelihood"
SCORES = (LIKELIHOOD, "score", "confidence")
LAST = re.compile(rf"(.+?)[_. /-]?(x|y|{'|'.join(SCORES)})")
FIRST = re.compile(rf"(x|y|{'|'.join(SCORES)})[_. -]?(.+)")
IMAGE = re.compile(r"labeled-data|\.(png|jpe?g|tiff?|bmp)$", re.I)
LENGTHS = UNITS["length"]
LEAST_SCORE = 0.6  # likelihood below which DeepLabCut itself draws no point
# Of the points that the tracker found: a larger dropped share is noted first.
MANY = 0.1
SEVERAL = 0.1  # of the times: more with several rows are those of several animals
SINGLE = "single"  # DeepLabCut's name for points that belong to no animal
DEEPLABCUT = "DeepLabCut"
SLEAP = "SLEAP"
UNTRACKED = {  # what to do about animals that a file does not tell apart
    SLEAP: "track them in SLEAP and export again, or export one animal",
    "": "add a column track with the name of each animal, or give each its own file",
}
HEADERS = (
    "give a CSV file with a header such as t,point,x,y or t,x1,y1,x2,y2, or the file "
    "of DeepLabCut"
)


class Table(NamedTuple):
    """A file as a table of frames: t (F,), values (F, P, 3) of x, y and score, names
    and lines (F, P), the unit that the header says, whether t is a time, columns that
    are not used, the program that wrote it, "" if none is known, the least score that
    it takes for a point, and notes."""

    t: np.ndarray
    values: np.ndarray
    names: tuple[str, ...]
    lines: np.ndarray
    unit: str
    timed: bool
    unused: tuple[str, ...] = ()
    program: str = ""
    least_score: float = -math.inf
    notes: tuple[str, ...] = ()


def kind_of(header: Sequence[str]) -> str:
    """Return "midlines" for the header of points along a body, "log" for a header of
    joint angles, "" for others."""
    bare = {split_unit(name)[0] for name in header}
    joints = [name for name in bare if JOINT.fullmatch(plain(name))]
    if is_midlines(header):
        return "midlines"
    if joints or {"heading", "theta", "yaw"} & bare:
        return "log"
    return ""


def is_midlines(header: Sequence[str]) -> bool:
    """Return whether the header of a file names points along a body, not a log of joint
    angles."""
    bare = {split_unit(name)[0] for name in header}
    if {*header[:1]} & {*DEEPLABCUT_WORDS} or {*POINTS[:2]} & bare:
        return True
    if {"s", "curvature"} <= bare or len(_pairs(header)) > 1:
        return True
    if not {"x", "y"} <= bare:
        return False
    has_pose = {"heading", "theta", "yaw"} & bare
    return not has_pose and not any(map(JOINT.fullmatch, bare))


def read(
    path: str | Path,
    *,
    points: Sequence[str] = (),
    units: str | None = None,
    scale: float | None = None,
    fps: float | None = None,
    y: str | None = None,
    least_score: float | None = None,
    body_length: float | None = None,
    individual: str | None = None,
) -> Trial:
    """Return the trial in a file; Refusal, with the line, for one that cannot be read.

    points: names of the points to take, in the order of the body. units: of x and y, m,
    cm, mm, um, px or BL, where the header does not say. scale: mm per pixel. fps:
    frames per second, of a file that counts frames. least_score: points of a lower
    score are taken for missing; by default of a likelihood below `LEAST_SCORE`, and no
    other score. y: up, or down as in images, which pixels are taken for. body_length:
    in ``units``, where the points do not reach both ends. individual: the animal to
    take, of several."""
    for name, value, low, high in (
        ("scale", scale, 1e-9, 1e6),
        ("fps", fps, 1e-6, 1e6),
        ("least_score", least_score, 0, 1),
    ):
        if value is not None:
            in_range(f"``{name}``", value, low, high)
    if units is not None:
        choose("``units``", units, (*LENGTHS, "px", "BL"))
    source = read_rows(path, LARGEST_FILE, HEADERS)
    table = _selected(_table(source, individual), source.name, points)
    _check(table, source.name)
    unit, size, notes = _unit(table, source.name, units, scale)
    t, timed, timing = _time(table, fps)
    xy = table.values[..., :2] * size
    least = least_score
    if least is None:
        least = table.least_score
    low = (table.values[..., 2] < least) & ~np.isnan(xy).any(-1)
    found = (~np.isnan(xy).any(-1)).sum()
    xy[low] = np.nan
    pixels = "px" in (table.unit, units) or scale is not None
    if y is not None:
        choose("``y``", y, ("up", "down"))
    elif pixels:
        notes.append(
            "y is assumed to point down, as in images; if it points up, give ``y`` up, "
            "or heading and turn have the wrong sign"
        )
    else:
        notes.append(
            "y is assumed to point up; if it points down, give ``y`` down, or "
            "heading and turn have the wrong sign"
        )
    if y == "down" or (y is None and pixels):
        xy[..., 1] *= -1
    xy[np.isnan(xy).any(-1)] = np.nan
    notes = [
        *_dropped_note(low, found, least),
        *timing,
        *notes,
        *_missing_note(xy, low),
    ]
    if source.notes:
        notes.append("; ".join(source.notes))
    notes += table.notes
    if table.unused:
        notes.append(f"columns that are not used: {', '.join(table.unused[:6])}")
    if body_length is not None and unit != "BL":
        body_length = body_length * size
    return Trial(
        name=source.name,
        t=t,
        points=xy,
        names=table.names,
        lines=table.lines,
        unit=unit,
        timed=timed,
        length=body_length,
        notes=tuple(notes),
        file_unit="px" if pixels else "",
    )


def _dropped_note(low: np.ndarray, found: int, least: float) -> list[str]:
    """Return a note, which comes first, if many points are dropped by their score."""
    if low.sum() <= MANY * found:
        return []
    share = 100 * low.sum() / found
    return [
        f"MANY POINTS ARE LEFT OUT: {share:.3g} % of the points that the tracker found "
        f"have a score below {least:g}; if they are good, lower "
        "``least_score``"
    ]


def _missing_note(xy: np.ndarray, low: np.ndarray) -> list[str]:
    """Return a note if points are missing."""
    lost = np.isnan(xy[..., 0])
    if not lost.any():
        return []
    score = ""
    if low.any():
        score = f", {100 * low.mean():.3g} % because of their likelihood"
    share = 100 * lost.mean()
    return [
        f"{share:.3g} % of all points are missing{score}: modes along the body replace "
        "them"
    ]


def _table(source: Rows, individual: str | None = None) -> Table:
    """Return the table of a file, whichever form it has."""
    header = source.header[1]
    _refuse_labelled(source)
    if header and header[0] in DEEPLABCUT_WORDS:
        return _deeplabcut(source, individual)
    bare = {split_unit(name)[0]: k for k, name in enumerate(header)}
    if {"s", "curvature"} <= {*bare}:
        raise Refusal(
            "curvature alone does not show where the body went",
            where=source.place,
            instead="give points of the midline, or use the file in [gait] kind = "
            '"centreline"',
        )
    twice = [c for k, c in enumerate(header) if c in header[:k]]
    if twice:
        raise Refusal(
            f"the column {formatted(twice[0])} appears twice",
            where=source.place,
            instead="rename one of them",
        )
    is_sleap = "instance.score" in header or {"track", "frame_idx"} <= {*header}
    program = SLEAP if is_sleap else ""
    source = _of_one_animal(source, individual)
    if {"x", "y"} <= {*bare}:
        table = _long(source, header, bare)
    else:
        table = _parse_wide(source, header, _pairs(header), program)
    if is_sleap and not table.unit:
        table = table._replace(unit="px")
    least_score = -math.inf
    if any(LIKELIHOOD in name for name in header):
        least_score = LEAST_SCORE
    return table._replace(program=program, least_score=least_score)


def _refuse_labelled(source: Rows) -> None:
    """Refuse frames that were picked from films to train a tracker."""
    for line, text in source.rows[:5]:
        images = [cell for cell in source.cells(text)[:3] if IMAGE.search(cell)]
        if images:
            raise Refusal(
                f"{formatted(images[-1], 40)} is an image: these are frames labelled "
                "to train a tracker, not a film",
                where=f"{source.name}, line {line}",
                instead="give the file that DeepLabCut writes when it analyses the "
                "film, or add a column frame that numbers the frames of one "
                "film",
            )


def _of_one_animal(source: Rows, individual: str | None) -> Rows:
    """Return the rows of one animal, where a column names animals; Refusal if there are
    several and none is named."""
    header = source.header[1]
    columns = [k for k, name in enumerate(header) if plain(name) in ANIMALS]
    if not columns:
        if individual is not None:
            raise Refusal(
                "no column names animals",
                where=source.place,
                because=f"the columns are {formatted(', '.join(header), 120)}",
                instead="remove ``individual``, or add a column track",
            )
        return source
    rows = []
    animals: dict[str, None] = {}
    for line, text in source.rows:
        cells = source.cells(text)
        names = [cells[k] for k in columns if k < len(cells)]
        animal = " ".join(name for name in names if name)
        animals[animal or "(no name)"] = None
        if individual is None or individual in names:
            rows.append((line, text))
    if individual is None and len(animals) > 1:
        raise Refusal(
            f"it contains {len(animals)} animals: {', '.join([*animals][:6])}",
            where=source.name,
            instead="choose one with ``individual``",
        )
    if not rows:
        choose("``individual``", individual, animals)
    return replace(source, rows=rows)


def _refuse_animals(source: Rows, frame: np.ndarray, program: str = "") -> None:
    """Refuse several rows of one kind in many frames. frame: (N,), number of each."""
    counts = np.bincount(frame)
    if (counts > 1).mean() > SEVERAL:
        raise Refusal(
            f"{int(counts.max())} animals without a track: "
            f"{100 * (counts > 1).mean():.3g} % of the times have several rows",
            where=source.name,
            instead=UNTRACKED[program or ""],
        )


def _pairs(header: Sequence[str]) -> dict[str, dict[str, int]]:
    """Return the columns of x, y and likelihood by the names of points that have both x
    and y."""
    found: dict[str, dict[str, int]] = {}
    for k, name in enumerate(header):
        bare = split_unit(name)[0]
        coordinate_first = FIRST.fullmatch(bare)
        coordinate_last = LAST.fullmatch(bare)
        if coordinate_first:
            coordinate, point = coordinate_first.groups()
        elif coordinate_last:
            point, coordinate = coordinate_last.groups()
        else:
            continue
        if coordinate in SCORES:
            coordinate = "score"
        found.setdefault(point, {})[coordinate] = k
    return {
        name: columns
        for name, columns in found.items()
        if "x" in columns and "y" in columns
    }


def _clock(header: Sequence[str], place: str) -> tuple[int, str, bool]:
    """Return the column of the time, its unit, and whether it is a time and not a count
    of frames."""
    for k, word in enumerate(header):
        bare, unit = split_unit(word)
        if plain(bare) in TIMES:
            if unit != "" and unit not in UNITS["time"]:
                raise Refusal(
                    f"{word} is in {unit}", where=place, instead="give t in s or ms"
                )
            return k, unit, True
    for k, word in enumerate(header):
        if plain(word) in FRAMES:
            return k, "frame", False
    raise Refusal(
        "no column t or frame",
        where=place,
        because=f"the columns are {formatted(', '.join(header), 120)}",
        instead="call the column of the time t",
    )


def _cells(source: Rows, picks: Sequence[int]) -> np.ndarray:
    """Return the numbers of columns (N, picks), nan where a cell is empty; Refusal with
    line and column of anything else."""
    plain = source.plain_numbers(picks)
    if plain is not None:
        return plain
    width = len(source.words)
    values = np.full((len(source.rows), len(picks)), np.nan)
    for k, (line, text) in enumerate(source.rows):
        cells = source.cells(text)
        if len(cells) != width:
            raise Refusal(
                f"{len(cells)} cells in a table of {width} columns",
                where=f"{source.name}, line {line}",
                instead="correct that row; leave the cell of a missing point empty, "
                "between two separators",
            )
        for j, pick in enumerate(picks):
            values[k, j] = _number(cells[pick], source, line, pick)
    return values


def _number(cell: str, source: Rows, line: int, column: int) -> float:
    number = source.number(cell)
    if number is not None and abs(number) <= LARGEST_NUMBER:
        return number
    if cell.lower() in MISSING:
        return math.nan
    raise Refusal(
        f"{formatted(cell, 30)} is not a number of at most {LARGEST_NUMBER:g}",
        where=f"{source.name}, line {line}, column {source.header[1][column]}",
        instead="correct it, or leave the cell empty where the point was not found",
    )


def _common_unit(names: Sequence[str], where: str) -> str:
    """Return the unit that columns have in common, "" without one; Refusal for
    several."""
    units = {split_unit(name)[1] for name in names}
    if len(units) > 1:
        raise Refusal(
            f"columns in {' and in '.join(sorted(u or 'no unit' for u in units))}",
            where=where,
            instead="give all x and y in the same unit",
        )
    unit = units.pop()
    if unit not in ("", "px", "BL", *LENGTHS):
        raise Refusal(
            f"x and y are in {formatted(unit, 20)}",
            where=where,
            instead="give them in m, cm, mm, px or BL",
        )
    return unit


def _long(source: Rows, header: tuple[str, ...], bare: dict[str, int]) -> Table:
    """Return the table of a file with a row for each point."""
    clock, second, timed = _clock(header, source.place)
    key = next((bare[name] for name in POINTS if name in bare), None)
    score = next((bare[name] for name in SCORES if name in bare), None)
    unit = _common_unit([header[bare["x"]], header[bare["y"]]], source.place)
    columns = [bare["x"], bare["y"]]
    if score is not None:
        columns.append(score)
    rows = _cells(source, columns)
    times, note = source.times(clock, second)
    t, frame = np.unique(times, return_inverse=True)
    if key is None:
        names, point = _unnamed(t, frame, source)
    else:
        labels = source.column(key)
        names = list(dict.fromkeys(labels))
        if all(re.fullmatch(r"[0-9]+(\.0*)?", name) for name in names):
            names = sorted(names, key=float)
        number = {name: k for k, name in enumerate(names)}
        point = np.array([number[label] for label in labels])
        _check_once(t, frame, point, names, source)
    values = np.full((len(t), len(names), 3), np.nan)
    lines = np.zeros((len(t), len(names)), int)
    values[..., 2] = np.inf
    values[frame, point, : len(columns)] = rows
    lines[frame, point] = source.lines
    lines = np.where(lines, lines, lines.max(1, keepdims=True))
    return Table(
        t,
        values,
        tuple(names),
        lines,
        unit,
        timed,
        _unused(header, {clock, key, *columns}),
        notes=(note,) if note else (),
    )


def _unused(header: Sequence[str], used: set[int | None]) -> tuple[str, ...]:
    """Return the names of columns that are neither used nor name animals."""
    rest = [name for k, name in enumerate(header) if k not in used]
    return tuple(name for name in rest if plain(name) not in ANIMALS)


def _unnamed(
    t: np.ndarray, frame: np.ndarray, source: Rows
) -> tuple[list[str], np.ndarray]:
    """Return names of points, 1, 2 ..., and the number (N,) of each row's point, in the
    order of the rows; Refusal if frames differ in their number."""
    counts = np.bincount(frame)
    usual = np.bincount(counts).argmax()
    bad = np.flatnonzero(counts != usual)
    if bad.size:
        line = source.lines[np.flatnonzero(frame == bad[0])[0]]
        raise Refusal(
            f"{counts[bad[0]]} points at t = {t[bad[0]]:g}, but at most {usual} "
            "at other times",
            where=f"{source.name}, line {line}",
            instead="number the points in a column `point`, so that missing points "
            "are recognised",
        )
    point = np.zeros(len(frame), int)
    for k in range(len(t)):
        point[frame == k] = np.arange(counts[0])
    return [str(k + 1) for k in range(counts[0])], point


def _check_once(t, frame, point, names, source: Rows) -> None:
    """Refuse a point that is given twice in a frame."""
    keys = frame * len(names) + point
    _, number = np.unique(keys, return_inverse=True)
    _refuse_animals(source, number)
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    if (count > 1).any():
        again = np.flatnonzero(keys == keys[first[count > 1][0]])[1]
        raise Refusal(
            f"point {names[point[again]]} is given twice at t = {t[frame[again]]:g}",
            where=f"{source.name}, line {source.lines[again]}",
            instead="keep one of them, or name the animals in a column track",
        )


def _parse_wide(
    source: Rows,
    header: tuple[str, ...],
    pairs: dict[str, dict[str, int]],
    program: str,
) -> Table:
    """Return the table of a file with a row for each frame."""
    if len(pairs) < 2:
        raise Refusal(
            "no columns of points",
            where=source.place,
            because=f"the columns are {formatted(', '.join(header), 120)}",
            instead=HEADERS,
        )
    clock, second, timed = _clock(header, source.place)
    names = []
    for columns in pairs.values():
        names += [header[columns["x"]], header[columns["y"]]]
    unit = _common_unit(names, source.place)
    return _parse_frames(source, header, pairs, (clock, second, timed), unit, program)


def _parse_frames(
    source: Rows,
    header: Sequence[str],
    pairs: dict[str, dict[str, int]],
    clock: tuple[int, str, bool],
    unit: str,
    program: str,
) -> Table:
    """Return the table of rows of frames. clock: as `_clock` returns it."""
    index, second, timed = clock
    picks = list(itertools.chain(*[columns.values() for columns in pairs.values()]))
    rows = _cells(source, picks)
    t, note = source.times(index, second)
    lines = source.lines
    _, frame = np.unique(t, return_inverse=True)
    _refuse_animals(source, frame, program)
    for k in np.flatnonzero(np.diff(t, prepend=-np.inf) <= 0):
        if t[k] == t[k - 1]:
            what = f"t = {t[k]:.6g} is given twice"
            cure = "keep one of the rows"
        else:
            what = f"t = {t[k]:.6g} comes after {t[k - 1]:.6g}"
            cure = "sort the rows by time, with one row for each"
        raise Refusal(what, where=f"{source.name}, line {lines[k]}", instead=cure)
    values = np.full((len(t), len(pairs), 3), np.inf)
    place = {pick: j for j, pick in enumerate(picks)}
    for p, columns in enumerate(pairs.values()):
        for j, coordinate in enumerate(("x", "y", "score")):
            if coordinate in columns:
                values[:, p, j] = rows[:, place[columns[coordinate]]]
    return Table(
        t,
        values,
        tuple(pairs),
        np.repeat(lines[:, None], len(pairs), 1),
        unit,
        timed,
        _unused(header, {index, *picks}),
        program,
        notes=(note,) if note else (),
    )


def _deeplabcut(source: Rows, individual: str | None) -> Table:
    """Return the table of a file of DeepLabCut: the first cell of each header row says
    what it holds.

    Individuals without a point, and what it calls single, points that belong to no
    animal, are left out unless they are named."""
    heads = {source.words[0].lower(): list(source.words[1:])}
    for _, text in source.rows[:3]:
        words = source.cells(text)
        if words[0].lower() in DEEPLABCUT_WORDS:
            heads[words[0].lower()] = words[1:]
    lengths = {len(words) for words in heads.values()}
    if not {"bodyparts", "coords"} <= {*heads} or len(lengths) > 1:
        raise Refusal(
            "a file of DeepLabCut has header rows scorer, bodyparts and coords of equal"
            " length",
            where=source.place,
            instead="give the file as DeepLabCut writes it, or one header row such as"
            " frame,nose_x,nose_y",
        )
    if "z" in heads["coords"]:
        raise Refusal(
            "it has points in three dimensions, but midlines are planar",
            where=source.place,
            instead="give the file of one camera, or x and y as frame,nose_x,nose_y",
        )
    source = replace(source, rows=source.rows[len(heads) - 1 :])
    parts = list(zip(heads["bodyparts"], heads["coords"]))
    animals = heads.get("individuals", [""] * len(parts))
    header = ["frame", *(f"{part}.{c.lower()}" for part, c in parts)]
    animal, notes = _chosen(source, animals, individual)
    columns = [k for k, name in enumerate(animals) if name == animal]
    kept = ["frame", *("" for _ in animals)]
    for k in columns:
        kept[k + 1] = header[k + 1]
    table = _parse_frames(
        source, kept, _pairs(kept), (0, "frame", False), "px", DEEPLABCUT
    )
    return table._replace(
        unused=(), least_score=LEAST_SCORE, notes=(*table.notes, *notes)
    )


def _chosen(
    source: Rows, animals: Sequence[str], individual: str | None
) -> tuple[str, list[str]]:
    """Return the individual to take, and a note on those that are left out. animals: of
    each column but the first."""
    names = list(dict.fromkeys(animals))
    if individual is not None:
        return choose("``individual``", individual, names), []
    if len(names) == 1:
        return names[0], []
    filled: set[int] = set()
    for _, text in source.rows:
        cells = source.cells(text)
        filled |= {k for k, cell in enumerate(cells) if cell.lower() not in MISSING}
    points = dict.fromkeys(names, 0)
    for k, name in enumerate(animals):
        points[name] += k + 1 in filled
    with_points = [name for name in names if points[name] and name != SINGLE]
    if len(with_points) != 1:
        raise Refusal(
            f"it contains {len(with_points)} individuals: {', '.join(with_points[:6])}",
            where=source.name,
            instead="choose one with ``individual``",
        )
    chosen = with_points[0]
    others = []
    for name in names:
        if name == SINGLE:
            others.append(f"{name} (points of no animal)")
        elif name != chosen:
            others.append(f"{name} (no point)")
    return chosen, [f"{', '.join(others)} left out: use ``individual`` to choose one"]


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
            instead="list each once, from one end of the body",
        )
    picks = [lower.index(x.strip().lower()) for x in points]
    names = tuple(table.names[k] for k in picks)
    return table._replace(
        values=table.values[:, picks], names=names, lines=table.lines[:, picks]
    )


def _check(table: Table, name: str) -> None:
    """Refuse too few or too many points, and too few frames."""
    frames, points = table.values.shape[:2]
    if not FEWEST_POINTS <= points <= MOST_POINTS:
        raise Refusal(
            f"{points} points along the body",
            where=name,
            instead=f"give {FEWEST_POINTS} to {MOST_POINTS}, preferably 10",
        )
    if frames < FEWEST_FRAMES:
        raise Refusal(
            f"{frames} frames",
            where=name,
            instead=(
                "give a whole trial, with 20 frames per cycle for at least one cycle"
            ),
        )


def _unit(
    table: Table, name: str, units: str | None, scale: float | None
) -> tuple[str, float, list[str]]:
    """Return the unit of lengths, m or BL or "", the file's unit in it, and
    assumptions."""
    if units and table.unit and units != table.unit and table.unit != "px":
        raise Refusal(
            f"the column names give x and y in {table.unit}",
            where=name,
            instead="remove ``units``",
        )
    unit = units or table.unit
    if scale is not None and unit not in ("px", ""):
        raise Refusal(
            "``scale`` applies to pixels",
            where=name,
            instead=f"remove it: x and y are in {unit}",
        )
    if scale is not None:
        return "m", scale * 1e-3, []
    if unit in LENGTHS:
        return "m", LENGTHS[unit], []
    if unit == "BL":
        return "BL", 1.0, []
    note = (
        "lengths are in body lengths only: the unit of x and y is unknown; add "
        "``units``, such as mm"
    )
    if unit == "px":
        note = (
            "lengths are in body lengths only: the size of a pixel is unknown; add "
            "``scale``, the mm per pixel"
        )
    return "", 1.0, [note]


def _time(table: Table, fps: float | None) -> tuple[np.ndarray, bool, list[str]]:
    """Return times (F,), whether they are in s, and assumptions."""
    if table.timed:
        if fps is not None:
            raise Refusal(
                "``fps`` applies to a file that counts frames",
                instead="remove it: the file has a time",
            )
        return table.t, True, []
    if fps is not None:
        return table.t / fps, True, []
    return (
        table.t,
        False,
        ["times are in frames: the frame rate is unknown; add ``fps``, such as 250"],
    )
