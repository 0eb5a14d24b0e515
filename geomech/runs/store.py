"""Results in an sqlite file, which one command at a time has open. Nothing that is read
from it is executed."""

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
# Bytes of results in a file, as of the largest sweep; further results are not stored.
LARGEST = 6_000_000_000
APPLICATION_ID = 0x67656F6D  # of the files that this module writes
# The last one where tables are not those that this module writes.
DAMAGE_CODES = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)
BUSY_CODES = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
ARRAY_CODE = 1  # of arrays in a value
ARRAY_KINDS = "fiubcU"  # of dtypes
STORED_DTYPE = re.compile(f"[<>|][{ARRAY_KINDS}][0-9]{{1,9}}")
UNREADABLE = (ValueError, TypeError, OverflowError, RecursionError, MemoryError)
T = TypeVar("T")


class Busy(Refusal):
    """Another command has the file open."""


class ForeignFile(sqlite3.DatabaseError):
    """A file of another program."""


class Damaged(sqlite3.DatabaseError):
    """A file of this module with a value that it does not write."""


def encode(value: Any) -> bytes:
    """Return a result as bytes; TypeError unless it consists of numbers, text, arrays
    and containers of these."""
    return msgspec.msgpack.encode(value, enc_hook=_encode_array)


def _encode_array(x: Any) -> Any:
    if isinstance(x, np.ndarray) and x.dtype.kind in ARRAY_KINDS:
        data = (x.dtype.str, x.shape, np.ascontiguousarray(x).tobytes())
        return msgspec.msgpack.Ext(ARRAY_CODE, msgspec.msgpack.encode(data))
    if isinstance(x, np.generic):
        return x.item()
    raise TypeError(
        "a result of a task must be numbers, arrays and containers of these, got "
        f"{type(x).__name__}"
    )


def decode(raw: bytes, kind: Any) -> Any:
    """Return the result of the type ``kind`` from bytes; ValueError or TypeError if
    they encode none."""
    return msgspec.msgpack.decode(
        raw, type=kind, dec_hook=_check_type, ext_hook=_decode_array
    )


def _check_type(kind: type, x: Any) -> Any:
    if not isinstance(x, kind):
        raise TypeError(f"{kind.__name__} was stored, and is {type(x).__name__}")
    return x


def _decode_array(code: int, raw: memoryview) -> np.ndarray:
    dtype, shape, values = msgspec.msgpack.decode(
        raw, type=tuple[str, list[int], bytes]
    )
    if code != ARRAY_CODE or not STORED_DTYPE.fullmatch(dtype):
        raise Refusal("it is no array")
    return np.frombuffer(values, dtype).reshape(shape).copy()


