"""Logs of an experiment, CSV: time, joint angles and the pose of the body, row by
row."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.errors import UnitWarning
from geomech.io.rows import UNITS, Rows, plain, split_unit
from geomech.io.rows import read as read_rows
from geomech.io.tables.base import LARGEST_ANGLE
from rft.core.notes import warn
from rft.core.refusal import Refusal, formatted

LARGEST_FILE = 100_000_000  # bytes
MOST_ROWS = 500_000
FEWEST_ROWS = 100
MOST_JOINTS = 6  # the columns of the regression grow with their cube
POSE = {  # names without their units
    "t": ("t", "time"),
    "x": ("x",),
    "y": ("y",),
    "heading": ("heading", "theta", "yaw"),
}
JOINT = re.compile(r"(alpha|joint|angle|a|q)_?([0-9]+)")
# Columns in place of t that are no times.
UNTIMED = ("phase", "frame", "frames", "sample", "index")
SPIKE = 20.0  # deviation from neighbouring rows over that of nine in ten rows
LARGE = 0.05  # of a column's range: least deviation of an outlier
HEADERS = "give a CSV file with a header such as t,alpha_1,alpha_2,x,y,heading"


@dataclass(frozen=True, eq=False)
class Log:
    """Rows of a log, checked.

    name: of the file. t: (N,), ascending. alpha: (N, d), rad; they and the heading have
    no jumps by a full turn. pose: (N, 3), x, y, heading. joints: names of their
    columns. lines: (N,), line of each row in the file. seconds: t is a time. metres: x
    and y are in m. size: unit of x and y in the file, in m, where it names one, else 1.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.studies.measured import read, synthetic
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "log.csv"
    >>> log = synthetic.synthetic_log(velocity, Circle(0.8), cycles=5)
    >>> synthetic.save(file, log)
    >>> read(file).alpha.shape  # rad
    (301, 2)
    """

    name: str
    t: np.ndarray
    alpha: np.ndarray
    pose: np.ndarray
    joints: tuple[str, ...]
    lines: np.ndarray
    seconds: bool = True
    metres: bool = False
    size: float = 1.0

    def wrong(self, what: str, row: int | None = None, **facts: Any) -> Refusal:
        """Return a Refusal about a row, or about the whole file. facts: keywords of
        `Refusal`."""
        where = self.name
        if row is not None:
            where = f"{self.name}, line {self.lines[row]}"
        return Refusal(what, where=where, **facts)


def read(path: str | Path, columns: Sequence[str] = (), degrees: bool = False) -> Log:
    """Return the log in a file; Refusal for one that cannot be used.

    columns: names of the time, of all joint angles, of x, y and the heading, in this
    order; by default those with known names (`POSE`, `JOINT`; "phase" in place of a
    time). degrees: joint angles and heading are in degrees where their columns name no
    unit.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.studies.measured import read, synthetic
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "log.csv"
    >>> log = synthetic.synthetic_log(velocity, Circle(0.8), cycles=20)
    >>> synthetic.save(file, log)
    >>> log = read(file)
    >>> log.joints, log.pose.shape
    (('alpha_1', 'alpha_2'), (1201, 3))
    """
    try:
        source = read_rows(path, LARGEST_FILE, HEADERS)
        line, header = source.header
        names = [c.strip().lower() for c in columns]
        picked = _pick(source.name, line, header, names)
        if len(source.rows) > MOST_ROWS:
            raise Refusal(
                f"{len(source.rows)} rows, more than {MOST_ROWS}",
                where=source.name,
                instead="reduce the number of rows",
            )
        log = _read(source, picked, degrees)
    except ValueError as error:
        if "a row must be" in error.what:
            error.instead = "correct that row, or remove it"
        raise
    turn = np.ones(len(picked))
    turn[[*range(1, len(picked) - 3), -1]] = _turns(picked, degrees, source.place)
    _check_times(log)
    _check_units(log, picked, turn)
    return _checked(log)


def _read(source: Rows, picked: tuple[str, ...], degrees: bool) -> Log:
    """Return the log in the picked columns, in s or as the file counts, rad and m."""
    header = source.header[1]
    notes = list(source.notes)
    turns = _turns(picked, degrees, source.place)
    clock = header.index(picked[0])
    t, note = source.times(clock, unit_of_time(picked[0]))
    if note:
        notes.append(note)
    if turns[-1] != turns[0] and not split_unit(picked[-1])[1]:
        notes.append(f"{picked[-1]} is assumed to be in rad")
    unit, size = _length(picked, source.place)
    rows = source.numbers(header, picked[1:])
    alpha = rows[:, :-3] * turns[:-1]
    xy = rows[:, -3:-1] * size
    heading = rows[:, -1] * turns[-1]
    source.issue(notes)
    return Log(
        source.name,
        t,
        alpha,
        np.column_stack([xy, heading]),
        picked[1:-3],
        source.lines,
        seconds=picked[0] not in UNTIMED,
        metres=unit in UNITS["length"],
        size=size,
    )


def unit_of_time(name: str) -> str:
    """Return the unit of time that a column names, "" without one."""
    unit = split_unit(name)[1]
    return unit if unit in UNITS["time"] else ""


def _turns(picked: tuple[str, ...], degrees: bool, place: str) -> np.ndarray:
    """Return rad per unit of the joints and the heading; Refusal for other units."""
    turns = []
    for name in (*picked[1:-3], picked[-1]):
        unit = split_unit(name)[1]
        if unit not in UNITS["angle"] and unit != "":
            raise Refusal(
                f"the name of {name} gives the unit {unit}",
                where=place,
                instead="give angles in rad, or in degrees",
            )
        if degrees and unit in ("rad", "radians"):
            raise Refusal(
                f"the name of {name} gives the unit rad",
                where=place,
                instead="remove ``degrees``, or rename the column",
            )
        if unit == "":
            unit = "deg" if degrees else "rad"
        turns.append(UNITS["angle"][unit])
    named = [bool(split_unit(name)[1]) for name in picked[1:-3]]
    if any(named) and not all(named):
        raise Refusal(
            f"{picked[1 + named.index(False)]} has no unit, but other joints have one",
            where=place,
            instead="give each its unit, as in alpha_1_deg",
        )
    return np.array(turns)


def _length(picked: tuple[str, ...], place: str) -> tuple[str, float]:
    """Return the unit of x and y, "" where none is named, and its size in m; Refusal
    for two units, or pixels."""
    units = [split_unit(name)[1] for name in picked[-3:-1]]
    unit = units[0]
    if units[1] != unit:
        raise Refusal(
            f"{picked[-3]} and {picked[-2]} have different units",
            where=place,
            instead="give both in the same unit",
        )
    if unit in ("", "BL"):
        return unit, 1.0
    if unit not in UNITS["length"]:
        raise Refusal(
            f"the name of {picked[-3]} gives the unit {unit}",
            where=place,
            instead="give x and y in body lengths, or in m with ``body_length``",
        )
    return unit, UNITS["length"][unit]


def _pick(
    name: str, line: int, header: tuple[str, ...], columns: list[str]
) -> tuple[str, ...]:
    """Return the names of the columns of the time, the joints, x, y and the heading;
    Refusal if one is missing or ambiguous."""
    where = f"{name}, line {line}"
    twice = [c for k, c in enumerate(header) if c in header[:k]]
    if twice:
        raise Refusal(
            f"the column {formatted(twice[0])} appears twice",
            where=where,
            instead="rename one of them",
        )
    if columns:
        return _check_columns(name, where, header, columns)
    if len(header) < 2:
        raise Refusal("no header of columns", where=where, instead=HEADERS)

    bare = {c: plain(split_unit(c)[0]) for c in header}
    roles: dict[str, str] = {}
    for role, names in POSE.items():
        candidates = [c for c in header if bare[c] in names]
        if len(candidates) > 1:
            raise Refusal(
                f"both {' and '.join(candidates)} could be the column {role}",
                where=where,
                instead="list the columns to use in ``columns``",
            )
        if candidates:
            roles[role] = candidates[0]
    if "t" not in roles and "phase" in header:
        roles["t"] = "phase"
    joints = _joint_columns(header, bare)
    missing = [role for role in POSE if role not in roles]
    if missing or len(joints) < 2:
        few = "one column" if joints else "no columns"
        what = f"{few} of joint angles, but a gait is a loop of two or more"
        if missing:
            what = f"no column {missing[0]}"
        raise Refusal(
            what,
            where=where,
            because=f"the columns are {formatted(', '.join(header), 240)}",
            instead="name them t,alpha_1,alpha_2,x,y,heading, or list the columns in "
            "``columns``",
        )
    return _check_joints(
        name, [roles["t"], *joints, roles["x"], roles["y"], roles["heading"]]
    )


def _check_columns(
    name: str, where: str, header: tuple[str, ...], columns: list[str]
) -> tuple[str, ...]:
    """Return the columns that a user lists; Refusal if one is missing, or named
    twice."""
    columns = [c.removeprefix("%") for c in columns]
    missing = [c for c in columns if c not in header]
    if missing:
        existing = formatted(", ".join(header), 200)
        raise Refusal(
            f"no column {formatted(missing[0])}; the columns are {existing}",
            where=where,
        )
    if len(columns) < 6 or len({*columns}) < len(columns):
        raise Refusal(
            "``columns`` must list t, two or more joint angles, x, y and heading, in "
            "this order",
            where=name,
        )
    return _check_joints(name, columns)


def _joint_columns(header: tuple[str, ...], bare: dict[str, str]) -> list[str]:
    """Return the columns of joint angles in the order of their numbers: those with the
    kind of name that comes first in the header."""
    numbered = []
    kinds = []
    for column in header:
        match = JOINT.fullmatch(bare[column])
        if match:
            kind, number = match.groups()
            kinds.append(kind)
            numbered.append((int(number), kind, column))
    return [column for _, kind, column in sorted(numbered) if kind == kinds[0]]


def _check_joints(name: str, columns: list[str]) -> tuple[str, ...]:
    """Return the columns; Refusal for too many joint angles."""
    if len(columns) - 4 > MOST_JOINTS:
        raise Refusal(
            f"{len(columns) - 4} joint angles, more than {MOST_JOINTS}",
            where=name,
            instead="describe the shape by a few modes, one per column",
        )
    return tuple(columns)


def _check_times(log: Log) -> None:
    """Refuse too few rows, and times that do not ascend."""
    if len(log.t) < FEWEST_ROWS:
        raise log.wrong(
            f"{len(log.t)} rows are too few",
            instead=f"give at least {FEWEST_ROWS}, of many cycles",
        )
    step = np.diff(log.t)
    bad = np.flatnonzero(step <= 0)
    if bad.size:
        k = bad[0]
        if step[k] == 0:
            raise log.wrong(
                f"t = {log.t[k]:.6g} is given twice",
                k + 1,
                instead="keep one of the rows",
            )
        raise log.wrong(
            f"t = {log.t[k + 1]:.6g} comes after {log.t[k]:.6g}",
            k + 1,
            instead="sort the rows by time",
        )


def _check_units(log: Log, picked: Sequence[str], turn: np.ndarray) -> None:
    """Refuse degrees that are read as radians; warn of radians read as degrees."""
    step = np.abs(np.diff(log.pose[:, 2]))
    jumps = np.flatnonzero(np.abs(step - 360) < 30)
    if turn[-1] == 1.0 and jumps.size:
        k = jumps[0] + 1
        raise log.wrong(
            f"{picked[-1]} jumps by {step[k - 1]:.4g}, a full turn in degrees",
            k,
            instead="say ``degrees``",
        )
    for k, name in enumerate(log.joints):
        row = int(np.abs(log.alpha[:, k]).argmax())
        angle = log.alpha[row, k]
        if turn[k + 1] == 1.0 and abs(angle) > 2 * np.pi:
            raise log.wrong(
                f"{name} reaches {angle:.4g} where joint angles are in rad",
                row,
                instead="add ``degrees`` if these are degrees",
            )
        if abs(angle) > LARGEST_ANGLE:
            raise log.wrong(
                f"{name} reaches {np.degrees(angle):.4g} degrees",
                row,
                because="no joint turns that far",
            )
    size = np.degrees(np.abs(log.alpha).max())
    are_degrees = (turn[1:-3] != 1.0).all()
    if are_degrees and size < 2 * np.pi:
        warn(
            f"{log.name}: joint angles are at most {size:.3g} degrees: remove "
            "``degrees`` if they are in rad",
            UnitWarning,
        )


def _checked(log: Log) -> Log:
    """Return the log without jumps by a full turn; Refusal for a column that does not
    move."""
    pose = np.column_stack([log.pose[:, :2], np.unwrap(log.pose[:, 2])])
    alpha = np.unwrap(log.alpha, axis=0)
    for name, values in zip(log.joints, alpha.T):
        if np.ptp(values) < 1e-6:
            raise log.wrong(
                f"{name} does not move", instead="leave it out with ``columns``"
            )
    if (np.ptp(pose, axis=0) == 0).all():
        raise log.wrong(
            "x, y and heading do not move",
            because="no motion of the body was measured",
        )
    return replace(log, alpha=alpha, pose=pose)


def check_rows(log: Log) -> None:
    """Refuse an outlier, and a column that jumps."""
    step = np.diff(log.t)
    share = step[:-1] / (step[:-1] + step[1:])
    is_near = np.maximum(step[:-1], step[1:]) <= 2.5 * np.median(step)
    names = (*log.joints, "x", "y", "heading")
    for name, v in zip(names, np.column_stack([log.alpha, log.pose]).T):
        # From the line between the rows before and after.
        deviation = v[1:-1] - (1 - share) * v[:-2] - share * v[2:]
        deviation = np.where(is_near, deviation, 0.0)
        k = int(np.abs(deviation).argmax())
        usual = SPIKE * np.quantile(np.abs(deviation), 0.9)
        if abs(deviation[k]) <= max(usual, LARGE * np.ptp(v)):
            continue
        if abs(deviation[k]) > abs(v[k + 2] - v[k]):
            raise log.wrong(
                f"{name} differs by {deviation[k]:.3g} from the rows before and after",
                k + 1,
                instead="correct that row, or remove it",
            )
        jump = k + 2
        if abs(v[k + 1] - v[k]) > abs(v[k + 2] - v[k + 1]):
            jump = k + 1
        reason = "the tracking slipped"
        if name in log.joints:
            reason = "the file contains two gaits, or the tracking slipped"
        raise log.wrong(
            f"{name} jumps by {v[jump] - v[jump - 1]:.3g} to this row",
            jump,
            because=reason,
            instead="cut the log there",
        )
