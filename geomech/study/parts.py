"""Results of what is computed side by side (`geomech.workers.each`), kept as they come: a request that was stopped takes them
up in place of computing them again.

A block of the file (`geomech.study.kept`) is a part, all numbers: which one it is, and its result, each number and array of
it with its kind before it. Nothing in it is code.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import itertools
import json
import math
import os
import re
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np

from geomech import __version__
from geomech.kinds import code
from geomech.scene.model import Scene
from geomech.scene.read import inputs
from geomech.study import kept
from geomech.workers.solving import SOLVER, settled_on

if TYPE_CHECKING:
    from geomech.scene.intruding import Intruding
    from geomech.scene.walker import WalkerScene

LARGEST = 1_000_000_000  # bytes of a file; what is beyond is computed again
BACK_ENDS = ("", "numpy", "numba")
TUPLE, FLOAT, WHOLE, ARRAY, NOTHING = range(5)  # kinds of a result


def asking(scene: Scene | Intruding | WalkerScene, **asked: Any) -> dict:
    """All that the numbers of a request follow from: the code, the scene with the files that it names, and what is asked
    (JSON)."""
    parts = _of_system(scene) if isinstance(scene, Scene) else _fields(scene, "name", "text", "files")
    own = {"own code": code()} if code() else {}
    files = [x for x in inputs(scene) if x != Path(scene.name) and x.is_file()]
    read = {"files": [hashlib.sha256(x.read_bytes()).hexdigest() for x in files]} if files else {}
    return {"geomech": __version__, "solver": SOLVER, **own, "scene": scene.text, **read, **parts, **asked}


def _of_system(scene: Scene) -> dict[str, str]:
    system, numerics = scene.system, f"{scene.numerics}, {scene.system.solver}"
    return {"system": system.kind, **_fields(system, "solver"), "gait": repr(scene.gait), "numerics": numerics}


def _fields(thing: Any, *but: str) -> dict[str, str]:
    return {f.name: repr(getattr(thing, f.name)) for f in dataclasses.fields(thing) if f.name not in but}


class Part(NamedTuple):
    """Which one. call: of `each`, in their order; number: among those of it, of ``parts``; by: the back end; settled:
    that of many parts by then, if there is one; of, at: `mark` of what all of the call share, and of its own."""

    call: int
    number: int
    parts: int
    by: int
    settled: int
    of: int
    at: int


class Parts(kept.Kept):
    """The parts of a request that are done, saved to ``path`` every now and then, and when it ends before its time. It is the
    caller's to remove, once the results are saved. settled: the back end of what is taken up."""

    what = "computation"

    def __init__(self, path: Path, question: dict):
        super().__init__(path, question)
        self.calls, self.begun = 0, 0  # begun: parts of all calls so far
        self.fresh: list[np.ndarray] = []  # of so many bytes in the file:
        self.fresh_size = 0
        self.places: dict[tuple[int, int], int] = {}  # where in the file the part (call, number) is
        if found := kept.read_from(path, lambda file: _index(file, json.loads(json.dumps(question)))):
            self.settled, self.places, self.end = found
        self.count = self.saved = len(self.places)

    def each(self, call: tuple, back_end: str, items: Iterable, parts: int, computed: Callable) -> Iterator:
        """The results of ``parts`` items, in their order: what is kept of them, then what computed(items) gives for the rest.
        call: all that they follow from."""
        by, settled = map(BACK_ENDS.index, (back_end, self.settled))
        which = Part(self.calls, 0, parts, by, settled, mark(call), 0)
        self.calls, self.begun, done, marks = self.calls + 1, self.begun + parts, 0, deque()
        for item in items:
            part = which._replace(number=done, at=mark(item))
            found = self._taken(part)
            if found is None:
                items = itertools.chain([item], items)
                break
            yield found[0]
            done += 1
        for number, found in enumerate(computed(_watched(items, marks)), done):
            self._add(which._replace(number=number, at=marks.popleft()), found)
            yield found

    def in_turn(self, what: str, compute: Callable, start: Any) -> Any:
        """What compute() gives, one by one (`rft.in_turn`): a part by itself."""
        return next(self.each((what,), settled_on(), [start], 1, lambda rest: (compute() for _ in rest)))

    def _taken(self, part: Part) -> tuple | None:
        """(its result,) if that is kept."""
        if (part.call, part.number) not in self.places:
            return None
        with contextlib.suppress(OSError, ValueError, StopIteration), self.path.open("rb") as file:
            file.seek(self.places[part.call, part.number])
            said, found = _read(next(kept.blocks(file, 1)))
            return (found,) if said._replace(settled=part.settled) == part else None

    def _add(self, part: Part, found: Any) -> None:
        if self.told:  # the disk is full: so need not be the memory
            self.fresh = []
            return
        with contextlib.suppress(TypeError):  # of what is no number nothing is kept
            block = np.concatenate([np.array(part, float), *_numbers(found)])
            size = self.fresh_size + block.nbytes + kept.BLOCK.size
            if self.end + size <= LARGEST:
                self.fresh.append(block)
                self.count, self.fresh_size = self.saved + len(self.fresh), size
        self.save()

    def unsaved(self) -> list[np.ndarray]:
        return self.fresh

    def forget(self, end: int) -> None:
        self.end, self.saved, self.fresh, self.fresh_size = end, self.count, [], 0

    def __exit__(self, kind, error, _) -> None:
        if error and (self.saved or not isinstance(error, Exception)):  # what is refused soon leaves nothing
            self.save(always=True)
        if error and self.saved:
            of = f"{self.saved} of {max(self.begun, self.saved)} parts so far"
            error.add_note(f"{of} are kept in {self.path}: the same command goes on from there")


