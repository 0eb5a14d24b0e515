"""Arrays, texts, cells and structs in a MATLAB file of version 5, 6 or 7, read by hand: SciPy's reader, in C, trusts the sizes
that a file states, and one that lies ends the process. Function handles and instances of classes are skipped.

Source: MAT-File Format, The MathWorks, R2024a, chapter 1: Level 5 MAT-files.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from rft.core.refusal import Refusal

LARGEST = 500_000_000  # bytes of a file, inflated
HEADER = 128  # bytes before the first element
MATRIX, COMPRESSED = 14, 15  # types of elements
NUMBERS = {
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
}  # by type
TEXTS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
CELL, STRUCT, CHAR, REAL = (
    1,
    2,
    4,
    range(6, 16),
)  # classes of arrays: of arrays, of fields, of characters, of numbers
OPAQUE = 17  # class of an instance of a class, which has no dimensions
COMPLEX = 0x0800  # among an array's flags
MOST_DIMENSIONS = 32
DEEPEST = 32  # cells and structs within one another
MOST = 200_000  # elements, or nodes of HDF5: files of sysplotter have some hundreds


class Source:
    """The bytes of a file under way. order: of their bytes. left: elements that it may
    still have, which can be far more than its compressed bytes."""

    def __init__(self, order: str):
        self.order, self.left = order, MOST

    def elements(self, data: memoryview) -> Iterator[tuple[int, memoryview]]:
        """Yield (type, bytes) of the elements that fill ``data``; Refusal if one is longer
        than the rest of it, or the file has too many."""
        k = 0
        while k < len(data):
            self.left -= 1
            if self.left < 0:
                raise Refusal(f"it has more than {MOST:,} parts")
            if k + 8 > len(data):
                raise Refusal("cut short")
            kind, size = struct.unpack_from(f"{self.order}II", data, k)
            small = kind >> 16
            if small:  # up to four bytes, in the place of the size
                kind, size, start, step = kind & 0xFFFF, small, k + 4, 8
            else:
                padding = 0 if kind == COMPRESSED else -size % 8
                start, step = k + 8, 8 + size + padding
            if (small and small > 4) or start + size > len(data):
                raise Refusal("cut short")
            yield kind, data[start : start + size]
            k += step


def arrays(raw: bytes) -> dict[str, Any]:
    """Return variables by name: arrays of real numbers, lines of text, cells as arrays of such objects, structs as dicts by
    field, None for anything else. Refusal for a damaged file."""
    marks = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
    if (order := marks.get(raw[124:HEADER])) is None:
        raise Refusal("no MATLAB file of version 5 to 7")
    variables, bytes_left, source = {}, LARGEST, Source(order)
    for kind, data in source.elements(memoryview(raw)[HEADER:]):
        if kind == COMPRESSED:
            stream = zlib.decompressobj()
            try:
                data = memoryview(stream.decompress(data, bytes_left))
            except zlib.error:
                raise Refusal("damaged") from None
            bytes_left -= len(data)
            if not stream.eof or bytes_left <= 0:
                raise Refusal("cut short, or too large")
            ((kind, data),) = source.elements(data)
        if kind == MATRIX and data:
            name, values = _matrix(data, source, DEEPEST)
            variables[name] = values
    return variables


def _matrix(data: memoryview, source: Source, depth: int) -> tuple[str, Any]:
    """Return (name, values) of a matrix; Refusal if its parts do not fit each other. depth: of cells and structs within
    it."""
    parts, order = list(source.elements(data)), source.order
    if len(parts) < 3 or len(parts[0][1]) != 8 or not depth:
        raise Refusal("damaged")
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1])
    kind = flags & 0xFF
    if kind == OPAQUE:
        return bytes(parts[1][1]).decode("latin-1"), None
    if len(parts[1][1]) % 4:
        raise Refusal("damaged")
    shape = tuple(np.frombuffer(parts[1][1], f"{order}i4").tolist())
    name, parts = bytes(parts[2][1]).decode("latin-1"), parts[3:]
    if flags & COMPLEX or not 2 <= len(shape) <= MOST_DIMENSIONS or min(shape) < 0:
        return name, None
    if kind in (CELL, STRUCT):
        return name, (_cell if kind == CELL else _struct)(
            parts, shape, source, depth - 1
        )
    return name, _array(kind, shape, *parts[0], order) if len(parts) == 1 else None


def _array(
    kind: int, shape: tuple[int, ...], stored_as: int, raw: memoryview, order: str
) -> np.ndarray | str | None:
    """Return an array of numbers of a shape, or a text, from the bytes of its element; None for another class."""
    if kind == CHAR and stored_as in TEXTS:
        wide = TEXTS[stored_as].startswith("utf-") and TEXTS[stored_as] != "utf-8"
        end = "-le" if order == "<" else "-be"
        return bytes(raw).decode(
            f"{TEXTS[stored_as]}{end}" if wide else TEXTS[stored_as], "replace"
        )
    if kind not in REAL or stored_as not in NUMBERS:
        return None
    if len(raw) != _count(shape) * np.dtype(NUMBERS[stored_as]).itemsize:
        raise Refusal("damaged")
    return np.frombuffer(raw, np.dtype(NUMBERS[stored_as]).newbyteorder(order)).reshape(
        shape, order="F"
    )


def _count(shape: tuple[int, ...]) -> int:
    size = 1
    for n in shape:  # as Python's own, which do not overflow
        size *= n
    return size


def _cell(
    parts: list, shape: tuple[int, ...], source: Source, depth: int
) -> np.ndarray:
    """Return the contents of a cell, an array of objects."""
    if _count(shape) != len(parts):
        raise Refusal("damaged")
    values = np.empty(len(parts), object)
    values[:] = [_value(part, source, depth) for part in parts]
    return values.reshape(shape, order="F")


def _struct(
    parts: list, shape: tuple[int, ...], source: Source, depth: int
) -> dict[str, Any] | None:
    """Return the fields of a struct by name; None of an array of structs."""
    if len(parts) < 2 or len(parts[0][1]) != 4:
        raise Refusal("damaged")
    (width,) = struct.unpack_from(f"{source.order}i", parts[0][1])
    names, values = bytes(parts[1][1]), parts[2:]
    if (
        width <= 0
        or len(names) % width
        or len(names) // width * _count(shape) != len(values)
    ):
        raise Refusal("damaged")
    if _count(shape) != 1:
        return None
    fields = [
        names[k : k + width].partition(b"\0")[0].decode("latin-1")
        for k in range(0, len(names), width)
    ]
    return {name: _value(part, source, depth) for name, part in zip(fields, values)}


def _value(part: tuple[int, memoryview], source: Source, depth: int) -> Any:
    """Return the values of a matrix within another one; an empty array for an empty one."""
    kind, data = part
    if kind != MATRIX:
        raise Refusal("damaged")
    return _matrix(data, source, depth)[1] if data else np.zeros((0, 0))
