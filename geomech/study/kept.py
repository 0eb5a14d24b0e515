"""What is done of an unfinished request, in a file of its question's own that is believed only if it is whole, and the lock
that keeps two of them from one output.

The file is a line of JSON, the question with its checksum, and behind it blocks of rows as they come: their number, a
checksum, and the numbers themselves, eight bytes each. What a kill leaves of a last block is dropped. A sweep keeps its
points (`Rows`), other requests what is computed side by side (`geomech.study.parts`).
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import struct
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from geomech.errors import SceneError
from geomech.files import hidden, locked, note, sweep_strays, whole_file, why

LARGEST = 10_000_000  # bytes of the first line
VERSIONS = {"geomech", "solver"}  # of a question: what another one left cannot be taken up any more
WIDTH = 5  # numbers in a row: x, y, theta and the errors of position and heading
BLOCK = struct.Struct("<QI")  # rows, and the checksum of their bytes
SAVE_EVERY = 2.0  # seconds between savings of what there is


def beside(output: Path, question: dict) -> Path:
    """The file that keeps what is done for ``output`` of the request that answers this question (JSON): ``.NAME.partial``,
    or, where that keeps what is done of another one, a name of the question's own."""
    first, own = (hidden(_plain(output), ending) for ending in (".partial", f".{_key(question)}.partial"))
    return own if os.path.lexists(own) or _is_anothers(first, json.loads(json.dumps(question))) else first


def stands_for(output: Path) -> Path:
    """A file or, of a folder, a name in it, or where it will be, beside which is kept what is done."""
    if output.is_dir():
        return output / (output.resolve().name or "geomech")
    there = next((p for p in output.parents if p.is_dir()), output.parent)
    return there / "-".join(output.relative_to(there).parts)


def printed(question: dict) -> Path:
    """Likewise, for what goes into no file."""
    return Path(f"geomech-{_key(question)}")


def is_second(output: Path, partial: Path) -> bool:
    """Whether another unfinished request for ``output`` has taken the usual name of what is kept."""
    first = hidden(_plain(output), ".partial")
    return partial != first and os.path.lexists(first)


def _key(question: dict) -> str:
    return hashlib.sha256(json.dumps(question).encode()).hexdigest()[:8]


def _is_anothers(path: Path, question: dict) -> bool:
    """Whether a file keeps, undamaged, what is done of another request; that of another version is none."""
    try:
        with _opened(path, "rb") as file:
            found = _head(file)["question"]
        return any(found.get(key) != question[key] for key in {*question} - VERSIONS)
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError):
        return False


@contextlib.contextmanager
def alone(output: Path, what: str = "sweep"):
    """Hold the lock of what is computed for ``output``: SceneError while another process has it. It is freed however its
    owner ends; where the file system has no locks nothing is held."""
    path = hidden(_plain(output), ".lock")
    with contextlib.ExitStack() as stack:
        try:
            held = stack.enter_context(locked(path))
        except OSError as error:
            raise SceneError(f"cannot keep a {what} beside {output}: {why(error)}; choose another -o") from None
        if not held:
            raise SceneError(
                f"another {what} to {output} is under way: wait for it, stop it, or choose another output with -o"
            )
        yield


def _plain(output: Path) -> Path:
    """The same path for all names of a file, links to it among them."""
    return Path(os.path.realpath(output)) if ".." in output.parts or output.is_symlink() else output


class Kept:
    """What is done so far of a request, saved to ``path`` every now and then. settled: the back end that computes it,
    `geomech.workers.settle`; that of what is taken up goes on. count, saved: how much is done, and is in the file."""

    what = "request"
    count = saved = end = 0  # end: bytes of the file that are believed

    def __init__(self, path: Path | None, question: dict, settled: str = ""):
        self.path, self.question, self.settled, self.told = path, question, settled, False
        self.due = time.monotonic() + SAVE_EVERY

    def unsaved(self) -> Sequence[np.ndarray]:
        """What is done and not in the file, as blocks."""
        raise NotImplementedError

    def forget(self, end: int) -> None:
        """All of it is in the file, which ends there. No signal comes between the two."""
        self.end, self.saved = end, self.count

    def save(self, always: bool = False) -> None:
        """What there is, if it is time. A disk that is full now is no reason to lose what is computed."""
        if not (always or time.monotonic() > self.due):
            return
        if self.path and (blocks := self.unsaved()):
            try:
                if not self.end:
                    self.end = begin(self.path, self.question, self.settled)
                self.forget(append(self.path, self.end, *blocks))
            except (SceneError, OSError) as error:
                if not self.told:
                    note(f"what is done of the {self.what} is not kept: {error}")
                self.told = True
        self.due = time.monotonic() + SAVE_EVERY

    def __enter__(self):
        return self