def mark(thing: Any) -> int:
    """A checksum of arrays to the last digit, of anything else as it shows itself, wherever in memory it is."""
    if isinstance(thing, np.ndarray):
        return zlib.crc32(np.ascontiguousarray(thing).tobytes(), len(thing.shape))
    if isinstance(thing, tuple):
        return zlib.crc32(np.array([mark(x) for x in thing], "<u4").tobytes(), len(thing))
    return zlib.crc32(re.sub(r" at 0x[0-9a-fA-F]+", "", repr(thing)).encode(errors="backslashreplace"))


def _watched(items: Iterable, marks: deque) -> Iterator:
    for item in items:
        marks.append(mark(item))
        yield item


def _numbers(found: Any) -> Iterator[np.ndarray]:
    """A result as arrays of float, to be put one behind the other; TypeError for what is not made of numbers, or of tuples
    that have names."""
    if found is None:
        yield np.array([NOTHING, 0.0])
    elif type(found) is tuple:
        yield np.array([TUPLE, len(found)], float)
        for x in found:
            yield from _numbers(x)
    elif isinstance(found, np.ndarray) and found.dtype == np.float64:
        yield np.array([ARRAY, found.ndim, *found.shape], float)
        yield found.ravel()
    elif type(found) is int:
        yield np.array([WHOLE, found], float)
    elif type(found) is float:
        yield np.array([FLOAT, found])
    else:
        raise TypeError(f"no number: {type(found).__name__}")


def _read(block: np.ndarray) -> tuple[Part, Any]:
    """A part and its result; ValueError unless the block is just that."""
    values, n = block.ravel(), len(Part._fields)
    part = Part(*map(_whole, _first(n, values)))
    found, left = _result(values[n:])
    if len(left) or max(part.by, part.settled) >= len(BACK_ENDS):
        raise _foreign()
    return part, found


def _result(values: np.ndarray) -> tuple[Any, np.ndarray]:
    """What the first numbers stand for, and those behind."""
    (kind, x), rest = _first(2, values), values[2:]
    if kind == FLOAT:
        return float(x), rest
    count = _whole(x)
    if kind == WHOLE:
        return count, rest
    if kind == NOTHING:
        return None, rest
    if kind == TUPLE:
        found = []
        for _ in range(count):
            one, rest = _result(rest)
            found.append(one)
        return tuple(found), rest
    if kind != ARRAY:
        raise _foreign()
    shape, rest = tuple(map(_whole, _first(count, rest))), rest[count:]
    size = math.prod(shape)
    return np.array(_first(size, rest)).reshape(shape), rest[size:]


def _first(count: int, values: np.ndarray) -> np.ndarray:
    if count > len(values):
        raise _foreign()
    return values[:count]


def _whole(x: float) -> int:
    if not (0 <= x < 2**53 and x == int(x)):
        raise _foreign()
    return int(x)


def _foreign() -> Exception:
    return kept.Unbelievable("its parts are not those of a request")


def _index(file: BinaryIO, question: dict) -> tuple[str, dict, int]:
    """(back end, places of parts, bytes of them) of a file, every block of which is looked at."""
    if file.seek(0, os.SEEK_END) > LARGEST + kept.LARGEST:
        raise kept.Unbelievable("it is too large")
    file.seek(0)
    settled, places = kept.settled_in(file, question), {}
    place = file.tell()
    for block in kept.blocks(file, 1):
        part, _ = _read(block)
        places[part.call, part.number], place = place, file.tell()
        settled = BACK_ENDS[part.settled]
    return settled, places, place
