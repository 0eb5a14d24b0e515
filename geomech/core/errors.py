"""Warnings, and the choice of one word among several."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from pathlib import Path

from rft.core.notes import Note, warn
from rft.core.refusal import Refusal, formatted, in_line


class UnitWarning(Note):
    """A number that would make more sense in another unit."""


class VelocityWarning(Note):
    """A velocity lacks a premise of a local connection."""


FULL_TURN = 2 * math.pi * (1 + 1e-9)


def check_angle(name: str, largest: float) -> None:
    """Warn (`UnitWarning`) if an angle in rad is beyond a full turn."""
    if largest > FULL_TURN:
        warn(
            f"{name} of {largest:.4g} rad is more than a full turn, 2 pi: if the "
            f"value is in degrees, write {largest:.4g}deg on the command line, use a "
            "key that ends in _deg in a scene, or convert it to "
            f"{math.radians(largest):.4g} rad",
            UnitWarning,
        )


def choose(place: str, word: object, choices: Iterable[str], ending: str = "") -> str:
    """Return word if it is one of the choices; Refusal, with the nearest choice, if
    not.

    ending: of a file that may be named instead, such as ".toml". Where a file differs
    from the word by its ending alone, the Refusal names the file."""
    choices = list(choices)
    if isinstance(word, str) and word in choices:
        return word
    instead = f"use one of {', '.join(choices)}"
    if ending:
        instead = f"{instead}, or a file"
    nearest = difflib.get_close_matches(str(word), choices, 1, 0.5)
    if nearest:
        instead = f"did you mean {nearest[0]!r}?"
    if ending and isinstance(word, str) and has_file(word + ending):
        instead = f"did you mean the file {in_line(word + ending)}?"
    raise Refusal(f"{formatted(word)} is unknown", where=place, instead=instead)


def has_file(name: str) -> bool:
    """Return whether there is a file of that name; False for a name that no file may
    have."""
    try:
        return Path(name).is_file()
    except (OSError, ValueError):  # too long, or with a zero byte
        return False
