"""The rows of an unfinished sweep, in a file of its question's own that is believed only if it is whole, and the lock that
keeps two sweeps from one output.

The file is a line of JSON, the question with its checksum, and behind it blocks of rows as they come: their number, a
checksum, and the numbers themselves, eight bytes each. What a kill leaves of a last block is dropped.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import struct
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from geomech.errors import SceneError
from geomech.files import hidden, locked, note, sweep_strays, whole_file, why

LARGEST = 10_000_000  # bytes of the first line
VERSIONS = {"geomech", "solver"}  # of a question: what another one left cannot be taken up any more
WIDTH = 5  # numbers in a row: x, y, theta and the errors of position and heading
BLOCK = struct.Struct("<QI")  # rows, and the checksum of their bytes
SAVE_EVERY = 2.0  # seconds between savings of what there is


def beside(output: Path, question: dict) -> Path:
    """The file that keeps what is done of the sweep to ``output`` that answers this question (JSON): ``.NAME.partial``,
    or, where that keeps what is done of another sweep, a name of the question's own."""
    first, key = hidden(_plain(output), ".partial"), hashlib.sha256(json.dumps(question).encode()).hexdigest()[:8]
    own = hidden(_plain(output), f".{key}.partial")
    return own if os.path.lexists(own) or _is_anothers(first, json.loads(json.dumps(question))) else first


def is_second(output: Path, partial: Path) -> bool:
    """Whether another unfinished sweep to ``output`` has taken the usual name of what is kept."""
    first = hidden(_plain(output), ".partial")
    return partial != first and os.path.lexists(first)


def _is_anothers(path: Path, question: dict) -> bool:
    """Whether a file keeps, undamaged, what is done of another sweep; that of another version is none."""
    try:
        with _opened(path, "rb") as file:
            found = _head(file)["question"]
        return any(found[key] != question[key] for key in {*question} - VERSIONS)
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError):
        return False


@contextlib.contextmanager
def alone(output: Path):
    """Hold the lock of sweeps to ``output``: SceneError while another process has it. It is freed however its owner ends;
    where the file system has no locks nothing is held."""
    path = hidden(_plain(output), ".lock")
    with contextlib.ExitStack() as stack:
        try:
            held = stack.enter_context(locked(path))
        except OSError as error:
            raise SceneError(f"cannot keep a sweep beside {output}: {why(error)}; choose another -o") from None
        if not held:
            raise SceneError(
                f"another sweep to {output} is under way: wait for it, stop it, or choose another output with -o"
            )
        yield


def _plain(output: Path) -> Path:
    return output.resolve() if ".." in output.parts else output


class Rows:
    """The rows done so far of a sweep, (total, width) when all are, saved to ``path`` every now and then, and when computing
    ends for whatever reason. settled: the back end they are computed by, `geomech.workers.settle`; that of what is taken
    up goes on."""

    def __init__(self, path: Path | None, question: dict, total: int, settled: str = "", width: int = WIDTH):
        self.path, self.total, self.told = path, total, False
        self.question, self.settled, done = question, settled, np.zeros((0, width))
        self.end = 0  # bytes of the file that are believed
        if path is not None:
            self.settled, done, self.end = taken_up(path, question, total, width) or (settled, done, 0)
        self.values = np.empty((total, width))
        self.values[: len(done)] = done
        self.count = self.saved = len(done)
        self.due = time.monotonic() + SAVE_EVERY

    def __len__(self) -> int:
        return self.count

    def add(self, rows) -> None:
        rows = np.asarray(rows, float)
        self.values[self.count : self.count + len(rows)] = rows
        self.count += len(rows)
        if time.monotonic() > self.due:
            self._save()

    def _save(self) -> None:
        """A disk that is full now is no reason to lose what is computed."""
        if self.path and self.count > self.saved:
            try:
                if not self.end:
                    self.end = begin(self.path, self.question, self.settled)
                self.end = append(self.path, self.end, self.values[self.saved : self.count])
                self.saved = self.count
            except (SceneError, OSError) as error:
                if not self.told:
                    note(f"what is done of the sweep is not kept: {error}")
                self.told = True
        self.due = time.monotonic() + SAVE_EVERY

    def __enter__(self) -> Rows:
        return self

    def __exit__(self, kind, error, _) -> None:
        self._save()
        if error and self.path and self.saved:
            told = f"{self.saved} of {self.total} points are kept in {self.path}: the same command goes on from there"
            error.add_note(told)


