"""How the project says what is wrong: one line that names the place and the cure."""

from __future__ import annotations

import contextlib
import difflib
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path


class SceneError(ValueError):
    """A scene, option or file that makes no sense; its text is one line."""


def choose(place: str, word: object, known: Iterable[str]) -> str:
    """word if it is one of the known, else SceneError with the nearest."""
    known = list(known)
    if isinstance(word, str) and word in known:
        return word
    near = difflib.get_close_matches(str(word), known, 1, 0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"use one of {', '.join(known)}"
    raise SceneError(f"{place}: {_short(word)} is unknown; {hint}")


def _short(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


@contextlib.contextmanager
def whole_file(path: str | Path):
    """A path to write to, with the same ending; moved to ``path`` on success, removed on failure. SceneError if
    nothing can be written there."""
    path = Path(path)
    try:
        if path.is_dir():
            raise IsADirectoryError("it is a folder")
        handle, part = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise SceneError(f"cannot write {path}: {error.strerror or error}; choose another output") from None
    try:
        yield Path(part)
        os.chmod(part, 0o666 & ~_umask())
        os.replace(part, path)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(part)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
