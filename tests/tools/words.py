"""Texts, JSON and files as lines, and whether such lines say the same: numbers to 1e-6,
names, and no word beside.

Of a text its numbers count, in their order, and the names in it. A structure (JSON,
TOML, a table, a file of numbers) is lines "path = value", which are the same but for
the digits of their numbers. Times and facts of the machine are masked.
"""

from __future__ import annotations

import contextlib
import json
import math
import pathlib
import re
import tempfile
import tomllib
from collections.abc import Iterator

import numpy as np
from scipy.io import loadmat, netcdf_file

TOLERANCE = 1e-6  # relative, of the largest number of a line
FLOOR = 1e-9  # what is smaller is rounding

PLAIN_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.I)
WORD = re.compile(r"[^\s()\[\]{},;:=<>|*/^\"'`]+")
UNITS = {
    *("BL", "m", "rad", "deg", "degrees", "s", "Hz", "m/s"),
    *("N", "J", "W", "kg", "Pa", "N/cm^3", "N/m^3", "kg/m^3"),
}
LISTED = {  # words of an answer that programs look for
    *("area", "adapted", "path", "harmonic", "direct", "sliding", "stuck", "walking"),
    *("algebraic", "planar", "mujoco", "granular", "viscous", "coulomb"),
    *("circle", "ellipse", "butterfly", "fourier", "points", "chain", "serpenoid"),
}
FILE = re.compile(
    r"[\w./~-]*\w"
    r"\.(?:toml|nc|mat|csv|png|svg|pdf|gif|mp4|json|txt|stl|obj|ply|xml|py)\b"
)
OPTION = re.compile(r"(?<![\w-])--?[a-z][\w-]*")
QUOTED = re.compile(r"(?<!\w)'([^']+)'(?!\w)|`([^`]+)`|\"([^\"]+)\"")
CODE = re.compile(r"(?<![\w.])[A-Za-z]\w*_\w+|\b[A-Za-z]+\d\w*")
# Not the same twice: times, and how a solver came to its end.
MASKS = [
    (r"^back end: .*$", "back end: #"),
    (r"^seconds: .*$", "seconds: #"),
    (r"\d+ cycles evaluated in [\d.]+ s", "# cycles evaluated in # s"),
    (r"^( *[\d.e-]+ +elements .*[\d-]) +[\d.]+$", r"\1 #"),
    (r"in\s+[\d.e-]+\s+to\s+[\d.e-]+ s\b", "in # to # s"),
    (r"force balances, [\d.e-]+ s$", "force balances, # s"),
    (r"residual [\d.e+-]+, \d+ iterations", "residual #, # iterations"),
    (r"about [\d.]+ (s|min|h|days|years)\b", "about #"),
    (r"\b[\d,.]+ [kMGT]?B of memory", "# of memory"),
    (rf"(/private)?{re.escape(tempfile.gettempdir())}/tmp\w+", "#"),
]
MASKED_KEYS = re.compile(
    r"(^|\.)(seconds|best_seconds|evaluations|iterations|residual|kept)($|\.)"
)


def masked(text: str) -> str:
    """Return a text with # in place of what is not the same twice."""
    for pattern, put in MASKS:
        text = re.sub(pattern, put, text, flags=re.M)
    return text


# Numbers and names of a text.


def bare_number(word: str) -> str:
    """Return a word without a sign of an error, a unit or the end of a sentence, such
    as 30 of "30deg"."""
    return word.removeprefix("+-").rstrip(".%?!").removesuffix("deg")


def number_of(word: str) -> float | None:
    """Return a word as a number, of "+-1e-3", "30deg", "5%" and "8." the same; None if
    it is none."""
    bare = bare_number(word)
    if PLAIN_NUMBER.fullmatch(bare):
        return float(bare)
    return None


