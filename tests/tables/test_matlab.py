"""MATLAB files of version 5 to 7, byte by byte: arrays, texts, cells and structs."""

import struct
import zlib

import numpy as np
import pytest

from geomech.io.tables import matlab
from rft.core.refusal import Refusal

HEAD = {
    "<": b"MATLAB".ljust(124) + b"\x00\x01IM",
    ">": b"MATLAB".ljust(124) + b"\x01\x00MI",
}


def element(kind, data, order="<", small=False):
    """An element; a small one has up to four bytes in the place of its size."""
    if small:
        return struct.pack(f"{order}I", kind | len(data) << 16) + data.ljust(4, b"\0")
    return struct.pack(f"{order}II", kind, len(data)) + data + bytes(-len(data) % 8)


def flags(kind, order="<"):
    return element(6, struct.pack(f"{order}II", kind, 0), order)


def matrix(kind, shape, *parts, name=b"abc", order="<"):
    """A matrix of a class and a shape."""
    sizes = element(5, struct.pack(f"{order}{len(shape)}i", *shape), order)
    named = element(1, name, order, small=len(name) < 5)
    lead = flags(kind, order) + sizes + named
    return element(14, lead + b"".join(parts), order)


def read(*elements, order="<"):
    return matlab.arrays(HEAD[order] + b"".join(elements))


ONE = element(9, struct.pack("<d", 1.0))
NUMBER = matrix(6, (1, 1), ONE, name=b"")


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(
    ("kind", "code", "values"),
    [
        (9, "d", range(6)),
        (7, "f", range(6)),
        (3, "h", range(-3, 3)),
        (2, "B", range(250, 256)),
        (13, "Q", range(6)),
    ],
)
def test_numbers_are_read_in_either_order_of_bytes(kind, code, values, order):
    data = element(kind, struct.pack(f"{order}6{code}", *values), order)
    found = read(matrix(6, (2, 3), data, order=order), order=order)["abc"]
    np.testing.assert_array_equal(found, np.reshape(values, (2, 3), order="F"))
    assert found.dtype.kind == np.dtype(code).kind


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(
    ("kind", "encoding"),
    [(16, "utf-8"), (17, "utf-16"), (4, "utf-16"), (2, "latin-1"), (18, "utf-32")],
)
def test_texts_are_read_in_every_encoding(kind, encoding, order):
    if encoding in ("utf-16", "utf-32"):
        encoding += {"<": "-le", ">": "-be"}[order]
    data = element(kind, "\u00e4b".encode(encoding), order)
    text = matrix(4, (1, 2), data, name=b"longer name", order=order)
    assert read(text, order=order) == {"longer name": "\u00e4b"}


def test_small_and_empty_and_many_axes_are_read():
    small = element(4, struct.pack("<2H", 7, 300), small=True)
    assert read(matrix(6, (1, 2), small))["abc"].tolist() == [[7, 300]]
    assert read(matrix(6, (0, 3), element(9, b"")))["abc"].shape == (0, 3)
    assert read(matrix(6, (1,) * 32, ONE))["abc"].ndim == 32
    assert read(matrix(15, (1, 1), ONE))["abc"] == 1.0
    assert read(element(14, b""), element(9, b"12345678")) == {}


@pytest.mark.parametrize(
    "data",
    [
        matrix(6 | 0x0800, (1, 1), ONE),  # complex
        matrix(6, (1,), ONE),
        matrix(6, (1,) * 33, ONE),
        matrix(6, (-1, 1), ONE),
        matrix(6, (1, 1), ONE, ONE),
        matrix(5, (1, 1), ONE),  # sparse
        matrix(16, (1, 1), ONE),  # a function handle
        matrix(6, (1, 1), element(8, b"12345678")),
        matrix(4, (1, 1), element(5, b"1234")),
        element(14, flags(17) + element(1, b"abc") + element(1, b"x")),  # an instance
    ],
)
def test_what_is_no_plain_array_is_skipped(data):
    assert read(data) == {"abc": None}


