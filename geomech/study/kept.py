"""The rows of an unfinished sweep, in a file that is believed only if it is whole and answers the same question."""

from __future__ import annotations

import hashlib
import json
import math
import os
from pathlib import Path

from geomech.errors import SceneError
from geomech.files import hidden, note, read, sweep_strays, whole_file, why

LARGEST = 1_000_000_000  # bytes: ten times what a million rows take
WIDTH = 5  # numbers in a row: x, y, theta and the errors of position and heading


def beside(output: Path) -> Path:
    """The file that keeps what is done of a sweep to ``output``."""
    return hidden(output.resolve() if ".." in output.parts else output, ".partial")


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