def begin(path: Path, question: dict, settled: str = "") -> int:
    """A file without rows yet; it appears whole or not at all. The bytes it has."""
    body = {"question": question, "settled": settled}
    line = json.dumps({**body, "checksum": _checksum(body)}).encode() + b"\n"
    with whole_file(path) as part:
        part.write_bytes(line)
    return len(line)


def append(path: Path, end: int, rows: np.ndarray) -> int:
    """Write rows behind the first ``end`` bytes; where they end."""
    raw = np.ascontiguousarray(rows, "<f8").tobytes()
    with _opened(path, "r+b") as file:
        file.truncate(end)
        file.seek(end)
        file.write(BLOCK.pack(len(rows), zlib.crc32(raw)) + raw)
    return end + BLOCK.size + len(raw)


def taken_up(path: Path, question: dict, points: int, width: int = WIDTH) -> tuple[str, np.ndarray, int] | None:
    """(back end, rows kept, bytes of the file that they take), of at most ``points``, for the same question; else None, and
    what is there is set aside, with a note that says why. SceneError if it is no file, or cannot be set aside."""
    try:
        sweep_strays(path.resolve())
        if not os.path.lexists(path):
            return None
        if not path.is_file():
            raise SceneError(
                f"cannot keep what is done in {path}: it is no ordinary file; remove it, or choose another -o"
            )
        with _opened(path, "rb") as file:
            return _believed(file, json.loads(json.dumps(question)), points, width)
    except SceneError:
        raise
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError) as error:
        _set_aside(path, str(error) if type(error) is _Unbelievable else f"it is damaged ({type(error).__name__})")
    return None


def _opened(path: Path, mode: str) -> BinaryIO:
    """An ordinary file; nobody waits for another end of a pipe."""
    if not path.is_file():
        raise OSError("it is no ordinary file")
    return path.open(mode)


class _Unbelievable(ValueError):
    """Its text says what is wrong with a file that is kept."""


def _head(file: BinaryIO) -> dict:
    """What the first line says."""
    found = json.loads(file.readline(LARGEST))
    if found.pop("checksum") != _checksum(found):
        raise _Unbelievable("it is damaged (checksum)")
    return found


def _believed(file: BinaryIO, question: dict, points: int, width: int) -> tuple[str, np.ndarray, int]:
    found = _head(file)
    if other := [key for key, value in question.items() if found["question"].get(key) != value]:
        raise _Unbelievable(f"it is of another sweep ({', '.join(other)})")
    if found["settled"] not in ("", "numpy", "numba"):
        raise _Unbelievable("its back end is unknown")
    rows, end = np.empty((points, width)), file.tell()
    done = 0
    for count, raw in _blocks(file, width):
        if done + count > points:
            raise _Unbelievable("its rows are not those of this sweep")
        rows[done : done + count] = np.frombuffer(raw, "<f8").reshape(count, width)
        done, end = done + count, file.tell()
    if not np.isfinite(rows[:done]).all():
        raise _Unbelievable("its rows are not those of this sweep")
    return found["settled"], rows[:done], end


def _blocks(file: BinaryIO, width: int) -> Iterator[tuple[int, bytes]]:
    """(rows, their bytes) of each whole block."""
    start = file.tell()
    left = file.seek(0, os.SEEK_END) - start
    file.seek(start)
    while left >= BLOCK.size:
        count, checksum = BLOCK.unpack(file.read(BLOCK.size))
        left -= BLOCK.size + 8 * width * count
        if left < 0:  # a kill in the middle of it
            return
        raw = file.read(8 * width * count)
        if zlib.crc32(raw) != checksum:
            raise _Unbelievable("it is damaged (checksum)")
        yield count, raw


def _checksum(body: dict) -> str:
    return hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()


def _set_aside(path: Path, reason: str) -> None:
    """Rename a file that is not believed to the first name that is free."""
    names = (path.with_name(path.name + f".set-aside{k}") for k in ("", *(f"-{k}" for k in range(2, 10_000))))
    try:
        aside = next(name for name in names if not os.path.lexists(name))
        path.rename(aside)
    except (OSError, StopIteration) as error:
        raise SceneError(f"cannot set {path} aside, {reason}: {why(error)}; remove it, or choose another -o") from None
    note(f"{path} is not taken up, {reason}: set aside as {aside.name}")
