"""The rows of an unfinished sweep, in a file of its question's own that is believed only if it is whole, and the lock that
keeps two sweeps from one output."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
from pathlib import Path

from geomech.errors import SceneError
from geomech.files import hidden, locked, note, read, sweep_strays, whole_file, why

LARGEST = 1_000_000_000  # bytes: ten times what a million rows take
VERSIONS = {"geomech", "solver"}  # of a question: what another one left cannot be taken up any more
WIDTH = 5  # numbers in a row: x, y, theta and the errors of position and heading


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
        found = json.loads(read(path, LARGEST))
        whole = found.pop("checksum") == _checksum(found)
        return whole and any(found["question"][key] != question[key] for key in {*question} - VERSIONS)
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


def keep(path: Path, question: dict, rows: list) -> None:
    """Write the rows there are, beside the question they answer (JSON); the file appears whole or not at all."""
    body = {"question": question, "rows": rows}
    with whole_file(path) as part:
        part.write_text(json.dumps({**body, "checksum": _checksum(body)}), encoding="utf-8")


def taken_up(path: Path | None, question: dict, points: int) -> list:
    """The rows kept, of at most ``points``, for the same question; else none, and what is there is set aside, with a
    note that says why. SceneError if it is no file, or cannot be set aside."""
    if path is None:
        return []
    try:
        sweep_strays(path.resolve())
        if not os.path.lexists(path):
            return []
        if not path.is_file():
            raise SceneError(
                f"cannot keep what is done in {path}: it is no ordinary file; remove it, or choose another -o"
            )
        return _believed(read(path, LARGEST), json.loads(json.dumps(question)), points)
    except SceneError:
        raise
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError) as error:
        _set_aside(path, str(error) if type(error) is _Unbelievable else f"it is damaged ({type(error).__name__})")
    return []


class _Unbelievable(ValueError):
    """Its text says what is wrong with a file that is kept."""


def _believed(raw: bytes, question: dict, points: int) -> list:
    found = json.loads(raw)
    if found.pop("checksum") != _checksum(found):
        raise _Unbelievable("it is damaged (checksum)")
    if other := [key for key, value in question.items() if found["question"].get(key) != value]:
        raise _Unbelievable(f"it is of another sweep ({', '.join(other)})")
    rows = found["rows"]
    if not (isinstance(rows, list) and len(rows) <= points and all(map(_is_row, rows))):
        raise _Unbelievable("its rows are not those of this sweep")
    return rows


def _is_row(row) -> bool:
    return isinstance(row, list) and len(row) == WIDTH and all(type(x) is float and math.isfinite(x) for x in row)


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