class Rows(Kept):
    """The rows done so far of a sweep, (total, width) when all are, saved whenever computing ends, for whatever reason."""

    what = "sweep"

    def __init__(self, path: Path | None, question: dict, total: int, settled: str = "", width: int = WIDTH):
        super().__init__(path, question, settled)
        self.total, done = total, np.zeros((0, width))
        if path is not None:
            self.settled, done, self.end = taken_up(path, question, total, width) or (settled, done, 0)
        self.values = np.empty((total, width))
        self.values[: len(done)] = done
        self.count = self.saved = len(done)

    def __len__(self) -> int:
        return self.count

    def left(self, seconds: float | None) -> float | None:
        """What is left of so many seconds, those of the whole sweep."""
        return None if seconds is None else seconds * (1.0 - self.count / self.total)

    def unsaved(self) -> list[np.ndarray]:
        return [self.values[self.saved : self.count]] if self.count > self.saved else []

    def add(self, rows) -> None:
        rows = np.asarray(rows, float)
        self.values[self.count : self.count + len(rows)] = rows
        self.count += len(rows)
        self.save()

    def __exit__(self, kind, error, _) -> None:
        self.save(always=True)
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


def append(path: Path, end: int, *blocks: np.ndarray) -> int:
    """Write blocks of rows behind the first ``end`` bytes; where they end."""
    with _opened(path, "r+b") as file:
        file.truncate(end)
        file.seek(end)
        for rows in blocks:
            raw = np.ascontiguousarray(rows, "<f8").tobytes()
            file.write(BLOCK.pack(len(rows), zlib.crc32(raw)) + raw)
        return file.tell()


def taken_up(path: Path, question: dict, points: int, width: int = WIDTH) -> tuple[str, np.ndarray, int] | None:
    """(back end, rows kept, bytes of the file that they take), of at most ``points``, as `read_from` has them."""
    return read_from(path, lambda file: _believed(file, json.loads(json.dumps(question)), points, width))


def read_from(path: Path, read: Callable[[BinaryIO], Any]) -> Any:
    """What ``read`` makes of the file; None if there is none, or if read raises, for what is not to be believed: then it is
    set aside, with a note that says why. SceneError if it is no file, or cannot be set aside."""
    try:
        sweep_strays(path.resolve())
        if not os.path.lexists(path):
            return None
        if not path.is_file():
            raise SceneError(
                f"cannot keep what is done in {path}: it is no ordinary file; remove it, or choose another -o"
            )
        with _opened(path, "rb") as file:
            return read(file)
    except SceneError:
        raise
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError) as error:
        _set_aside(path, str(error) if type(error) is Unbelievable else f"it is damaged ({type(error).__name__})")
    return None


def _opened(path: Path, mode: str) -> BinaryIO:
    """An ordinary file; nobody waits for another end of a pipe."""
    if not path.is_file():
        raise OSError("it is no ordinary file")
    return path.open(mode)


class Unbelievable(ValueError):
    """Its text says what is wrong with a file that is kept."""


def _head(file: BinaryIO) -> dict:
    """What the first line says."""
    found = json.loads(file.readline(LARGEST))
    if found.pop("checksum") != _checksum(found):
        raise Unbelievable("it is damaged (checksum)")
    return found


def settled_in(file: BinaryIO, question: dict) -> str:
    """The back end of what a file keeps for this question; `Unbelievable` of another."""
    found = _head(file)
    if other := [key for key, value in question.items() if found["question"].get(key) != value]:
        raise Unbelievable(f"it is of another sweep ({', '.join(other)})")
    if found["settled"] not in ("", "numpy", "numba"):
        raise Unbelievable("its back end is unknown")
    return found["settled"]


def _believed(file: BinaryIO, question: dict, points: int, width: int) -> tuple[str, np.ndarray, int]:
    settled = settled_in(file, question)
    rows, end = np.empty((points, width)), file.tell()
    done = 0
    for found in blocks(file, width):
        if done + len(found) > points:
            raise Unbelievable("its rows are not those of this sweep")
        rows[done : done + len(found)] = found
        done, end = done + len(found), file.tell()
    if not np.isfinite(rows[:done]).all():
        raise Unbelievable("its rows are not those of this sweep")
    return settled, rows[:done], end


def blocks(file: BinaryIO, width: int) -> Iterator[np.ndarray]:
    """The rows (N, width) of each whole block, behind which the file then stands."""
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
            raise Unbelievable("it is damaged (checksum)")
        yield np.frombuffer(raw, "<f8").reshape(count, width)


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
