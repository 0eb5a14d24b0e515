"""How a refusal is said: in one line that names the place, the value and the cure. The
facts stay with the error.

Nothing here needs NumPy, so that a command that refuses starts fast.
"""

from __future__ import annotations

import contextlib
import re
import unicodedata
from collections.abc import Callable, Iterator
from typing import Any

ARGUMENT = re.compile("``([^`]+)``")  # in the words of a refusal


def worded(words: str, spelled: Callable[[str], str] = str) -> str:
    """Return words with each argument that they name in double backticks as ``spelled``
    returns it, by default bare."""
    return ARGUMENT.sub(lambda match: spelled(match[1]), words)


class Refusal(ValueError):
    """A request, scene, file or argument that makes no sense.

    what: says what is wrong. value: what was given, where that tells more. where: the
    way there, outermost first (file or scene, table, key, argument). because: why it
    cannot be. instead: what to give or to do. The name of an argument stands in double
    backticks: Python shows it bare, and a command as its option (`said`).

    Examples
    --------
    >>> from rft import Viscous
    >>> try:
    ...     Viscous(-1.0)
    ... except ValueError as refusal:
    ...     print(refusal)
    ...
    ratio must be a number from 1e-08 to 1e+08, got -1.0
    """

    def __init__(
        self,
        what: str,
        *,
        value: Any = ...,
        where: Any = (),
        because: str = "",
        instead: str = "",
    ):
        super().__init__(what)
        self.what = what
        self.value = value
        self.because = because
        self.instead = instead
        self.where = tuple(map(str, where if isinstance(where, tuple) else (where,)))

    def __str__(self) -> str:
        return self.said(str)

    def said(self, spelled: Callable[[str], str]) -> str:
        """Return the refusal as a line. spelled: returns what a reader types for the
        name of an argument."""
        named = lambda words: worded(words, spelled)
        text = (
            named(self.what)
            if self.value is ...
            else f"{named(self.what)}, got {formatted(self.value)}"
        )
        if reasons := "; ".join(named(x) for x in (self.because, self.instead) if x):
            text = f"{text}: {reasons}"
        for place in map(named, reversed(self.where)):
            text = before(place) + text
        return line(text)

    def within(self, place: object) -> Refusal:
        """Return the refusal with a place before its own, unless it names that
        already."""
        names = (str(place), line(worded(str(place))))
        if not str(self).startswith(tuple(map(before, names))):
            self.where = (str(place), *self.where)
        return self


def before(place: str) -> str:
    """Return a place as it stands before what is wrong there."""
    return f"{place} " if place.endswith("]") else f"{place}: "


@contextlib.contextmanager
def located(place: object) -> Iterator[None]:
    """Name the place in whatever ValueError comes from the statements within."""
    try:
        yield
    except Refusal as refusal:
        raise refusal.within(place) from None
    except ValueError as error:
        raise Refusal(str(error)).within(place) from None


def require(condition: bool, what: str, **facts: Any) -> None:
    """Raise ``Refusal(what, **facts)`` unless the condition holds."""
    if not condition:
        raise Refusal(what, **facts)


def formatted(value: object, most: int = 60) -> str:
    """Return repr(value) as one line of at most ``most`` characters."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer of more digits than Python prints
        text = "a very long number"
    return text if len(text) <= most else text[: most - 3] + "..."


def printable(text: str) -> str:
    """Return text, which may hold what others wrote, as it may be shown: what steers a
    terminal, or is not seen, stands as its escape. Lines, tabs and blanks stay. All
    that goes to a terminal or into HTML passes here."""
    return re.sub(r"[^ -~\n\t]", _escaped, text)


def in_line(name: object) -> str:
    """Return the name of a file, or another that others chose, as it may stand within a
    line: `printable`, and lines and tabs in it as escapes.

    Examples
    --------
    >>> from rft.core.refusal import in_line
    >>> in_line("a\\nb.toml")
    'a\\\\nb.toml'
    """
    return re.sub(r"[\n\t]", lambda match: repr(match[0])[1:-1], printable(str(name)))


def _escaped(match: re.Match[str]) -> str:
    letter = match[0]
    is_shown = letter.isprintable() or unicodedata.category(letter) == "Zs"
    return letter if is_shown else letter.encode("unicode_escape").decode()


def line(text: str, most: int = 400) -> str:
    """Return `printable` text as one line of at most ``most`` characters, cut before
    its end."""
    text = printable(" ".join(text.split()))
    return text if len(text) <= most else text[: most - 100] + " ... " + text[-80:]
