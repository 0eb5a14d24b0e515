"""The passive callback of MuJoCo, one for all models of the process, and the beds of
sand that it serves.

In compiled code the callback looks a model up by its address in `TABLE`; without numba
a function of Python does the same. A row is written before its model's address and is
never moved, so that other threads may step meanwhile."""

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
from rft.core.refusal import require
from rft.mujoco import numpy_step
from rft.mujoco.addresses import check_places, functions, places, takes_data
from rft.mujoco.bed import Bed
from rft.mujoco.footprints import Prints
from rft.mujoco.implicit import ACCURACY, SOLVED, UNSOLVED
from rft.mujoco.layout import (
    COARSER_STEPS,
    GEOM,
    ITERATIONS,
    MOST_ITERATIONS,
    N_COUNTS,
    NAMES,
    RESIDUAL,
    STEPS,
    TIME,
    UNSOLVED_STEPS,
    WATCHED_HEAD,
    WATCHED_RESIDUAL,
    WATCHED_ROUNDING,
    WATCHED_STATUS,
)
from rft.mujoco.model_parts import ModelParts
from rft.terradynamics.meshes.contact import record

ROWS = 4096  # beds of sand at one time
# layouts of detached beds that are kept, for a step of another thread that is still
# under way
RETIRED = 64
REMOVED = -1  # in place of a model's address

TABLE = np.zeros((ROWS + 1, 3), np.int64)


class Layout(NamedTuple):
    """What compiled code reads of a bed: `numbers`, int64, hold sizes and the addresses
    of the arrays, which are kept by name (`rft.mujoco.layout`)."""

    numbers: np.ndarray
    arrays: dict[str, np.ndarray]


class Effort(NamedTuple):
    """What the steps of a bed have cost so far.

    steps: with a geom in the ground. iterations: of Newton's method, and
    most_iterations in a step. coarser: steps that were solved loosely, within 3e-4, or
    at a wider rounding alone. unsolved: steps that were not solved. residual: largest
    residual of a step, over the forces without grains."""

    steps: int
    iterations: int
    most_iterations: int
    coarser: int
    unsolved: int
    residual: float


class Seen(NamedTuple):
    """What the grains do in a step: residual, status and rounding as of
    `rft.mujoco.implicit.Result`; wrenches and twists at its end (G, 6), along the
    geoms' axes."""

    residual: float
    status: int
    rounding: float
    wrenches: np.ndarray
    twists: np.ndarray


class Entry(NamedTuple):
    """A bed in a row of the table. parts: of its model. bed: the sand. form: (G, 5), of its geoms as their elements were
    made for. layout: for compiled code. counts: (N_COUNTS,), of steps. largest: (1,), of their residuals. end: removes
    the bed when the model is gone."""

    parts: ModelParts
    bed: Bed
    form: np.ndarray
    layout: Layout | None
    counts: np.ndarray
    largest: np.ndarray
    end: weakref.finalize


_entries: dict[int, Entry] = {}
_retired: deque[Entry] = deque(maxlen=RETIRED)
_lock = threading.RLock()
_active: list = []  # the callback that is installed, and what it needs
_watching: dict[
    int, int
] = {}  # addresses of data whose next step is to be seen, by row
_seen_by_python: dict[int, np.ndarray] = {}


def install(model: mujoco.MjModel, bed: Bed) -> int:
    """Let the callback serve a bed under a model until `remove`, or until the model is
    gone; return its row."""
    with _lock:
        compiled = serves_compiled()
        check_places(mujoco.MjData(model))
        parts, counts = ModelParts.of(model), np.zeros(N_COUNTS, np.int64)
        largest = np.zeros(1)
        layout = layout_of(parts, bed, counts, largest) if compiled else None
        _set_callback(compiled)
        row = next((k for k in range(ROWS) if TABLE[k, 0] in (0, REMOVED)), ROWS)
        require(row < ROWS, f"{ROWS} beds of sand are in use", instead="detach some")
        end = weakref.finalize(model, remove, row)
        end.atexit = False
        form = parts.form(bed.geoms)
        _entries[row] = Entry(parts, bed, form, layout, counts, largest, end)
        if layout:
            from rft.mujoco.compiled import kernel

            TABLE[row, 1:] = kernel().address, layout.numbers.ctypes.data
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
            entry.layout.arrays["laws"][:] = _laws(bed)


def is_installed(row: int) -> bool:
    """Return whether the callback serves the bed of a row now."""
    return row in _entries and bool(_active) and mujoco.get_mjcb_passive() is _active[0]


def beds(model: mujoco.MjModel) -> list[Bed]:
    """Return all beds under a model."""
    return [
        entry.bed
        for entry in _entries.values()
        if entry.parts.address == model._address
    ]


