"""What a reader of a scene file says beside what is wrong: the line, the value, and what should stand there."""

from __future__ import annotations

import re
from collections.abc import Mapping

from geomech.scene.key import angles_of, meanings
from rft.checks import is_number
from rft.refusal import formatted

WANTED = {
    "float": "a number", "int": "a whole number without a point", "str": 'text in "quotes"', "bool": "true or false",
    "array": "a list in [ ]", "object": "a table",
}  # fmt: skip
RULES = (
    (r"[“”„«»‘’]", 'put text in straight "quotes"'),
    (r"=\s*[-+]?\.\d", "a number has a digit before its point"),
    (r"=\s*[-+]?\d+,\d+\s*$", "a number has a point, no comma"),
    (r"=\s*[-+]?[\d.]+\s*(deg|°)", "a number has no unit: a key that ends in _deg takes degrees"),
    (r"=\s*[-+]?[\d.]+\s*[A-Za-z]", "a number has no unit"),
    (r"=\s*[A-Za-z][^\"]*$", 'put text in "quotes"'),
    (r"=\s*$", "give the key a value"),
    (r"^[^\"=]*:", "write KEY = VALUE"),
    (r"\"[^\"]*$", "close the quotes"),
)


def at_line(text: str, error: Exception) -> str:
    """The line of a TOML text that an error names, with its cure if that is plain; empty if it names none."""
    found = re.search(r"at line (\d+)", str(error))
    lines = text.split("\n")
    if not found or int(found[1]) > len(lines):
        return ""
    line = lines[int(found[1]) - 1].partition("#")[0]
    cure = next((f", {cure}" for rule, cure in RULES if re.search(rule, line)), "")
    return f": {formatted(line.strip())}{cure}"


def cure_of_value(told: str, table: Mapping, kind: type) -> str:
    """What to give in place of a value that is refused, as ``told``; empty if that says it all. kind: the class of the
    keys."""
    if missing := re.search(r"missing required field `(\w+)`", told):
        unit, _ = meanings(kind).get(missing[1], ("-", ""))
        return f"add {missing[1]} = ..." + f", in {unit}" * (unit not in ("-", ""))
    if found := re.search(r"Expected `(\w+)(?: \| null)?`.* at `\.(\w+)((?:\[\d+\])*)", told):
        wanted, key, places = found.groups()
        value = table.get(key, table.get(f"{key}_deg"))
        for place in re.findall(r"\d+", places):
            value = value[int(place)] if isinstance(value, list) and int(place) < len(value) else value
        return f"give {WANTED.get(wanted, wanted)} in place of {formatted(value)}"
    key = told.partition(" must ")[0]
    given = is_number(table.get(key)) and abs(table[key]) < float("inf")
    return f"{key} is in rad, write {key}_deg for degrees" if given and key in angles_of(kind) else ""
