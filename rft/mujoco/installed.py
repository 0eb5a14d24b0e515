"""The passive callback of MuJoCo, one for all models of the process, and the beds of sand that it serves.

In compiled code the callback looks a model up by its address in `TABLE`; without numba a function of Python does the same.
A row is written before its model's address and is never moved, so that other threads may step meanwhile."""

from __future__ import annotations

import atexit
import ctypes
import functools
import threading
import warnings
import weakref
from collections import deque
from typing import NamedTuple

import mujoco
import numpy as np

from rft.balance.backend import Note, compiles
from rft.meshes.contact import record
from rft.mujoco.addresses import (
    Arrays,
    check_offsets,
    memory_offsets,
    offsets,
    time_step,
)
from rft.mujoco.bed import FASTEST, Bed
from rft.mujoco.footprints import Prints
from rft.refusal import require

ROWS = 4096  # beds of sand at one time
RETIRED = 64  # layouts of detached beds that are kept, for a step of another thread that is still under way
LAWS = 5  # place of the laws' numbers in the arrays of a `Layout`
REMOVED = -1  # in place of a model's address

TABLE = np.zeros((ROWS + 1, 3), np.int64)


class Layout(NamedTuple):
    """What compiled code reads of a bed: `numbers`, int64, hold sizes and the addresses of the arrays. fast: (1,), number of
    times that a geom was faster than `FASTEST`."""

    numbers: np.ndarray
    arrays: tuple
    fast: np.ndarray


class Entry(NamedTuple):
    """A bed in a row of the table. address: of its model. sizes: nv, ngeom and nbody of the model. end: removes the bed
    when the model is gone."""

    address: int
    sizes: tuple[int, int, int]
    bed: Bed
    layout: Layout | None
    end: weakref.finalize


_entries: dict[int, Entry] = {}
_retired: deque[Entry] = deque(maxlen=RETIRED)
_lock = threading.RLock()
_active: list = []  # the callback that is installed, and what it needs


def install(model: mujoco.MjModel, bed: Bed) -> int:
    """Let the callback serve a bed under a model until `remove`, or until the model is gone; return its row."""
    with _lock:
        compiled = serves_compiled()
        check_offsets(mujoco.MjData(model), bed.remembered > 0)
        layout = layout_of(model, bed) if compiled else None  # compiles
        _set_callback(compiled)
        row = next((k for k in range(ROWS) if TABLE[k, 0] in (0, REMOVED)), ROWS)
        require(row < ROWS, f"{ROWS} beds of sand are in use", instead="detach some")
        end = weakref.finalize(model, remove, row)
        end.atexit = False
        _entries[row] = Entry(
            model._address, (model.nv, model.ngeom, model.nbody), bed, layout, end
        )
        if layout:
            from rft.mujoco.compiled import kernel

            TABLE[row, 1:] = kernel(*_form(bed)).address, layout.numbers.ctypes.data
        TABLE[row, 0] = model._address
        return row


def remove(row: int) -> None:
    """Take a bed out of the table; the last one takes the callback with it."""
    with _lock:
        if (entry := _entries.pop(row, None)) is None:
            return
        TABLE[row, 0] = REMOVED
        entry.end.detach()
        _retired.append(entry)
        if not _entries:
            _clear_callback()


def change(row: int, bed: Bed) -> None:
    """Give a row a bed with another law of the same form, without compiling."""
    with _lock:
        entry = _entries[row]
        _entries[row] = entry._replace(bed=bed)
        if entry.layout:
            entry.layout.arrays[LAWS][:] = _laws(bed)


def is_installed(row: int) -> bool:
    """Return whether the callback serves the bed of a row now."""
    return row in _entries and bool(_active) and mujoco.get_mjcb_passive() is _active[0]


def beds(model: mujoco.MjModel) -> list[Bed]:
    """Return all beds under a model."""
    return [entry.bed for entry in _entries.values() if entry.address == model._address]


def times_too_fast(row: int) -> int:
    """Return how often a geom of the bed of a row was faster than `FASTEST`."""
    entry = _entries.get(row)
    return int(entry.layout.fast[0]) if entry and entry.layout else 0


def serves_compiled() -> bool:
    """Return whether the callback is compiled code, or would be."""
    return (
        next(iter(_entries.values())).layout is not None
        if _entries
        else compiles("auto", ())
    )