def effort(row: int) -> Effort:
    """Return what the steps of the bed of a row have cost so far; zeros for one that is
    removed."""
    entry = _entries.get(row)
    if entry is None:
        return Effort(*[0] * N_COUNTS, residual=0.0)
    return Effort(*entry.counts.tolist(), residual=float(entry.largest[0]))


def see(row: int, model: mujoco.MjModel, data: mujoco.MjData) -> Seen:
    """Return what the grains do in the step that begins at data that are up to date."""
    with _lock:
        entry = _entries[row]
        count = len(entry.bed.geoms)
        watched = np.zeros(WATCHED_HEAD + 12 * count)
        watched[WATCHED_ROUNDING] = entry.bed.ground.rounding
        if entry.layout:
            entry.layout.arrays["watched"][:] = watched
            entry.layout.arrays["watch"][0] = data._address
        _watching[row] = data._address
        try:
            mujoco.mj_passive(model, data)
        finally:
            del _watching[row]
            if entry.layout:
                entry.layout.arrays["watch"][0] = 0
        watched = entry.layout.arrays["watched"].copy() if entry.layout else watched
        watched = _seen_by_python.pop(row, watched)
        wrenches, twists = np.split(watched[WATCHED_HEAD:].reshape(count, 12), 2, 1)
        return Seen(
            float(watched[WATCHED_RESIDUAL]),
            int(watched[WATCHED_STATUS]),
            float(watched[WATCHED_ROUNDING]),
            wrenches,
            twists,
        )


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
    """Add the forces of all beds under the model at an address, without numba. A fault
    detaches its bed and is told in one line. MuJoCo's own callbacks of Python let no
    other model be compiled; this one, of addresses alone, does."""
    for row, entry in [*_entries.items()]:
        if entry.parts.address == model:
            try:
                _add_by_python(row, entry, data)
            except Exception as error:
                remove(row)
                warnings.warn(
                    f"the sand is detached: {type(error).__name__}: {error}",
                    Note,
                    stacklevel=2,
                )


def _add_by_python(row: int, entry: Entry, data: int) -> None:
    """Add the forces of a bed, and keep what is seen of them or count the step."""
    now = entry.parts.form(entry.bed.geoms)
    if not np.array_equal(now, entry.form):
        remove(row)
        _warn_changed(entry.bed, now, entry.form)
        return
    found = numpy_step.add_forces(entry.bed, entry.parts, data)
    if found is None:
        return
    result, geom, wrenches, twists = found
    if _watching.get(row) == data:
        head = [result.residual, result.status, result.rounding]
        both = np.concatenate([wrenches, twists], 1)
        _seen_by_python[row] = np.concatenate([head, both.ravel()])
        return
    counts = entry.counts
    counts[STEPS] += 1
    counts[ITERATIONS] += result.iterations
    counts[MOST_ITERATIONS] = max(counts[MOST_ITERATIONS], result.iterations)
    entry.largest[0] = max(entry.largest[0], result.residual)
    if result.status != SOLVED:
        is_unsolved = result.status == UNSOLVED
        counts[UNSOLVED_STEPS if is_unsolved else COARSER_STEPS] += 1
        if is_unsolved and counts[UNSOLVED_STEPS] == 1:
            time = numpy_step.Arrays(data, entry.parts.sizes).time
            _tell(time, result.residual, entry.bed.names[geom])


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _tell_unsolved(_data: int, unsolved: int) -> None:
    """Tell once that a step of a bed is not solved; compiled code calls this with the
    address of what it says."""
    for entry in [*_entries.values()]:
        layout = entry.layout
        if layout and layout.arrays["unsolved"].ctypes.data == unsolved:
            said = layout.arrays["unsolved"]
            _tell(said[TIME], said[RESIDUAL], entry.bed.names[int(said[GEOM])])


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _tell_changed(_data: int, layout: int) -> None:
    """Detach a bed with a geom that has changed; compiled code calls this with the
    address of its layout."""
    for row, entry in [*_entries.items()]:
        if entry.layout and entry.layout.numbers.ctypes.data == layout:
            remove(row)
            now, before = entry.parts.form(entry.bed.geoms), entry.layout.arrays["form"]
            _warn_changed(entry.bed, now, before)


def _warn_changed(bed: Bed, now: np.ndarray, before: np.ndarray) -> None:
    """Warn that a bed is detached since a geom has changed."""
    first = int(np.flatnonzero((now != before).any(1))[0])
    line = (
        f"the sand is detached: the geom {bed.names[first]} changed after attach:"
        " attach it anew"
    )
    warnings.warn(line, Note, stacklevel=2)


def _tell(time: float, residual: float, geom: str) -> None:
    """Warn about a step that is not solved."""
    line = (
        f"the step at {time:.6g} s is not solved: the forces, of which the grains'"
        f" on {geom} are the largest, miss balance by {100 * residual:.2g} %; sand.effort"
        " counts such steps, shorter ones are easier"
    )
    warnings.warn(line, Note, stacklevel=2)