def numbers(text: str) -> list[tuple[float, float]]:
    """Return every number in a text with one unit of its last decimal, 0 if it has
    none, in their order."""
    found = []
    for word in WORD.findall(text):
        number = number_of(word)
        if number is None:
            continue
        digits, _, power = bare_number(word).lower().partition("e")
        decimals = len(digits.partition(".")[2])
        unit = 0.0
        if decimals:
            unit = 10.0 ** (int(power or 0) - decimals)
        found.append((number, unit))
    return found


def names(text: str) -> set[str]:
    """Return what a text calls by name: options, files, what stands in quotes or looks
    like code, units, and `LISTED`."""
    words = {word.rstrip(".") for word in WORD.findall(text)}
    words.update(re.findall(r"[^\s(),;:]+", text))
    quoted = {next(filter(None, found)) for found in QUOTED.findall(text)}
    return {
        *OPTION.findall(text),
        *FILE.findall(text),
        *CODE.findall(text),
        *quoted,
        *(words & (UNITS | LISTED)),
    }


def in_order(facts: str) -> str:
    """Return a pattern of messages that have some words, such as "line 3 alpha_1 rad",
    in their order, with any others between them."""
    parts = []
    for word in facts.split():
        start = r"(?<!\w)" if word[0].isalnum() else ""
        parts.append(start + re.escape(word))
    return ".*".join(parts)


# Whether two texts say the same.


def near(one: float, other: float, unit: float = 0.0, size: float = 0.0) -> bool:
    """Return whether two numbers are equal, but for a last digit or rounding.

    unit: of the last digit. size: of the largest number on their line."""
    if not (math.isfinite(one) and math.isfinite(other)):
        both_unknown = math.isnan(one) and math.isnan(other)
        return one == other or both_unknown
    relative = TOLERANCE * max(abs(one), abs(other), size)
    return abs(one - other) <= max(1.01 * unit, relative, FLOOR)


def text_holds(old: str, new: str) -> bool:
    """Return whether the numbers of a text are as they were, and what it named is
    named."""
    was = numbers(old)
    now = numbers(new)
    if len(was) != len(now) or not names(old) <= names(new):
        return False
    return all(near(a, b, unit) for (a, unit), (b, _) in zip(was, now))


def bare(text: str) -> str:
    """Return a text with # in place of its numbers."""

    def replaced(word):
        if number_of(word[0]) is None:
            return word[0]
        return "#"

    return WORD.sub(replaced, text)


def line_holds(old: str, new: str) -> bool:
    """Return whether a line of a structure is the same but for the digits of its
    numbers."""
    if old == new:
        return True
    if bare(old) != bare(new):
        return False
    was = numbers(old)
    now = numbers(new)
    size = max((abs(x) for x, _ in was), default=0.0)
    return all(near(a, b, size=size) for (a, _), (b, _) in zip(was, now))


# Structures: JSON and files, as lines.


def short(value) -> str:
    if isinstance(value, float | np.floating):
        return f"{value:.8g}"
    return str(value)


def of_array(values) -> str:
    """Return an array on a line: all of up to twelve numbers; of more its shape, some
    of them, the root mean square, and a sum with alternating weights, which tells what
    moved."""
    array = np.asarray(values)
    if not array.ndim:
        return short(array.item())
    flat = array.ravel()
    if flat.dtype.kind not in "iufb" or flat.size <= 12:
        return " ".join(map(short, flat.tolist()))
    flat = flat.astype(float)
    some = flat[np.linspace(0, flat.size - 1, 7).astype(int)]
    known = np.nan_to_num(flat)
    rms = np.sqrt((known**2).mean())
    weighted = (known * np.cos(1.0 + np.arange(known.size))).mean()
    shape = "x".join(map(str, array.shape))
    return f"{shape} numbers: {' '.join(map(short, [*some, rms, weighted]))}"


def flat(value, path: str = "") -> Iterator[str]:
    """Yield JSON or TOML as lines "path = value", numbers of a list together."""
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from flat(inner, f"{path}.{key}" if path else str(key))
    elif path.endswith(("scene_toml", "medium_toml")):
        return  # in files of NetCDF it is looked at key by key
    elif MASKED_KEYS.search(path):
        yield f"{path} = #"
    elif not isinstance(value, list):
        yield f"{path} = {short(value)}"
    elif is_array(value):
        yield f"{path} = {of_array(value)}"
    else:
        for k, inner in enumerate(value):
            yield from flat(inner, f"{path}[{k}]")


