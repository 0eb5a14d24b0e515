"""Refusals: errors of one line that name the place, the value and the cure, and keep
these facts.

Nothing here needs NumPy, so that a command that refuses starts fast.
"""

from __future__ import annotations

import contextlib
import re
import unicodedata
from collections.abc import Callable, Iterator
from typing import Any

ARGUMENT = re.compile("``([^`]+)``")  # in the words of a refusal


def spell_arguments(words: str, spelled: Callable[[str], str] = str) -> str:
    """Return words with each argument that they name in double backticks as ``spelled``
    returns it, by default bare."""
    return ARGUMENT.sub(lambda match: spelled(match[1]), words)


class Refusal(ValueError):
    """A request, scene, file or argument that makes no sense.

    what: what is wrong. value: what was given, where that says more. where: the place,
    outermost first (file or scene, section, key, argument). because: why it cannot be.
    instead: what to give or to do. The name of an argument stands in double backticks:
    Python shows it bare, and a command as its option (`as_line`).

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
        places = where if isinstance(where, tuple) else (where,)
        self.where = tuple(map(str, places))

    def __str__(self) -> str:
        return self.as_line(str)

    def as_line(self, spelled: Callable[[str], str]) -> str:
        """Return the refusal as a line. spelled: returns what a reader types for the
        name of an argument."""
        text = spell_arguments(self.what, spelled)
        if self.value is not ...:
            text = f"{text}, got {formatted(self.value)}"
        reasons = [
            spell_arguments(x, spelled) for x in (self.because, self.instead) if x
        ]
        if reasons:
            text = f"{text}: {'; '.join(reasons)}"
        for place in reversed(self.where):
            text = place_prefix(spell_arguments(place, spelled)) + text
        return line(text)

    def within(self, place: object) -> Refusal:
        """Return the refusal with a place before its own, unless it names that
        already."""
        names = (str(place), line(spell_arguments(str(place))))
        if not str(self).startswith(tuple(map(place_prefix, names))):
            self.where = (str(place), *self.where)
        return self


def place_prefix(place: str) -> str:
    """Return a place as it stands before what is wrong there."""
    if place.endswith("]"):
        return f"{place} "
    return f"{place}: "


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
    if len(text) <= most:
        return text
    return text[: most - 3] + "..."


def printable(text: str) -> str:
    """Return text from elsewhere as it may be shown: characters that control a terminal
    or are invisible become escapes; line ends, tabs and blanks stay. All text that goes
    to a terminal or into HTML passes here."""
    return re.sub(r"[^ -~\n\t]", _escaped, text)


def in_line(name: object) -> str:
    """Return a name from elsewhere, such as that of a file, as it may stand within a
    line: `printable`, with line ends and tabs as escapes.

    Examples
    --------
    >>> from rft.core.refusal import in_line
    >>> in_line("a\\nb.toml")
    'a\\\\nb.toml'
    """
    return re.sub(r"[\n\t]", lambda match: repr(match[0])[1:-1], printable(str(name)))


def _escaped(match: re.Match[str]) -> str:
    letter = match[0]
    if letter.isprintable() or unicodedata.category(letter) == "Zs":
        return letter
    return letter.encode("unicode_escape").decode()


def line(text: str, most: int = 400) -> str:
    """Return `printable` text as one line of at most ``most`` characters, cut before
    its end."""
    text = printable(" ".join(text.split()))
    if len(text) <= most:
        return text
    return text[: most - 100] + " ... " + text[-80:]
