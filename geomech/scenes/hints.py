"""Hints for the reader of a refused scene file: the line, the value, and what to give in its place."""

from __future__ import annotations

import re
from collections.abc import Mapping

from geomech.scenes.key import angles_of, meanings
from rft.core.checks import is_number
from rft.core.refusal import formatted

EXPECTED = {
    "float": "a number", "int": "a whole number without a point", "str": 'text in "quotes"', "bool": "true or false",
    "array": "a list in [ ]", "object": "a table",
}  # fmt: skip
LONGEST = 1000  # letters of a line in which a cure is looked for
RULES = (
    (r"[“”„«»‘’]", 'put text in straight "quotes"'),
    (r"=\s*[-+]?\.\d", "a number has a digit before its point"),
    (r"=\s*[-+]?\d+,\d+\s*$", "a number has a point, no comma"),
    (
        r"=\s*[-+]?[\d.]+\s*(deg|°)",
        "a number has no unit: a key that ends in _deg takes degrees",
    ),
    (r"=\s*[-+]?[\d.]+\s*[A-Za-z]", "a number has no unit"),
    (r"=\s*[A-Za-z][^\"]*$", 'put text in "quotes"'),
    (r"=\s*$", "give the key a value"),
    (r"^[^\"=]*:", "write KEY = VALUE"),
    (r"\"[^\"]*$", "close the quotes"),
)


def line_hint(text: str, error: Exception) -> str:
    """Return the line of a TOML text that an error names, with its cure if that is plain; empty if it names none."""
    match = re.search(r"at line (\d+)", str(error))
    lines = text.split("\n")
    if not match or int(match[1]) > len(lines):
        return ""
    line = lines[int(match[1]) - 1][:LONGEST].partition("#")[0]
    cure = next((f", {cure}" for rule, cure in RULES if re.search(rule, line)), "")
    return f": {formatted(line.strip())}{cure}"


def value_hint(message: str, table: Mapping, kind: type) -> str:
    """Return what to give in place of a value that ``message`` refuses; empty if the message is enough. kind: the class
    of the keys."""
    if missing := re.search(r"missing required field `(\w+)`", message):
        unit, _ = meanings(kind).get(missing[1], ("-", ""))
        return f"add {missing[1]} = ..." + f", in {unit}" * (unit not in ("-", ""))
    if mismatch := re.search(
        r"Expected `(\w+)(?: \| null)?`.* at `\.(\w+)((?:\[\d+\])*)", message
    ):
        expected, key, places = mismatch.groups()
        value = table.get(key, table.get(f"{key}_deg"))
        for place in re.findall(r"\d+", places):
            value = (
                value[int(place)]
                if isinstance(value, list) and int(place) < len(value)
                else value
            )
        return f"give {EXPECTED.get(expected, expected)} in place of {formatted(value)}"
    key = message.partition(" must ")[0]
    if key == "frame":
        return "name one of these, or 'minimum-perturbation'"
    given = is_number(table.get(key)) and abs(table[key]) < float("inf")
    return (
        f"{key} is in rad, write {key}_deg for degrees"
        if given and key in angles_of(kind)
        else ""
    )
