"""Small files that name the same thing many times, or hold far more than their bytes,
are refused soon, or read as what they are."""

import io
import struct
import zlib

import numpy as np
import pytest

from geomech import scenes
from geomech.io import tables
from geomech.io.rows import split_unit
from geomech.io.tables import hdf5, matlab
from geomech.scenes.format.hints import line_hint
from rft.core.refusal import Refusal


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def mat(compressed):
    """A file of version 5 of one compressed element."""
    body = zlib.compress(compressed)
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return head + struct.pack("<II", matlab.COMPRESSED, len(body)) + body


def test_cells_of_cells_of_version_7_3():
    """Each of a few cells has the next one eight times: each is read once."""
    h5py = pytest.importorskip("h5py")
    raw = io.BytesIO()
    with h5py.File(raw, "w") as file:
        node = file.create_dataset("end", data=np.zeros((1, 1)))
        for k in range(12):
            references = np.full((8, 1), node.ref, h5py.ref_dtype)
            node = file.create_dataset(f"c{k}", data=references, dtype=h5py.ref_dtype)
            node.attrs["MATLAB_class"] = np.bytes_("cell")
        file["s"] = node
    cells = hdf5.arrays(raw.getvalue(), ["s"])["s"]
    assert [cell is cells[0, 0] for cell in cells.ravel()] == [True] * 8


def test_many_empty_cells_of_version_5():
    count = matlab.MOST + 1
    parts = element(6, struct.pack("<II", matlab.CELL, 0))
    parts += element(5, struct.pack("<ii", count, 1)) + element(1, b"many")
    raw = mat(element(matlab.MATRIX, parts + count * element(matlab.MATRIX, b"")))
    assert len(raw) < 10_000
    with pytest.raises(Refusal):
        matlab.arrays(raw)


def test_variables_of_netcdf_in_one_place(tmp_path):
    def name(text):
        return struct.pack(">i", len(text)) + text + bytes(-len(text) % 4)

    size, count = 40_000, 50
    dimensions = struct.pack(">ii", 10, 1) + name(b"n") + struct.pack(">i", size)
    place = 32 + len(dimensions) + count * 44
    variables = struct.pack(">ii", 11, count)
    for k in range(count):
        variables += name(f"v{k:02}x".encode()) + struct.pack(">ii", 1, 0)
        variables += struct.pack(">ii", 0, 0)  # without attributes
        variables += struct.pack(">iii", 6, 8 * size, place)
    head = b"CDF\x01" + bytes(4) + dimensions + bytes(8) + variables
    raw = head.ljust(place, b"\0") + bytes(8 * size)
    (tmp_path / "t.nc").write_bytes(raw)
    with pytest.raises(Refusal, match="damaged"):
        tables.load(tmp_path / "t.nc")


@pytest.mark.parametrize(
    "key", ["a" + ".a" * 5000, '"a" . ' * 5000 + "a", "[a" + ".a" * 5000 + "]"]
)
def test_keys_of_many_parts(key):
    with pytest.raises(Refusal, match="64 parts"):
        scenes.parse(f"{key} = 1\n")


def test_patterns_take_a_time_of_the_length():
    """Of a line and of a header, at which quadratic ones would take minutes."""
    line = "=a" * 500_000 + '"'
    assert line_hint(line, ValueError("no value (at line 1)")).startswith(": ")
    for letter in "_ (":
        split_unit("x" + letter * 100_000 + "!")
    assert split_unit("x (px)") == ("x", "px")
