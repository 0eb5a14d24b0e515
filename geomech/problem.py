"""How the project says what is wrong: one line that names the place and the cure."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


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
    raise SceneError(f"{place}: {short(word)} is unknown; {hint}")


def short(value: object) -> str:
    """repr(value) as one line of at most 60 characters."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer of more digits than Python prints
        text = "a very long number"
    return text if len(text) <= 60 else text[:57] + "..."