def layout_of(
    parts: ModelParts, bed: Bed, counts: np.ndarray, largest: np.ndarray
) -> Layout:
    """Return the layout of a bed under a model, whose steps write `Entry.counts` and
    `Entry.largest`."""
    from rft.mujoco.compiled import kernel
    from rft.mujoco.compiled_parts import element_code
    from rft.mujoco.compiled_solver import solver_code

    kernel()
    (table, first), ground = bed.blocks.rows, bed.ground
    moved, count = bed.moved_by, len(bed.geoms)
    arrays = {
        "table": table,
        "row_spheres": bed.blocks.row_spheres,
        "first": first.astype(np.int64),
        "geoms": np.stack([bed.geoms, bed.bodies, bed.roots], -1),
        "spheres": bed.spheres,
        "dofs": np.concatenate([np.flatnonzero(one) for one in moved]).astype(np.int64),
        "first_dof": np.concatenate([[0], np.cumsum(moved.sum(1))]).astype(np.int64),
        "bodies": parts.bodies,
        "parents": parts.parents,
        "trees": parts.trees,
        "laws": _laws(bed),
        "form": parts.form(bed.geoms),
        "ground": np.array([*ground[:5], ground.rounding, ACCURACY]),
        "disturbed": np.array(ground.disturbed, float),
        "surface": np.array([*bed.up, *bed.ahead, bed.level]),
        "hills": bed.hills.grid,
        "hill_frame": bed.hills.frame,
        "planes": bed.zones.planes,
        "first_plane": bed.zones.first,
        "derivative_rows": parts.derivative_rows,
        "derivative_columns": parts.derivative_columns,
        "counts": counts,
        "largest": largest,
        "watch": np.zeros(1, np.int64),
        "watched": np.zeros(WATCHED_HEAD + 12 * count),
        "unsolved": np.zeros(3),
    }
    if bed.prints:
        names = "print_grid", "print_surface", "print_points", "print_first"
        arrays |= dict(zip(names, bed.prints[2:]))
    arrays = {name: np.ascontiguousarray(x) for name, x in arrays.items()}
    where = places()
    values = {name: parts.sizes[name] for name in ("nv", "ngeom", "nbody", "is_sparse")}
    values |= {
        "n_table": len(table),
        "n_geoms": count,
        "n_dofs": len(arrays["dofs"]),
        "n_derivative": parts.sizes["nD"],
        "disturbed_rows": arrays["disturbed"].shape[0],
        "disturbed_columns": arrays["disturbed"].shape[1],
        "hill_rows": bed.hills.grid.shape[0],
        "hill_columns": bed.hills.grid.shape[1],
        "n_zones": len(bed.laws),
        "n_planes": len(bed.zones.planes),
        "n_numbers": arrays["laws"].shape[1],
        "element_code": element_code(_form(bed)).address,
        "solver_code": solver_code().address,
        "model": parts.address,
        "timestep": parts.timestep,
        "integrator": parts.integrator,
        "disableflags": parts.disableflags,
        "damping": parts.damping,
        "full_takes_data": takes_data(),
        "no_euler_damping": int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP),
        "geom_size": parts.geom_size,
        "geom_type": parts.geom_type,
        "geom_dataid": parts.geom_dataid,
        "report": ctypes.cast(_tell_unsolved, ctypes.c_void_p).value,
        "report_changed": ctypes.cast(_tell_changed, ctypes.c_void_p).value,
        "time": where.time,
    }
    values |= {name: x.ctypes.data for name, x in arrays.items()}
    values |= where.arrays | where.counts | functions()
    values |= {f"contact_{name}": x for name, x in where.contacts._asdict().items()}
    values |= _print_numbers(parts, bed.prints) if bed.prints else {}
    numbers = np.array([values.get(name, 0) for name in NAMES], np.int64)
    return Layout(numbers, arrays)


def _print_numbers(parts: ModelParts, prints: Prints) -> dict[str, int]:
    """Return the numbers of a layout by which footprints are remembered."""
    from rft.mujoco.compiled import recorder

    rows, columns = prints.shape
    return {
        "recorder": recorder().address,
        "memory_start": parts.sizes["nuserdata"] - prints.numbers,
        "print_rows": rows,
        "print_columns": columns,
    }


def _form(bed: Bed) -> type:
    """Return the class of the records of a bed's laws."""
    return type(record(bed.laws[0]))


def _laws(bed: Bed) -> np.ndarray:
    """Return the numbers of a bed's laws, and the sine of the grazing angle of each in
    the last column."""
    return np.array([[*record(law), law.grazing_sine] for law in bed.laws], float)
