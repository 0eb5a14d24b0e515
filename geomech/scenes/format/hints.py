"""Hints on a refused scene file: the line, the value, and what to give in its place."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from geomech.scenes.format.key import angles_of, meanings
from rft.core.checks import is_number
from rft.core.refusal import formatted

EXPECTED = {  # msgspec's names of types, in words
    "float": "a number",
    "int": "a whole number without a point",
    "str": 'text in "quotes"',
    "bool": "true or false",
    "array": "a list in [ ]",
    "object": "a table",
}
LONGEST = 1000  # letters of a line in which a cure is looked for
RULES = (  # patterns of lines that are not TOML, with their cures
    (r"[“”„«»‘’]", 'put text in straight "quotes"'),
    (r"=\s*[-+]?\.\d", "a number needs a digit before its decimal point"),
    (r"=\s*[-+]?\d+,\d+\s*$", "a number has a decimal point, not a comma"),
    (
        r"=\s*[-+]?[\d.]+\s*(deg|°)",
        "write numbers without a unit: a key that ends in _deg takes degrees",
    ),
    (r"=\s*[-+]?[\d.]+\s*[A-Za-z]", "write numbers without a unit"),
    (r"=\s*[A-Za-z][^\"]*$", 'put text in "quotes"'),
    (r"=\s*$", "give the key a value"),
    (r"^[^\"=]*:", "write KEY = VALUE"),
    (r"\"[^\"]*$", "close the quotes"),
)


def line_hint(text: str, error: Exception) -> str:
    """Return the line of a TOML text that an error names, with its cure if a rule tells
    it; "" if the error names none."""
    match = re.search(r"at line (\d+)", str(error))
    lines = text.split("\n")
    if not match or int(match[1]) > len(lines):
        return ""
    line = lines[int(match[1]) - 1][:LONGEST].partition("#")[0]
    hint = f": {formatted(line.strip())}"
    for rule, cure in RULES:
        if re.search(rule, line):
            return f"{hint}, {cure}"
    return hint


def value_hint(message: str, table: Mapping, kind: type) -> str:
    """Return what to give in place of a value that ``message`` refuses; "" if the
    message is enough. table: of the keys. kind: the class of the keys."""
    missing = re.search(r"missing required field `(\w+)`", message)
    if missing:
        return _missing_hint(missing[1], kind)
    mismatch = re.search(
        r"Expected `(\w+)(?: \| null)?`.* at `\.(\w+)((?:\[\d+\])*)", message
    )
    if mismatch:
        expected, key, indices = mismatch.groups()
        value = _value_at(table, key, indices)
        return f"give {EXPECTED.get(expected, expected)} instead of {formatted(value)}"
    key = message.partition(" must ")[0]
    if key == "frame":
        return "use one of these, or 'minimum-perturbation'"
    is_finite = is_number(table.get(key)) and abs(table[key]) < float("inf")
    if is_finite and key in angles_of(kind):
        return f"{key} is in rad; write {key}_deg for degrees"
    return ""


def _missing_hint(key: str, kind: type) -> str:
    unit, _ = meanings(kind).get(key, ("-", ""))
    if unit in ("-", ""):
        return f"add {key} = ..."
    return f"add {key} = ..., in {unit}"


def _value_at(table: Mapping, key: str, indices: str) -> Any:
    """Return the value of a key, which may be in degrees, or an element of it. indices:
    of the element, such as "[0][2]"."""
    value = table.get(key, table.get(f"{key}_deg"))
    for text in re.findall(r"\d+", indices):
        index = int(text)
        if isinstance(value, list) and index < len(value):
            value = value[index]
    return value
