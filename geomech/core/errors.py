"""How the project says what is wrong: one line that names the place and the cure."""

from __future__ import annotations

import contextlib
import difflib
import math
import numbers
import re
import unicodedata
import warnings
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np


def plain(text: str) -> str:
    """Return text, which may hold what others wrote, as it may be shown: what steers a terminal, or is not seen, stands as its
    escape. Lines, tabs and blanks stay. All that goes to a terminal or into HTML passes here."""
    return re.sub(r"[^ -~\n\t]", _seen, text)


def _seen(found: re.Match) -> str:
    letter = found[0]
    shown = letter.isprintable() or unicodedata.category(letter) == "Zs"
    return letter if shown else letter.encode("unicode_escape").decode()


def line(text: str, most: int = 400) -> str:
    """Return `plain` text as one line of at most ``most`` characters, cut before its end."""
    text = plain(" ".join(text.split()))
    return text if len(text) <= most else text[: most - 100] + " ... " + text[-80:]


class SceneError(ValueError):
    """A scene, option or file that makes no sense; its text is one line of readable length."""

    def __init__(self, text: str):
        super().__init__(line(text))


class Note(UserWarning):
    """Something that is done as asked and is likely not meant; on the command line a line on standard error."""


class UnitWarning(Note):
    """A number that would make more sense in another unit."""


class VelocityWarning(Note):
    """A velocity that lacks what a local connection rests on."""


FULL_TURN = 2 * math.pi * (1 + 1e-9)


def check_angle(what: str, largest: float) -> None:
    """UnitWarning if an angle in rad is beyond a full turn."""
    if largest > FULL_TURN:
        warnings.warn(
            f"{what} of {largest:.4g} rad is beyond a full turn, 2 pi: if that is in degrees, give {largest:.4g}deg on "
            f"the command line, a key that ends in _deg in a scene, or {math.radians(largest):.4g} rad",
            UnitWarning,
            stacklevel=3,
        )


@contextlib.contextmanager
def named(place: str) -> Iterator[None]:
    """Say of what is wrong that it is so in this scene, unless it says so itself."""
    try:
        yield
    except ValueError as error:
        if str(error).startswith((f"{place}: ", f"{line(str(place))}: ")):
            raise
        raise SceneError(f"{place}: {error}") from None


def choose(place: str, word: object, known: Iterable[str]) -> str:
    """word if it is one of the known, else SceneError with the nearest."""
    known = list(known)
    if isinstance(word, str) and word in known:
        return word
    near = difflib.get_close_matches(str(word), known, 1, 0.5)
    hint = f"did you mean {near[0]!r}?" if near else f"use one of {', '.join(known)}"
    raise SceneError(f"{place}: {short(word)} is unknown; {hint}")


def number(name: str, value: object, low: float, high: float, whole: bool = False) -> None:
    """ValueError naming it unless value is a number, or a whole one, from low to high; True and False are none."""
    plain = value.item() if hasattr(value, "item") and is_number(value) else value  # of 32 bits low may be out of reach
    if not ((is_whole if whole else is_number)(value) and low <= plain <= high):
        raise ValueError(f"{name} must be a {'whole ' * whole}number from {low:g} to {high:g}, got {short(value)}")


def is_number(value: object) -> bool:
    """Whether value is one real number; True and False are none."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def is_whole(value: object) -> bool:
    """Whether value is a whole number, as an int or a float."""
    return is_number(value) and (isinstance(value, numbers.Integral) or (math.isfinite(value) and value == int(value)))


def real_array(name: str, values) -> np.ndarray:
    """values as a NumPy array of floats, or ValueError naming it."""
    import numpy as np  # the command starts without it

    try:
        array = np.asarray(values)
        if array.dtype.kind in "iuf":
            return array.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"{name} must be numbers in equal rows, got {short(values)}")


def short(value: object, most: int = 60) -> str:
    """repr(value) as one line of at most ``most`` characters."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer of more digits than Python prints
        text = "a very long number"
    return text if len(text) <= most else text[: most - 3] + "..."
