"""Results in an sqlite file, which one command at a time has open; nothing that is read from it is executed."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import sqlite3
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from geomech.io.files import hidden, note
from rft.core.refusal import Refusal

CHECKPOINT = 2.0  # s between writes; a request that takes less writes nothing
LARGEST = 6_000_000_000  # bytes of results in a file, as of the largest sweep; further ones are not stored
OURS = 0x67656F6D  # application_id of our files
DAMAGED = (
    sqlite3.SQLITE_CORRUPT,
    sqlite3.SQLITE_NOTADB,
    sqlite3.SQLITE_ERROR,
)  # the last where tables are not ours
ARRAY = 1  # code of arrays in a value
KINDS = "fiubcU"  # of dtypes of arrays
DTYPE = re.compile(f"[<>|][{KINDS}][0-9]{{1,9}}")  # as arrays are stored
UNREADABLE = (ValueError, TypeError, OverflowError, RecursionError, MemoryError)
T = TypeVar("T")


class Busy(Refusal):
    """Another command has the file open."""


class Foreign(sqlite3.DatabaseError):
    """A file of another program."""


class Damaged(sqlite3.DatabaseError):
    """A file of ours with a value that we do not write."""


def encoded(value: Any) -> bytes:
    """Return a result as bytes; TypeError unless it consists of numbers, text, arrays and containers of these."""
    return msgspec.msgpack.encode(value, enc_hook=_as_plain)


def _as_plain(x: Any) -> Any:
    if isinstance(x, np.ndarray) and x.dtype.kind in KINDS:
        parts = x.dtype.str, x.shape, np.ascontiguousarray(x).tobytes()
        return msgspec.msgpack.Ext(ARRAY, msgspec.msgpack.encode(parts))
    if isinstance(x, np.generic):
        return x.item()
    raise TypeError(
        f"a result of a task must be numbers, arrays and containers of these, got {type(x).__name__}"
    )


def decoded(raw: bytes, kind: Any) -> Any:
    """Return the result of the type ``kind`` from bytes; ValueError or TypeError if they encode none."""
    return msgspec.msgpack.decode(raw, type=kind, dec_hook=_checked, ext_hook=_array)


def _checked(kind: type, x: Any) -> Any:
    if not isinstance(x, kind):
        raise TypeError(f"{kind.__name__} was stored, and is {type(x).__name__}")
    return x


def _array(code: int, raw: memoryview) -> np.ndarray:
    dtype, shape, values = msgspec.msgpack.decode(
        raw, type=tuple[str, list[int], bytes]
    )
    if code != ARRAY or not DTYPE.fullmatch(dtype):
        raise Refusal("it is no array")
    return np.frombuffer(values, dtype).reshape(shape).copy()


class Store:
    """Results under keys of 32 bytes, written to ``path`` every now and then; without a path, nothing.

    The file is locked from the first write on, and where another command has it nothing is stored; with ``hold`` it is
    locked at once, or `Busy` raised. A damaged or foreign one is renamed, with a note. A full disk, or a file system
    without locks, is said in a line, and from then on nothing is stored. mark: a number that a new file bears; of an old
    one, its own. written: results in the file. lost: nothing is stored."""

    def __init__(self, path: Path | None = None, hold: bool = False, mark: int = 0):
        self.path, self.hold, self.mark, self.db, self.new = path, hold, mark, None, {}
        self.size = self.written = 0
        self.lost = path is None
        self.readable: set[str] = set()  # types of which a result has been read back
        self.due = time.monotonic() + CHECKPOINT
        if path is not None and (hold or os.path.lexists(path)):
            self._open()

    def get(self, key: bytes, kind: type[T]) -> tuple[T] | None:
        """Return (result,), or None where none is stored that its checksum confirms."""
        row = self.new.get(key) or (self._try(self._row, key) if self.written else None)
        if not row or _checksum(key, row[0]) != row[1]:
            return None
        try:
            return (decoded(row[0], kind),)
        except UNREADABLE:  # msgspec's errors among them
            return None

    def put(self, key: bytes, value: Any, kind: Any) -> None:
        """Store a result, unless it cannot be encoded. TypeError where it is not of the declared type, as which it is
        read back."""
        if self.lost or self.size > LARGEST:
            return
        try:
            raw = encoded(value)
        except TypeError:
            return
        if repr(kind) not in self.readable:
            try:
                decoded(raw, kind)
            except (ValueError, TypeError) as error:
                raise TypeError(
                    f"a task declares {kind} and returns something else: {error}"
                ) from None
            self.readable.add(repr(kind))
        self.new[key] = raw, _checksum(key, raw)
        self.size += len(raw)
        if time.monotonic() > self.due:
            self.commit()

    def commit(self) -> None:
        """Write what is new."""
        if self.new and self.db is None and not self.lost:
            self._open()
        if self.new and self.db is not None:
            self._try(self._write)
        self.due = time.monotonic() + CHECKPOINT

    def close(self, done: bool) -> None:
        """Write what is new, or, once a request is ``done``, remove the file; a file without results goes, too."""
        if not done:
            self.commit()
        if self.db is not None:
            empty = done or not self.written
            for step in (
                (self._unlink,) * empty + (self._disconnect,) + (self._unlink,) * empty
            ):
                step()  # an open file goes under its lock, but on Windows, where it must be closed first

    def _row(self, key: bytes) -> tuple | None:
        row = self.db.execute(
            "SELECT value, checksum FROM result WHERE key = ?", (key,)
        ).fetchone()
        if row and not all(isinstance(x, bytes) for x in row):
            raise Damaged
        return row

    def _write(self) -> None:
        if not self.db.in_transaction:
            self.db.execute("BEGIN EXCLUSIVE")
        if not self.written:
            self.db.execute(f"PRAGMA application_id = {OURS}")
            self.db.execute(f"PRAGMA user_version = {self.mark}")
            self.db.execute(
                "CREATE TABLE IF NOT EXISTS result (key BLOB PRIMARY KEY, value BLOB, checksum BLOB)"
            )
        rows = [(key, *row) for key, row in self.new.items()]
        self.db.executemany("INSERT OR REPLACE INTO result VALUES (?, ?, ?)", rows)
        self.db.execute("COMMIT")
        self.written, self.new = self.written + len(rows), {}

    def _open(self) -> None:
        if os.path.lexists(self.path) and not self.path.is_file():
            raise Refusal(
                f"cannot keep what is done in {self.path}",
                because="it is no ordinary file",
                instead="remove it, or choose another output",
            )
        self._try(self._connect)
        while (
            self.db is not None and not self.path.exists()
        ):  # its owner has removed it a moment ago
            self._disconnect()
            self._try(self._connect)

    def _connect(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.db = sqlite3.connect(
            self.path, isolation_level=None, timeout=0, check_same_thread=False
        )
        self.db.execute("PRAGMA locking_mode = EXCLUSIVE")
        self.db.execute("BEGIN EXCLUSIVE")
        if self.db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
            if self.db.execute("PRAGMA application_id").fetchone()[0] != OURS:
                raise Foreign("it is of another program")
            (mark,) = self.db.execute("PRAGMA user_version").fetchone()
            if mark < 0:
                raise Damaged
            self.mark = mark
            (self.written,) = self.db.execute("SELECT count(*) FROM result").fetchone()
            self.size = self.path.stat().st_size

    def _disconnect(self) -> None:
        if self.db is not None:
            with contextlib.suppress(sqlite3.Error):
                self.db.close()
        self.db, self.written = None, 0

    def _unlink(self) -> None:
        for ending in ("", "-journal"):
            with contextlib.suppress(OSError):
                self.path.with_name(self.path.name + ending).unlink()

    def _try(self, act: Callable[..., T], *arguments) -> T | None:
        """Return act(...); None after an error of the file, which is then replaced or given up."""
        try:
            return act(*arguments)
        except (
            sqlite3.Error,
            OSError,
            UnicodeError,
        ) as error:  # UnicodeError: of names in a damaged file
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF
            if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
                self._disconnect()
                self.lost, self.new = True, {}
                if self.hold:
                    raise Busy(
                        f"another computation has {self.path} open",
                        instead="wait for it, stop it, or name another",
                    ) from None
            elif (
                isinstance(error, Foreign | Damaged | UnicodeError)
                or code in DAMAGED
                # the header of a damaged file can forbid to write what may be written
                or (code == sqlite3.SQLITE_READONLY and os.access(self.path, os.W_OK))
            ):
                self._disconnect()
                self._begin_anew(
                    str(error) if isinstance(error, Foreign) else "it is damaged"
                )
            else:
                if act == self._connect:
                    self._disconnect()
                self._lose(error)
            return None

    def _begin_anew(self, reason: str) -> None:
        """Rename the file to the first name that is free, and begin another."""
        names = (
            self.path.with_name(f"{self.path.name}.unreadable{k}")
            for k in ("", *(f"-{k}" for k in range(2, 999)))
        )
        try:
            other = next(name for name in names if not os.path.lexists(name))
            self.path.rename(other)
            self._unlink()  # the journal of the renamed file
        except (OSError, StopIteration) as error:
            self._lose(error)
            return
        note(f"{self.path} cannot be resumed, {reason}: renamed to {other.name}")
        self._open()

    def _lose(self, error: Exception) -> None:
        note(f"what is done is not kept in {self.path}: {error}")
        self.lost, self.new = True, {}
        if self.db is not None:
            with contextlib.suppress(sqlite3.Error):
                self.db.execute(
                    "ROLLBACK"
                )  # earlier results stay, and so does the lock


def partial_file(output: Path) -> Path:
    """Return the file that stores unfinished results of an output, a file or a folder: ``.NAME.partial`` beside or in
    it."""
    if output.is_dir():
        place = output / (output.resolve().name or "geomech")
    elif (
        ".." in output.parts or output.is_symlink()
    ):  # one file for all names of an output
        place = Path(os.path.realpath(output))
    else:
        place = output
    folder = next((p for p in place.parents if p.is_dir()), place.parent)
    return hidden(folder / "-".join(place.relative_to(folder).parts), ".partial")


def cache_folder() -> Path | None:
    """Return geomech's folder in the user's cache folder; None where there is none."""
    named = {"win32": os.environ.get("LOCALAPPDATA"), "darwin": "~/Library/Caches"}
    folder = Path(
        os.environ.get("XDG_CACHE_HOME") or named.get(sys.platform) or "~/.cache"
    )
    try:
        folder = folder.expanduser()
    except RuntimeError:  # there is no home
        return None
    return folder / "geomech" if folder.is_absolute() else None


def in_cache(question: bytes) -> Path | None:
    """Return the file in the user's cache folder that stores unfinished results of a command without output; None
    without a folder."""
    folder = cache_folder()
    return folder and folder / f"{question.hex()[:16]}.partial"


def _checksum(key: bytes, raw: bytes) -> bytes:
    return hashlib.blake2b(key + raw, digest_size=8).digest()