def _set_callback(compiled: bool) -> None:
    """Install the callback; Refusal if there is another one."""
    now = mujoco.get_mjcb_passive()
    if _active and now is _active[0]:
        return
    require(
        now is None,
        "another passive callback is installed",
        because="MuJoCo has one for all models",
        instead="mujoco.set_mjcb_passive(None)",
    )
    _active[:] = _compiled_callback() if compiled else [_by_python]
    mujoco.set_mjcb_passive(_active[0])


def _clear_callback() -> None:
    if _active and mujoco.get_mjcb_passive() is _active[0]:
        mujoco.set_mjcb_passive(None)
    _active.clear()


atexit.register(_clear_callback)


@functools.cache
def _compiled_callback() -> tuple:
    """Return the compiled callback and the code that it lives in."""
    from rft.mujoco.compiled import dispatcher

    code = dispatcher(TABLE)
    return code.ctypes, code


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _by_python(model: int, data: int) -> None:
    """Add the forces of all beds under the model at an address, without numba. A fault detaches its bed and is told in one
    line. MuJoCo's own callbacks of Python let no other model be compiled; this one, of addresses alone, does."""
    for row, entry in [*_entries.items()]:
        if entry.address == model:
            try:
                entry.bed.add_forces(Arrays.at(data, *entry.sizes))
            except Exception as error:
                remove(row)
                warnings.warn(
                    f"the sand is detached: {type(error).__name__}: {error}",
                    Note,
                    stacklevel=2,
                )


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _tell_too_fast(_data, _layout) -> None:
    """Tell once that a geom moves faster than anything that sand acts upon; compiled code calls this."""
    line = f"a geom in the sand is faster than {FASTEST:g} m/s: the time step is too long, or the rounding too small"
    warnings.warn(line, Note, stacklevel=2)


def layout_of(model: mujoco.MjModel, bed: Bed) -> Layout:
    """Return the layout of a bed under a model, in the order in which `rft.mujoco.compiled.kernel` reads it."""
    from rft.mujoco.compiled import kernel

    kernel(*_form(bed))
    (table, first), ground, fast = bed.blocks.rows, bed.ground, np.zeros(1, np.int64)
    report = ctypes.cast(_tell_too_fast, ctypes.c_void_p).value
    arrays = [
        table,
        first.astype(np.int64),
        np.stack([bed.geoms, bed.bodies, bed.roots, bed.dofs], -1),
        bed.spheres,
        bed.parents,
        _laws(bed),
        np.array([*ground[:5], *bed.up, *bed.ahead, bed.level, FASTEST]),
        np.array(ground.disturbed, float),
        fast,
        *bed.hills,
        *bed.zones,
        *(bed.prints[2:] if bed.prints else ()),
        *((*bed.rest[:-1], time_step(model)) if bed.rest else ()),
    ]
    arrays = [np.ascontiguousarray(x) for x in arrays]
    addresses = [x.ctypes.data for x in arrays]
    sizes = [model.nv, model.ngeom, model.nbody, len(table), len(bed.geoms)]
    numbers = [
        *offsets(),
        *sizes,
        *addresses[:8],
        *arrays[7].shape,
        addresses[8],
        report,
    ]
    numbers += [addresses[9], *bed.hills.grid.shape[:2], addresses[10]]
    numbers += [*addresses[11:13], len(bed.zones.planes), len(bed.laws)]
    numbers += (
        _print_numbers(model, bed.prints, addresses[13:17]) if bed.prints else [0] * 10
    )
    numbers += (
        [*_memory(model, bed.remembered), *addresses[-4:]] if bed.rest else [0] * 7
    )
    return Layout(np.array(numbers, np.int64), tuple(arrays), arrays[8])


def _print_numbers(
    model: mujoco.MjModel, prints: Prints, addresses: list[int]
) -> list[int]:
    """Return the numbers of a layout by which footprints are remembered."""
    from rft.mujoco.compiled import recorder

    time, userdata, start = _memory(model, prints.numbers)
    return [recorder().address, userdata, start, *prints.shape, *addresses, time]


def _memory(model: mujoco.MjModel, count: int) -> tuple[int, int, int]:
    """Return the places of time and userdata in an mjData, and where its last ``count`` numbers begin."""
    return *memory_offsets(), model.nuserdata - count


def _form(bed: Bed) -> tuple[type, bool]:
    """Return the class of the records of a bed's laws, and whether there are several."""
    return type(record(bed.laws[0])), len(bed.laws) > 1


def _laws(bed: Bed) -> np.ndarray:
    """Return the numbers of a bed's laws, and the sine of the grazing angle of each in the last column."""
    return np.array([[*record(law), law.grazing_sine] for law in bed.laws], float)