class Store:
    """Results under keys of 32 bytes, written to ``path`` every `CHECKPOINT` seconds;
    without a path nothing is stored.

    The file is locked from the first write on, and nothing is stored where another
    command has it. With ``hold`` it is locked at once, or `Busy` is raised. A damaged
    or foreign file is renamed, with a note. A full disk, or a file system without
    locks, is said in a line, and from then on nothing is stored.

    mark: a number that a new file gets; an old one keeps its own. written: number of
    results in the file. lost: whether nothing is stored."""

    def __init__(self, path: Path | None = None, hold: bool = False, mark: int = 0):
        self.path = path
        self.hold = hold
        self.mark = mark
        self.db = None
        self.new: dict[bytes, tuple[bytes, bytes]] = {}  # (value, checksum) by key
        self.size = 0
        self.written = 0
        self.lost = path is None
        self.readable: set[str] = set()  # types of which a result has been read back
        self.due = time.monotonic() + CHECKPOINT
        if path is not None and (hold or os.path.lexists(path)):
            self._open()

    def get(self, key: bytes, kind: type[T]) -> tuple[T] | None:
        """Return (result,), or None where none is stored that its checksum confirms."""
        row = self.new.get(key)
        if not row and self.written:
            row = self._try(self._row, key)
        if not row:
            return None
        raw, checksum = row
        if _checksum(key, raw) != checksum:
            return None
        try:
            return (decode(raw, kind),)
        except UNREADABLE:  # msgspec's errors among them
            return None

    def put(self, key: bytes, value: Any, kind: Any) -> None:
        """Store a result, unless it cannot be encoded. TypeError where it is not of the
        declared type, as which it is read back."""
        if self.lost or self.size > LARGEST:
            return
        try:
            raw = encode(value)
        except TypeError:
            return
        if repr(kind) not in self.readable:
            try:
                decode(raw, kind)
            except (ValueError, TypeError) as error:
                raise TypeError(
                    f"a task declares {kind} but returns a different type: {error}"
                ) from None
            self.readable.add(repr(kind))
        self.new[key] = (raw, _checksum(key, raw))
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
        """Write what is new, or, once a request is ``done``, remove the file. A file
        without results is also removed."""
        if not done:
            self.commit()
        if self.db is None:
            return
        is_removed = done or not self.written
        if is_removed:
            self._unlink()  # while it is locked
        self._disconnect()
        if is_removed:
            self._unlink()  # on Windows only a closed file can be removed

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
            self.db.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            self.db.execute(f"PRAGMA user_version = {self.mark}")
            self.db.execute(
                "CREATE TABLE IF NOT EXISTS result "
                "(key BLOB PRIMARY KEY, value BLOB, checksum BLOB)"
            )
        rows = [(key, *row) for key, row in self.new.items()]
        self.db.executemany("INSERT OR REPLACE INTO result VALUES (?, ?, ?)", rows)
        self.db.execute("COMMIT")
        self.written += len(rows)
        self.new = {}

    def _open(self) -> None:
        if os.path.lexists(self.path) and not self.path.is_file():
            raise Refusal(
                f"cannot store results in {self.path}",
                because="it is not an ordinary file",
                instead="remove it, or choose another output",
            )
        self._try(self._connect)
        # Where the file is gone, its owner has removed it a moment ago.
        while self.db is not None and not self.path.exists():
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
            (application_id,) = self.db.execute("PRAGMA application_id").fetchone()
            if application_id != APPLICATION_ID:
                raise ForeignFile("it was written by another program")
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
        self.db = None
        self.written = 0

    def _unlink(self) -> None:
        for ending in ("", "-journal"):
            with contextlib.suppress(OSError):
                self.path.with_name(self.path.name + ending).unlink()

    def _try(self, act: Callable[..., T], *arguments) -> T | None:
        """Return act(...); None after an error of the file, which is then replaced or
        given up."""
        try:
            return act(*arguments)
        # UnicodeError: of names in a damaged file.
        except (sqlite3.Error, OSError, UnicodeError) as error:
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF
            if code in BUSY_CODES:
                self._disconnect()
                self._stop_storing()
                if self.hold:
                    raise Busy(
                        f"another computation has {self.path} open",
                        instead="wait for it, stop it, or use another file",
                    ) from None
            elif isinstance(error, ForeignFile):
                self._disconnect()
                self._begin_anew(str(error))
            elif self._is_damage(error, code):
                self._disconnect()
                self._begin_anew("it is damaged")
            else:
                if act == self._connect:
                    self._disconnect()
                self._give_up(error)
            return None

    def _is_damage(self, error: Exception, code: int) -> bool:
        if isinstance(error, Damaged | UnicodeError) or code in DAMAGE_CODES:
            return True
        # The header of a damaged file can forbid to write what may be written.
        return code == sqlite3.SQLITE_READONLY and os.access(self.path, os.W_OK)

    def _begin_anew(self, reason: str) -> None:
        """Rename the file to the first name that is free, and begin another."""
        other = self.path.with_name(f"{self.path.name}.unreadable")
        k = 1
        while os.path.lexists(other):
            k += 1
            other = self.path.with_name(f"{self.path.name}.unreadable-{k}")
        try:
            self.path.rename(other)
            self._unlink()  # the journal of the renamed file
        except OSError as error:
            self._give_up(error)
            return
        note(f"{self.path} cannot be resumed, {reason}: renamed to {other.name}")
        self._open()

    def _give_up(self, error: Exception) -> None:
        """Note that nothing more is stored; earlier results stay, and so does the
        lock."""
        note(f"results are not stored in {self.path}: {error}")
        self._stop_storing()
        if self.db is not None:
            with contextlib.suppress(sqlite3.Error):
                self.db.execute("ROLLBACK")

    def _stop_storing(self) -> None:
        self.lost = True
        self.new = {}


def partial_file(output: Path) -> Path:
    """Return the file that stores unfinished results of an output: ``.NAME.partial``
    beside a file, or in a folder."""
    if output.is_dir():
        place = output / (output.resolve().name or "geomech")
    elif ".." in output.parts or output.is_symlink():
        place = Path(os.path.realpath(output))  # one file for all names of an output
    else:
        place = output
    existing = [parent for parent in place.parents if parent.is_dir()]
    folder = existing[0] if existing else place.parent
    name = "-".join(place.relative_to(folder).parts)
    return hidden(folder / name, ".partial")


def cache_folder() -> Path | None:
    """Return geomech's folder in the user's cache folder; None where there is none."""
    of_system = {"win32": os.environ.get("LOCALAPPDATA"), "darwin": "~/Library/Caches"}
    chosen = os.environ.get("XDG_CACHE_HOME") or of_system.get(sys.platform)
    folder = Path(chosen or "~/.cache")
    try:
        folder = folder.expanduser()
    except RuntimeError:  # there is no home
        return None
    if not folder.is_absolute():
        return None
    return folder / "geomech"


def cache_file(question: bytes) -> Path | None:
    """Return the file in the user's cache folder that stores unfinished results of a
    command without output; None without a folder.

    question: digest of the question."""
    folder = cache_folder()
    if folder is None:
        return None
    return folder / f"{question.hex()[:16]}.partial"


def _checksum(key: bytes, raw: bytes) -> bytes:
    return hashlib.blake2b(key + raw, digest_size=8).digest()
