"""How the project says what is wrong: one line that names the place and the cure."""

from __future__ import annotations

import contextlib
import difflib
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path


class SceneError(ValueError):
    """A scene, option or file that makes no sense; its text is one line of readable length."""

    def __init__(self, text: str):
        text = " ".join(text.split())
        super().__init__(text if len(text) <= 400 else text[:300] + " ... " + text[-80:])


def choose(place: str, word: object, known: Iterable[str]) -> str:
    """word if it is one of the known, else SceneError with the nearest."""
    known = list(known)
    if isinstance(word, str) and word in known:
        return word
    near = difflib.get_close_matches(str(word), known, 1, 0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"use one of {', '.join(known)}"
    raise SceneError(f"{place}: {_short(word)} is unknown; {hint}")


def _short(value: object) -> str:
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer of more digits than Python prints
        text = "a very long number"
    return text if len(text) <= 60 else text[:57] + "..."


@contextlib.contextmanager
def whole_file(path: str | Path):
    """A path to write to, with the same ending; moved to ``path`` on success, removed on failure. SceneError if
    nothing can be written there."""
    try:
        target = Path(path).resolve()
        if target.exists() and not target.is_file():
            raise OSError("it is no ordinary file")
        handle, part = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
        os.close(handle)
    except (OSError, RuntimeError, ValueError) as error:
        raise SceneError(
            f"cannot write {path}: {getattr(error, 'strerror', None) or error}; choose another output"
        ) from None
    try:
        yield Path(part)
        os.chmod(part, 0o666 & ~_umask())
        os.replace(part, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(part)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