def is_array(value: list) -> bool:
    try:
        return np.asarray(value).dtype.kind in "iufU"
    except ValueError:
        return False


def of_text(name: str, text: str) -> Iterator[str]:
    """Yield an attribute: a scene in TOML by its keys, other text as it is."""
    with contextlib.suppress(tomllib.TOMLDecodeError):
        if "\n" in text:
            for line in flat(tomllib.loads(text), name):
                yield f"= {line}"
            return
    yield f"~ {name} = {' '.join(text.split())}"


def decoded(value):
    if isinstance(value, bytes):
        return value.decode()
    return value


# Files.


PICTURES = {  # by the first bytes of a file
    b"\x89PNG\r\n": "PNG",
    b"GIF89a": "GIF",
    b"%PDF-1": "PDF",
    b"<?xml ": "XML",
}


def of_netcdf(file: pathlib.Path) -> Iterator[str]:
    with netcdf_file(file, mmap=False) as data:
        for key in sorted(data._attributes):
            text = short(decoded(data._attributes[key]))
            yield from of_text(f":{key}", masked(text))
        for name in sorted(data.variables):
            yield from of_variable(name, data.variables[name])


def of_variable(name: str, variable) -> Iterator[str]:
    """Yield the head, the attributes and the values of a variable of NetCDF."""
    sizes = zip(variable.dimensions, variable.shape)
    dims = ", ".join(f"{dim} {size}" for dim, size in sizes)
    kind = f"{variable.data.dtype.kind}{variable.data.dtype.itemsize}"
    unit = decoded(getattr(variable, "units", b"-"))
    yield f"= {name}({dims}) {kind} in {unit}"
    for key in sorted({*variable._attributes} - {"units"}):
        yield f"~ {name}:{key} = {decoded(variable._attributes[key])}"
    if MASKED_KEYS.search(name):
        value = "#"
    elif variable.data.dtype.kind == "S":
        value = " ".join(b"".join(row).decode() for row in variable.data)
    else:
        value = of_array(np.array(variable.data))
    yield f"= {name} = {value}"


def of_mat(file: pathlib.Path) -> Iterator[str]:
    for key, value in sorted(loadmat(file).items()):
        if not key.startswith("__"):
            kind = f"{value.dtype.kind}{value.dtype.itemsize}"
            yield f"= {key} {kind} = {of_array(value)}"


def of_csv(file: pathlib.Path) -> Iterator[str]:
    lines = file.read_text().splitlines()
    head, *rows = [line.split(",") for line in lines if line[:1] != "#"]
    yield f"= {len(rows) + 1} lines of {','.join(head)}"
    with contextlib.suppress(ValueError):  # of words
        for name, column in zip(head, np.array(rows, float).T):
            yield f"= {name} = {of_array(column)}"


def of_file(file: pathlib.Path) -> Iterator[str]:
    """Yield what is in a file, as lines: "= " of structure, "~ " of text."""
    match file.suffix:
        case ".nc":
            yield from of_netcdf(file)
        case ".mat":
            yield from of_mat(file)
        case ".csv":
            yield from of_csv(file)
        case ".toml":
            for line in flat(tomllib.loads(masked(file.read_text()))):
                yield f"= {line}"
        case ".json":
            for line in flat(json.loads(masked(file.read_text()))):
                yield f"= {line}"
        case ".html":  # test_lab.py opens it
            yield f"= {file.read_text().splitlines()[0]}"
        case ".png" | ".gif" | ".pdf" | ".svg":
            yield f"= {PICTURES.get(file.read_bytes()[:6], 'something else')}"
        case _:
            for line in masked(file.read_text()).splitlines():
                if line:
                    yield f"~ {line}"
