"""Arrays, texts, cells and structs in a MATLAB file of version 5, 6 or 7.

SciPy's reader is in C and trusts the sizes that a file states: a wrong one ends the
process. So the files are read here. Function handles and instances of classes are
skipped.

Source: MAT-File Format, The MathWorks, R2024a, chapter 1: Level 5 MAT-files.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from rft.core.refusal import Refusal

LARGEST = 500_000_000  # bytes of a file, inflated
HEADER = 128  # bytes before the first element
MATRIX = 14  # type of an element
COMPRESSED = 15  # another one
NUMBERS = {  # NumPy's types of numbers, by the type of their element
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
TEXTS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
# Classes of arrays.
CELL = 1
STRUCT = 2
CHAR = 4
REAL = range(6, 16)
OPAQUE = 17  # an instance of a class, which has no dimensions
COMPLEX = 0x0800  # among an array's flags
MOST_DIMENSIONS = 32
DEEPEST = 32  # cells and structs within one another
MOST = 200_000  # elements; files of sysplotter have some hundreds


class Source:
    """The bytes of a file, taken apart into elements.

    order: of their bytes, "<" or ">". elements_left: that the file may still have.
    Their number is limited because compressed bytes can hold far more of them."""

    def __init__(self, order: str):
        self.order = order
        self.elements_left = MOST

    def elements(self, data: memoryview) -> Iterator[tuple[int, memoryview]]:
        """Yield (type, bytes) of the elements that fill ``data``; Refusal if one is
        longer than the rest of it, or the file has too many."""
        k = 0
        while k < len(data):
            self.elements_left -= 1
            if self.elements_left < 0:
                raise Refusal(f"it has more than {MOST:,} parts")
            if k + 8 > len(data):
                raise Refusal("it is incomplete")
            kind, size = struct.unpack_from(f"{self.order}II", data, k)
            small_size = kind >> 16
            if small_size:  # up to four bytes, in the place of the size
                kind &= 0xFFFF
                size = small_size
                start = k + 4
                step = 8
            else:
                padding = 0 if kind == COMPRESSED else -size % 8
                start = k + 8
                step = 8 + size + padding
            if small_size > 4 or start + size > len(data):
                raise Refusal("it is incomplete")
            yield kind, data[start : start + size]
            k += step


def arrays(raw: bytes, largest: int = LARGEST) -> dict[str, Any]:
    """Return variables by name: arrays of real numbers, lines of text, cells as arrays
    of such objects, structs as dicts by field, None for anything else. Refusal for a
    damaged file, or one that holds ``largest`` bytes or more, inflated."""
    orders = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
    order = orders.get(raw[124:HEADER])
    if order is None:
        raise Refusal("not a MATLAB file of version 5 to 7")
    variables = {}
    bytes_left = largest
    source = Source(order)
    for kind, data in source.elements(memoryview(raw)[HEADER:]):
        if kind == COMPRESSED:
            data = _inflated(data, bytes_left)
            bytes_left -= len(data)
            ((kind, data),) = source.elements(data)
        if kind == MATRIX and data:
            name, values = _matrix(data, source, DEEPEST)
            variables[name] = values
    return variables


def _inflated(data: memoryview, largest: int) -> memoryview:
    """Return the bytes of a compressed element; Refusal unless they are fewer than
    ``largest``."""
    stream = zlib.decompressobj()
    try:
        inflated = memoryview(stream.decompress(data, largest))
    except zlib.error:
        raise Refusal("damaged") from None
    if not stream.eof or len(inflated) >= largest:
        raise Refusal("incomplete or too large")
    return inflated


def _matrix(data: memoryview, source: Source, depth: int) -> tuple[str, Any]:
    """Return (name, values) of a matrix; Refusal if its parts do not fit each other.
    depth: of cells and structs that may still lie within."""
    parts = list(source.elements(data))
    order = source.order
    if len(parts) < 3 or len(parts[0][1]) != 8 or not depth:
        raise Refusal("damaged")
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1])
    kind = flags & 0xFF
    if kind == OPAQUE:
        return bytes(parts[1][1]).decode("latin-1"), None
    if len(parts[1][1]) % 4:
        raise Refusal("damaged")
    shape = tuple(np.frombuffer(parts[1][1], f"{order}i4").tolist())
    name = bytes(parts[2][1]).decode("latin-1")
    content = parts[3:]
    if flags & COMPLEX or not 2 <= len(shape) <= MOST_DIMENSIONS or min(shape) < 0:
        return name, None
    if kind == CELL:
        return name, _cell(content, shape, source, depth - 1)
    if kind == STRUCT:
        return name, _struct(content, shape, source, depth - 1)
    if len(content) != 1:
        return name, None
    return name, _array(kind, shape, *content[0], order)


def _array(
    kind: int, shape: tuple[int, ...], stored_as: int, raw: memoryview, order: str
) -> np.ndarray | str | None:
    """Return an array of numbers of a shape, or a text, from the bytes of its element;
    None for another class."""
    if kind == CHAR and stored_as in TEXTS:
        encoding = TEXTS[stored_as]
        if encoding in ("utf-16", "utf-32"):
            encoding += "-le" if order == "<" else "-be"
        return bytes(raw).decode(encoding, "replace")
    if kind not in REAL or stored_as not in NUMBERS:
        return None
    dtype = np.dtype(NUMBERS[stored_as]).newbyteorder(order)
    # math.prod of integers, unlike NumPy's, does not overflow.
    if len(raw) != math.prod(shape) * dtype.itemsize:
        raise Refusal("damaged")
    return np.frombuffer(raw, dtype).reshape(shape, order="F")


def _cell(
    parts: list, shape: tuple[int, ...], source: Source, depth: int
) -> np.ndarray:
    """Return the contents of a cell, an array of objects."""
    if math.prod(shape) != len(parts):
        raise Refusal("damaged")
    values = np.empty(len(parts), object)
    values[:] = [_value(part, source, depth) for part in parts]
    return values.reshape(shape, order="F")


def _struct(
    parts: list, shape: tuple[int, ...], source: Source, depth: int
) -> dict[str, Any] | None:
    """Return the fields of a struct by name; None for an array of structs."""
    if len(parts) < 2 or len(parts[0][1]) != 4:
        raise Refusal("damaged")
    (width,) = struct.unpack_from(f"{source.order}i", parts[0][1])
    names = bytes(parts[1][1])
    values = parts[2:]
    if width <= 0 or len(names) % width:
        raise Refusal("damaged")
    if len(names) // width * math.prod(shape) != len(values):
        raise Refusal("damaged")
    if math.prod(shape) != 1:
        return None
    fields = {}
    for k, part in enumerate(values):
        name = names[k * width : (k + 1) * width].partition(b"\0")[0]
        fields[name.decode("latin-1")] = _value(part, source, depth)
    return fields


def _value(part: tuple[int, memoryview], source: Source, depth: int) -> Any:
    """Return the values of a matrix within another one; an empty array for an empty
    one."""
    kind, data = part
    if kind != MATRIX:
        raise Refusal("damaged")
    if not data:
        return np.zeros((0, 0))
    return _matrix(data, source, depth)[1]
