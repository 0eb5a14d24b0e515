"""Arrays, texts, cells and structs in a MATLAB file of version 7.3, which is an HDF5
file, read by the package h5py.

Function handles and instances of classes are skipped, links out of the file refused.
"""

from __future__ import annotations

import io
from collections.abc import Collection
from typing import Any

import numpy as np

from geomech.io.tables.matlab import DEEPEST, LARGEST
from rft.core.refusal import Refusal

MOST_NODES = 5_000  # some seconds of reading; files of sysplotter have some hundreds
CURE = "pip install 'geomech[hdf5]', or save it in MATLAB with save(FILE, ..., '-v7')"
ANEW = "save it in MATLAB again with save(FILE, ..., '-v7')"


def arrays(raw: bytes, names: Collection[str]) -> dict[str, Any]:
    """Return the variables that have one of ``names``, with values as of
    `geomech.io.tables.matlab.arrays`. Refusal for a damaged file, or without h5py."""
    try:
        import h5py
    except ImportError:
        raise Refusal(
            "is a MATLAB 7.3 (HDF5) file",
            because="the package h5py, which is needed to read it, is not installed",
            instead=CURE,
        ) from None
    try:
        with h5py.File(io.BytesIO(raw), "r") as file:
            reader = Reader(file)
            return {
                name: reader.member(file, name, DEEPEST)
                for name in file
                if name in names
            }
    except Refusal:
        raise
    except Exception:  # HDF5 raises errors of all kinds for a damaged file
        raise Refusal(
            "is a damaged MATLAB 7.3 (HDF5) fileor incomplete", instead=ANEW
        ) from None


class Reader:
    """Reader of the nodes of one file, within limits.

    bytes_left: that may still be read, inflated. nodes_left: groups, arrays and
    references that may still be met. values_read: of the nodes met so far, as a few
    cells of cells can name one node a million times."""

    def __init__(self, file: Any):
        self.file = file
        self.bytes_left = LARGEST
        self.nodes_left = MOST_NODES
        self.values_read: dict[Any, Any] = {}

    def member(self, group: Any, name: str, depth: int) -> Any:
        """Return the value of a node in a group; Refusal, with its place, if it cannot
        be read."""
        import h5py

        place = f"{group.name.rstrip('/')}/{name}".lstrip("/").replace("/", ".")
        try:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise Refusal(f"has {place} in another file")
            return self.value(group[name], place, depth)
        except Refusal:
            raise
        except Exception:
            raise Refusal(f"is damaged at {place}", instead=ANEW) from None

    def value(self, node: Any, place: str, depth: int) -> Any:
        """Return an array, a text, a cell or a struct; None for anything else.
        depth: of cells and structs that may still lie within."""
        self.nodes_left -= 1
        self._require_nodes(0)
        if node not in self.values_read:
            self.values_read[node] = self._value(node, place, depth)
        return self.values_read[node]

    def _require_nodes(self, count: int) -> None:
        """Refusal unless ``count`` nodes may still be met."""
        if self.nodes_left < count:
            reason = f"it has more than {MOST_NODES:,} cells and fields"
            raise Refusal("is too large or damaged", because=reason, instead=ANEW)

    def _value(self, node: Any, place: str, depth: int) -> Any:
        """Return the value of a node that is met for the first time."""
        import h5py

        if not depth:
            raise Refusal(
                f"is damaged at {place}", because="it contains itself", instead=ANEW
            )
        if "MATLAB_object_decode" in node.attrs:
            return None
        if isinstance(node, h5py.Group):
            return {name: self.member(node, name, depth - 1) for name in node}
        kind = bytes(node.attrs.get("MATLAB_class", b"")).decode("latin-1")
        if kind == "function_handle" or node.is_virtual or node.external:
            return None
        if "MATLAB_empty" in node.attrs:
            return "" if kind == "char" else np.zeros((0, 0))
        values = self._read(node, place)
        if kind == "cell" and values.dtype == object:
            return self._cell(values, place, depth)
        if kind == "char" and values.dtype.kind in "ui":
            return values.ravel().astype("<u2").tobytes().decode("utf-16-le", "replace")
        return values if kind and values.dtype.kind in "iuf" else None

    def _read(self, node: Any, place: str) -> np.ndarray:
        """Return the values of a dataset, with MATLAB's first axis, which HDF5 has
        last, as the first."""
        self.bytes_left -= node.size * node.dtype.itemsize
        if self.bytes_left < 0:
            raise Refusal(f"is too large, or is damaged at {place}", instead=ANEW)
        return np.asarray(node[()]).T

    def _cell(self, references: np.ndarray, place: str, depth: int) -> np.ndarray:
        self._require_nodes(references.size)
        values = np.empty(references.shape, object)
        for index in np.ndindex(references.shape):
            label = ", ".join(str(k + 1) for k in index)
            inner_place = f"{place}{{{label}}}"
            try:
                node = self.file[references[index]]
                values[index] = self.value(node, inner_place, depth - 1)
            except Refusal:
                raise
            except Exception:
                raise Refusal(f"is damaged at {inner_place}", instead=ANEW) from None
        return values