FIELDS = element(5, struct.pack("<i", 4), small=True), element(1, b"ab\0\0c\0\0\0")


def struct_of(width, *parts):
    return matrix(2, (1, 1), element(5, width, small=True), FIELDS[1], *parts)


@pytest.mark.parametrize(
    "data",
    [
        matrix(6, (1, 2), ONE),
        matrix(6, (1, 1), element(9, b"1234567")),
        element(14, flags(6) + element(5, b"12345678")),
        element(14, element(6, b"1234") + element(5, b"12345678") + element(1, b"a")),
        element(14, flags(6) + element(5, b"123456") + element(1, b"a")),
        matrix(1, (2, 2), NUMBER),
        matrix(1, (1, 1), ONE),
        matrix(2, (1, 1), FIELDS[0]),
        matrix(2, (1, 1), *FIELDS, NUMBER),
        matrix(2, (1, 1), *FIELDS, ONE, ONE),
        struct_of(struct.pack("<i", 0), NUMBER),
        struct_of(struct.pack("<i", -4), NUMBER, NUMBER),
        struct_of(struct.pack("<i", 3), NUMBER, NUMBER),
        struct_of(b"12", NUMBER, NUMBER),
        ONE[:4],
        matrix(6, (1, 1), ONE)[:-1],
        matrix(6, (1, 1), ONE) + b"1234567",
        struct.pack("<I", 1 | 5 << 16) + b"12345678",
        element(15, b"no zip at all..."),
        element(15, zlib.compress(NUMBER)[:-6]),
    ],
)
def test_parts_that_do_not_fit_are_damage(data):
    with pytest.raises(Refusal, match="damaged|incomplete"):
        read(data)


def test_cells_and_structs_hold_others():
    cell = read(matrix(1, (2, 1), NUMBER, element(14, b"")))["abc"]
    assert cell[0, 0] == 1.0
    assert cell[1, 0].shape == (0, 0)
    assert read(matrix(2, (1, 1), *FIELDS, NUMBER, NUMBER)) == {
        "abc": {"ab": 1.0, "c": 1.0}
    }
    assert read(matrix(2, (1, 2), *FIELDS, *[NUMBER] * 4)) == {"abc": None}


def test_cells_may_lie_within_each_other_to_a_depth():
    deep = NUMBER
    for _ in range(31):
        deep = matrix(1, (1, 1), deep, name=b"c")
    assert list(read(deep)) == ["c"]
    with pytest.raises(Refusal, match="damaged"):
        read(matrix(1, (1, 1), deep, name=b"c"))


def test_handles_and_instances_in_a_struct_are_skipped_and_never_run():
    code = element(4, "sf%0@()delete('*')".encode("utf-16-le"))
    handle = matrix(16, (1, 1), matrix(4, (1, 18), code, name=b""), name=b"f")
    words = (b"space", b"MCOS", b"LieGroups")
    lead = b"".join(element(1, word) for word in words)
    instance = element(14, flags(17) + lead + NUMBER)
    names = b"".join(name.ljust(8, b"\0") for name in (b"run", b"space", b"x"))
    fields = element(5, struct.pack("<i", 8)), element(1, names)
    s = matrix(2, (1, 1), *fields, handle, instance, NUMBER, name=b"s")
    assert read(handle, instance, s) == {
        "f": None,
        "space": None,
        "s": {"run": None, "space": None, "x": 1.0},
    }


def test_compressed_elements_are_read_up_to_a_size():
    whole = matrix(6, (1, 1), ONE)
    data = zlib.compress(whole)
    packed = struct.pack("<II", 15, len(data)) + data
    raw = HEAD["<"] + packed + packed
    assert matlab.arrays(raw, largest=2 * len(whole) + 1)["abc"] == 1.0
    with pytest.raises(Refusal, match="too large"):
        matlab.arrays(raw, largest=2 * len(whole))
