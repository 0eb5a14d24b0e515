"""Arrays of numbers and texts in a MATLAB file of version 5, 6 or 7, read by hand: SciPy's reader, in C, trusts the sizes that
a file states, and one that lies ends the process.

Source: MAT-File Format, The MathWorks, R2024a, chapter 1: Level 5 MAT-files.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import numpy as np

from rft.refusal import Refusal

LARGEST = 500_000_000  # bytes of a file, inflated
HEADER = 128  # bytes before the first element
MATRIX, COMPRESSED = 14, 15  # types of elements
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}  # by type
TEXTS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
CHAR, REAL = 4, range(6, 16)  # classes of arrays: of characters, of numbers
COMPLEX = 0x0800  # among an array's flags
MOST_DIMENSIONS = 32


def arrays(raw: bytes) -> dict[str, np.ndarray | str | None]:
    """Return variables by name: arrays of real numbers, lines of text, None for anything else. Refusal for a damaged
    file."""
    marks = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}
    if (order := marks.get(raw[124:HEADER])) is None:
        raise Refusal("no MATLAB file of version 5 to 7")
    variables, bytes_left = {}, LARGEST
    for kind, data in _elements(raw[HEADER:], order):
        if kind == COMPRESSED:
            stream = zlib.decompressobj()
            try:
                data = stream.decompress(data, bytes_left)
            except zlib.error:
                raise Refusal("damaged") from None
            bytes_left -= len(data)
            if not stream.eof or bytes_left <= 0:
                raise Refusal("cut short, or too large")
            ((kind, data),) = _elements(data, order)
        if kind == MATRIX and data:
            name, values = _matrix(data, order)
            variables[name] = values
    return variables


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield (type, bytes) of the elements that fill ``data``; Refusal if one is longer than the rest of it."""
    k = 0
    while k < len(data):
        if k + 8 > len(data):
            raise Refusal("cut short")
        kind, size = struct.unpack_from(f"{order}II", data, k)
        small = kind >> 16
        if small:  # up to four bytes, in the place of the size
            kind, size, start, step = kind & 0xFFFF, small, k + 4, 8
        else:
            start, step = k + 8, 8 + size + (-size % 8 if kind != COMPRESSED else 0)
        if (small and small > 4) or start + size > len(data):
            raise Refusal("cut short")
        yield kind, data[start : start + size]
        k += step


def _matrix(data: bytes, order: str) -> tuple[str, np.ndarray | str | None]:
    """Return (name, values) of a matrix; Refusal if its parts do not fit each other."""
    parts = list(_elements(data, order))
    if len(parts) < 3 or len(parts[0][1]) != 8 or len(parts[1][1]) % 4:
        raise Refusal("damaged")
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1])
    shape = tuple(np.frombuffer(parts[1][1], f"{order}i4").tolist())
    name = parts[2][1].decode("latin-1")
    if len(parts) != 4 or flags & COMPLEX or not 2 <= len(shape) <= MOST_DIMENSIONS or min(shape) < 0:
        return name, None
    kind, raw = parts[3]
    if flags & 0xFF == CHAR and kind in TEXTS:
        wide = TEXTS[kind].startswith("utf-") and TEXTS[kind] != "utf-8"
        return name, raw.decode(f"{TEXTS[kind]}-{'le' if order == '<' else 'be'}" if wide else TEXTS[kind], "replace")
    if flags & 0xFF not in REAL or kind not in NUMBERS:
        return name, None
    size = 1
    for n in shape:  # as Python's own, which do not overflow
        size *= n
    if len(raw) != size * np.dtype(NUMBERS[kind]).itemsize:
        raise Refusal("damaged")
    return name, np.frombuffer(raw, np.dtype(NUMBERS[kind]).newbyteorder(order)).reshape(shape, order="F")
