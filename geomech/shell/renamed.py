"""Commands and options that were renamed in version 0.1.

The old spellings work until the next version, with a note.
"""

from __future__ import annotations

from rft.core.notes import warn

COMMANDS = {
    "fit": "fit-gait",
    "calibrate": "fit-medium",
    "keys": "reference",
    "animate": "trajectory",
}
OPTIONS = {
    "--for": "--objective",
    "--within": "--limits",
    "--beside": "--compare-frame",
    "--methods": "--tiers",
    "--cost": "--effort",
}


def current(words: list[str]) -> list[str]:
    """Return a command's name and its arguments in the current spelling; `Note` for
    each old one."""
    name, *arguments = words
    last = len(arguments)
    if "--" in arguments:  # what follows are no options
        last = arguments.index("--")
    options = [current_word(word, OPTIONS) for word in arguments[:last]]
    return [current_word(name, COMMANDS), *options, *arguments[last:]]


def current_word(word: str, renamed: dict[str, str]) -> str:
    """Return a command, or an option such as --for or --for=speed, in the current
    spelling."""
    old, equals, value = word.partition("=")
    if old not in renamed:
        return word
    warn(
        f"{old} is now {renamed[old]}: the old spelling will be removed in the "
        "next version"
    )
    return f"{renamed[old]}{equals}{value}"
