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

TOLERANCE, FLOOR = (
    1e-6,
    1e-9,
)  # relative, of the largest number of a line; what is smaller is rounding

PLAIN_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.I)
WORD = re.compile(r"[^\s()\[\]{},;:=<>|*/^\"'`]+")
UNITS = {
    "BL",
    "m",
    "rad",
    "deg",
    "degrees",
    "s",
    "Hz",
    "N",
    "J",
    "W",
    "kg",
    "Pa",
    "N/cm^3",
    "N/m^3",
    "kg/m^3",
    "m/s",
}
LISTED = {  # words of an answer that programs look for
    "area", "adapted", "path", "harmonic", "direct", "sliding", "stuck", "walking", "algebraic", "planar", "mujoco",
    "granular", "viscous", "coulomb", "circle", "ellipse", "butterfly", "fourier", "points", "chain", "serpenoid",
}  # fmt: skip
FILE = re.compile(
    r"[\w./~-]*\w\.(?:toml|nc|mat|csv|png|svg|pdf|gif|mp4|json|txt|stl|obj|ply|xml|py)\b"
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
    for pattern, put in MASKS:
        text = re.sub(pattern, put, text, flags=re.M)
    return text


def number_of(word: str) -> float | None:
    """A word as a number, of "+-1e-3", "30deg", "5%" and "8." the same; None if it is
    none."""
    word = word.removeprefix("+-").rstrip(".%?!").removesuffix("deg")
    return float(word) if PLAIN_NUMBER.fullmatch(word) else None


def numbers(text: str) -> list[tuple[float, float]]:
    """Every number in a text with one unit of its last decimal, 0 if it has none, in
    their order."""
    found = []
    for word in WORD.findall(text):
        x = number_of(word)
        if x is not None:
            bare = word.rstrip(".%?!").removesuffix("deg").lower()
            digits, _, power = bare.partition("e")
            decimals = len(digits.partition(".")[2])
            found.append((x, 10.0 ** (int(power or 0) - decimals) if decimals else 0.0))
    return found


def names(text: str) -> set[str]:
    """What a text calls by name: options, files, what stands in quotes or looks like
    code, units, and `LISTED`."""
    words = {word.rstrip(".") for word in WORD.findall(text)} | set(
        re.findall(r"[^\s(),;:]+", text)
    )
    quoted = {next(filter(None, found)) for found in QUOTED.findall(text)}
    return {
        *OPTION.findall(text),
        *FILE.findall(text),
        *CODE.findall(text),
        *quoted,
        *(words & (UNITS | LISTED)),
    }


def near(one: float, other: float, unit: float = 0.0, size: float = 0.0) -> bool:
    """Equal, but for a last digit or rounding."""
    if not (math.isfinite(one) and math.isfinite(other)):
        return one == other or (math.isnan(one) and math.isnan(other))
    return abs(one - other) <= max(
        1.01 * unit, TOLERANCE * max(abs(one), abs(other), size), FLOOR
    )


def text_holds(old: str, new: str) -> bool:
    """Whether the numbers of a text are as they were, and what it named is named."""
    was, now = numbers(old), numbers(new)
    same = len(was) == len(now) and all(
        near(a, b, unit) for (a, unit), (b, _) in zip(was, now)
    )
    return same and names(old) <= names(new)


def bare(text: str) -> str:
    """Return a text with # in place of its numbers."""

    def replaced(word):
        return word[0] if number_of(word[0]) is None else "#"

    return WORD.sub(replaced, text)


def line_holds(old: str, new: str) -> bool:
    """Whether a line of a structure is the same but for the digits of its numbers."""
    if old == new:
        return True
    was, now = numbers(old), numbers(new)
    size = max((abs(x) for x, _ in was), default=0.0)
    return bare(old) == bare(new) and all(
        near(a, b, 0.0, size) for (a, _), (b, _) in zip(was, now)
    )


# Structures: JSON and files, as lines.


def short(x) -> str:
    return f"{x:.8g}" if isinstance(x, (float, np.floating)) else str(x)


def of_array(values) -> str:
    """An array on a line: all of up to twelve numbers; of more its shape, some of them,
    the root mean square, and a sum with alternating weights, which tells what moved."""
    array = np.asarray(values)
    flat = array.ravel()
    if flat.dtype.kind not in "iufb" or flat.size <= 12:
        return (
            " ".join(map(short, flat.tolist())) if array.ndim else short(array.item())
        )
    flat = flat.astype(float)
    some = flat[np.linspace(0, flat.size - 1, 7).astype(int)]
    good = np.nan_to_num(flat)
    mean = [
        np.sqrt((good**2).mean()),
        (good * np.cos(1.0 + np.arange(good.size))).mean(),
    ]
    return f"{'x'.join(map(str, array.shape))} numbers: {' '.join(map(short, [*some, *mean]))}"


def flat(value, path: str = "") -> Iterator[str]:
    """JSON or TOML as lines "path = value", numbers of a list together."""
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from flat(inner, f"{path}.{key}" if path else str(key))
    elif path.endswith(("scene_toml", "medium_toml")):
        return  # in files of NetCDF it is looked at key by key
    elif MASKED_KEYS.search(path):
        yield f"{path} = #"
    elif isinstance(value, list) and not is_array(value):
        for k, inner in enumerate(value):
            yield from flat(inner, f"{path}[{k}]")
    else:
        yield f"{path} = {of_array(value) if isinstance(value, list) else short(value)}"


def is_array(value: list) -> bool:
    try:
        return np.asarray(value).dtype.kind in "iufU"
    except ValueError:
        return False


def of_text(name: str, text: str) -> Iterator[str]:
    """An attribute: a scene in TOML by its keys, other text as it is."""
    with contextlib.suppress(tomllib.TOMLDecodeError):
        if "\n" in text:
            yield from (f"= {line}" for line in flat(tomllib.loads(text), name))
            return
    yield f"~ {name} = {' '.join(text.split())}"


def decoded(x):
    return x.decode() if isinstance(x, bytes) else x


PICTURES = {
    b"\x89PNG\r\n": "PNG",
    b"GIF89a": "GIF",
    b"%PDF-1": "PDF",
    b"<?xml ": "XML",
}


def of_netcdf(file: pathlib.Path) -> Iterator[str]:
    with netcdf_file(file, mmap=False) as data:
        for key in sorted(data._attributes):
            yield from of_text(f":{key}", masked(short(decoded(data._attributes[key]))))
        for name in sorted(data.variables):
            variable = data.variables[name]
            sizes = zip(variable.dimensions, variable.shape)
            told = ", ".join(f"{dim} {size}" for dim, size in sizes)
            kind = f"{variable.data.dtype.kind}{variable.data.dtype.itemsize}"
            unit = decoded(getattr(variable, "units", b"-"))
            yield f"= {name}({told}) {kind} in {unit}"
            for key in sorted(set(variable._attributes) - {"units"}):
                yield f"~ {name}:{key} = {decoded(variable._attributes[key])}"
            text = variable.data.dtype.kind == "S"
            rows = (
                [b"".join(row).decode() for row in variable.data]
                if text
                else variable.data
            )
            value = " ".join(rows) if text else of_array(np.array(rows))
            yield f"= {name} = {'#' if MASKED_KEYS.search(name) else value}"


def of_file(file: pathlib.Path) -> Iterator[str]:
    """What is in a file, as lines: "= " of structure, "~ " of text."""
    match file.suffix:
        case ".nc":
            yield from of_netcdf(file)
        case ".mat":
            for key, value in sorted(loadmat(file).items()):
                if not key.startswith("__"):
                    yield f"= {key} {value.dtype.kind}{value.dtype.itemsize} = {of_array(value)}"
        case ".toml" | ".json":
            read = tomllib.loads if file.suffix == ".toml" else json.loads
            yield from (f"= {line}" for line in flat(read(masked(file.read_text()))))
        case ".csv":
            lines = file.read_text().splitlines()
            head, *rows = [line.split(",") for line in lines if line[:1] != "#"]
            yield f"= {len(rows) + 1} lines of {','.join(head)}"
            with contextlib.suppress(ValueError):
                for name, column in zip(head, np.array(rows, float).T):
                    yield f"= {name} = {of_array(column)}"
        case ".html":  # test_lab.py opens it
            yield f"= {file.read_text().splitlines()[0]}"
        case ".png" | ".gif" | ".pdf" | ".svg":
            yield f"= {PICTURES.get(file.read_bytes()[:6], 'something else')}"
        case _:
            lines = masked(file.read_text()).splitlines()
            yield from (f"~ {line}" for line in lines if line)
