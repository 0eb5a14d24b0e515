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
import weakref
from collections import deque
from typing import NamedTuple

import mujoco
import numpy as np

from rft.balance.backend import compiles
from rft.core.notes import warn
from rft.core.refusal import require
from rft.mujoco import numpy_step
from rft.mujoco.bed import Bed
from rft.mujoco.ground.footprints import Prints
from rft.mujoco.memory.addresses import (
    check_places,
    full_m_takes_data,
    functions,
    places,
)
from rft.mujoco.memory.layout import (
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
from rft.mujoco.memory.model_parts import ModelParts
from rft.mujoco.step.implicit import ACCURACY, COARSER, UNSOLVED, Result
from rft.terradynamics.meshes.forces.contact import record

ROWS = 4096  # beds of sand at one time
# Layouts of detached beds that are kept, for a step of another thread that is still
# under way.
RETIRED = 64
REMOVED = -1  # in place of a model's address

TABLE = np.zeros((ROWS + 1, 3), np.int64)


class Layout(NamedTuple):
    """What compiled code reads of a bed: `numbers`, int64, hold sizes and the addresses
    of the arrays, which are kept by name (`rft.mujoco.memory.layout`)."""

    numbers: np.ndarray
    arrays: dict[str, np.ndarray]


class Effort(NamedTuple):
    """Cost of the steps of a bed so far.

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


class Observation(NamedTuple):
    """What the grains do in one step.

    residual, status, rounding: as of `rft.mujoco.step.implicit.Result`. wrenches,
    twists: (G, 6), along the geoms' axes, at the end of the step."""

    residual: float
    status: int
    rounding: float
    wrenches: np.ndarray
    twists: np.ndarray


class Entry(NamedTuple):
    """A bed in a row of the table.

    parts: of its model. shapes: (G, 5), numbers of its geoms that the elements were
    made for. layout: for compiled code. counts: (N_COUNTS,), of steps. largest: (1,),
    of their residuals. finalizer: removes the bed when the model is gone."""

    parts: ModelParts
    bed: Bed
    shapes: np.ndarray
    layout: Layout | None
    counts: np.ndarray
    largest: np.ndarray
    finalizer: weakref.finalize


_entries: dict[int, Entry] = {}
_retired: deque[Entry] = deque(maxlen=RETIRED)
_lock = threading.RLock()
_active: list = []  # the callback that is installed, and what it needs
# Addresses of data whose next step is observed, by row.
_observed_data: dict[int, int] = {}
_observed_by_python: dict[int, np.ndarray] = {}


def install(model: mujoco.MjModel, bed: Bed) -> int:
    """Let the callback serve a bed under a model until `remove`, or until the model is
    gone; return its row."""
    with _lock:
        compiled = serves_compiled()
        check_places(mujoco.MjData(model))
        parts = ModelParts.of(model)
        counts = np.zeros(N_COUNTS, np.int64)
        largest = np.zeros(1)
        layout = None
        if compiled:
            layout = layout_of(parts, bed, counts, largest)
        _set_callback(compiled)

        row = _free_row()
        finalizer = weakref.finalize(model, remove, row)
        finalizer.atexit = False
        shapes = parts.shape_numbers(bed.geoms.ids)
        _entries[row] = Entry(parts, bed, shapes, layout, counts, largest, finalizer)
        if layout:
            from rft.mujoco.step.compiled import kernel

            TABLE[row, 1] = kernel().address
            TABLE[row, 2] = layout.numbers.ctypes.data
        # Last, so that a step of another thread finds a row that is complete.
        TABLE[row, 0] = model._address
        return row


def _free_row() -> int:
    """Return the first row of the table without a bed; Refusal where all have one."""
    free = np.flatnonzero((TABLE[:ROWS, 0] == 0) | (TABLE[:ROWS, 0] == REMOVED))
    require(free.size > 0, f"{ROWS} beds of sand are in use", instead="detach some")
    return int(free[0])


def remove(row: int, bed: Bed | None = None) -> None:
    """Take a bed out of the table, unless another has its row by now; the last one
    takes the callback with it. bed: by default the one that is there."""
    with _lock:
        entry = _entries.get(row)
        if entry is None or (bed is not None and entry.bed is not bed):
            return
        del _entries[row]
        TABLE[row, 0] = REMOVED
        entry.finalizer.detach()
        _retired.append(entry)
        if not _entries:
            _clear_callback()


def replace_bed(row: int, bed: Bed) -> None:
    """Give a row a bed with another law of the same form, without compiling."""
    with _lock:
        entry = _entries[row]
        _entries[row] = entry._replace(bed=bed)
        if entry.layout:
            entry.layout.arrays["laws"][:] = _law_numbers(bed)


def is_installed(row: int, bed: Bed) -> bool:
    """Return whether the callback serves the bed in its row now."""
    entry = _entries.get(row)
    is_there = entry is not None and entry.bed is bed
    return is_there and bool(_active) and mujoco.get_mjcb_passive() is _active[0]


def beds(model: mujoco.MjModel) -> list[Bed]:
    """Return all beds under a model."""
    return [
        entry.bed
        for entry in _entries.values()
        if entry.parts.address == model._address
    ]


def effort(row: int) -> Effort:
    """Return the cost of the steps of a row's bed so far; zeros for a removed one."""
    entry = _entries.get(row)
    if entry is None:
        return Effort(*[0] * N_COUNTS, residual=0.0)
    return Effort(*entry.counts.tolist(), residual=float(entry.largest[0]))


def observe(row: int, model: mujoco.MjModel, data: mujoco.MjData) -> Observation:
    """Return what the grains do in the step that begins at up-to-date data."""
    with _lock:
        entry = _entries[row]
        count = len(entry.bed.geoms)
        # Zeros and the bed's own rounding stay where no geom is in the ground.
        watched = np.zeros(WATCHED_HEAD + 12 * count)
        watched[WATCHED_ROUNDING] = entry.bed.ground.rounding
        if entry.layout:
            entry.layout.arrays["watched"][:] = watched
            entry.layout.arrays["watch"][0] = data._address
        _observed_data[row] = data._address
        try:
            mujoco.mj_passive(model, data)
        finally:
            del _observed_data[row]
            if entry.layout:
                entry.layout.arrays["watch"][0] = 0
        if entry.layout:
            watched = entry.layout.arrays["watched"].copy()
        watched = _observed_by_python.pop(row, watched)
        wrenches, twists = np.split(watched[WATCHED_HEAD:].reshape(count, 12), 2, 1)
        return Observation(
            float(watched[WATCHED_RESIDUAL]),
            int(watched[WATCHED_STATUS]),
            float(watched[WATCHED_ROUNDING]),
            wrenches,
            twists,
        )


def serves_compiled() -> bool:
    """Return whether the callback is compiled code, or would be."""
    for entry in _entries.values():
        return entry.layout is not None
    return compiles("auto", ())


def _set_callback(compiled: bool) -> None:
    """Install the callback; Refusal if there is another one."""
    present = mujoco.get_mjcb_passive()
    if _active and present is _active[0]:
        return
    require(
        present is None,
        "another passive callback is installed",
        because="MuJoCo has only one for all models",
        instead="mujoco.set_mjcb_passive(None)",
    )
    _active[:] = _compiled_callback() if compiled else [_python_callback]
    mujoco.set_mjcb_passive(_active[0])


def _clear_callback() -> None:
    if _active and mujoco.get_mjcb_passive() is _active[0]:
        mujoco.set_mjcb_passive(None)
    _active.clear()


atexit.register(_clear_callback)


@functools.cache
def _compiled_callback() -> tuple:
    """Return the compiled callback and the code that it lives in."""
    from rft.mujoco.step.compiled import dispatcher

    code = dispatcher(TABLE)
    return code.ctypes, code


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _python_callback(model: int, data: int) -> None:
    """Add the forces of all beds under the model at an address, without numba. A fault
    detaches its bed with a warning of one line."""
    # A callback of addresses, through ctypes: with one of MuJoCo's own Python callbacks
    # installed, no other model could be compiled.
    for row, entry in [*_entries.items()]:
        if entry.parts.address == model:
            try:
                _add_forces_by_python(row, entry, data)
            except Exception as error:
                remove(row)
                warn(f"the sand is detached: {type(error).__name__}: {error}")


def _add_forces_by_python(row: int, entry: Entry, data: int) -> None:
    """Add the forces of a bed; store them if the step is observed, else count it."""
    bed = entry.bed
    shapes = entry.parts.shape_numbers(bed.geoms.ids)
    if not np.array_equal(shapes, entry.shapes):
        remove(row)
        _warn_changed(bed, shapes, entry.shapes)
        return
    step = numpy_step.add_forces(bed, entry.parts, data)
    if step is None:
        return
    result, geom, wrenches, twists = step
    if _observed_data.get(row) == data:
        head = [result.residual, result.status, result.rounding]
        both = np.concatenate([wrenches, twists], 1)
        _observed_by_python[row] = np.concatenate([head, both.ravel()])
        return
    is_first_unsolved = _count_step(entry, result)
    if is_first_unsolved:
        time = numpy_step.Arrays(data, entry.parts.sizes).time
        _warn_unsolved(time, result.residual, bed.geoms.names[geom])


def _count_step(entry: Entry, result: Result) -> bool:
    """Count a step of a bed, and return whether it is the first that is not solved."""
    counts = entry.counts
    counts[STEPS] += 1
    counts[ITERATIONS] += result.iterations
    counts[MOST_ITERATIONS] = max(counts[MOST_ITERATIONS], result.iterations)
    entry.largest[0] = max(entry.largest[0], result.residual)
    if result.status == COARSER:
        counts[COARSER_STEPS] += 1
    if result.status != UNSOLVED:
        return False
    counts[UNSOLVED_STEPS] += 1
    return bool(counts[UNSOLVED_STEPS] == 1)


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _report_unsolved(_data: int, unsolved: int) -> None:
    """Warn about the first step of a bed that is not solved; compiled code calls this
    with the address of the array "unsolved" of its layout."""
    for entry in [*_entries.values()]:
        layout = entry.layout
        if layout and layout.arrays["unsolved"].ctypes.data == unsolved:
            facts = layout.arrays["unsolved"]
            name = entry.bed.geoms.names[int(facts[GEOM])]
            _warn_unsolved(facts[TIME], facts[RESIDUAL], name)


@ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
def _report_changed(_data: int, layout: int) -> None:
    """Detach a bed with a geom that has changed; compiled code calls this with the
    address of its layout."""
    for row, entry in [*_entries.items()]:
        if entry.layout and entry.layout.numbers.ctypes.data == layout:
            remove(row)
            shapes = entry.parts.shape_numbers(entry.bed.geoms.ids)
            _warn_changed(entry.bed, shapes, entry.shapes)


def _warn_changed(bed: Bed, shapes: np.ndarray, before: np.ndarray) -> None:
    """Warn that a bed is detached because a geom has changed."""
    first = int(np.flatnonzero((shapes != before).any(1))[0])
    line = (
        f"the sand is detached: the geom {bed.geoms.names[first]} changed after "
        "attach: attach it again"
    )
    warn(line)


def _warn_unsolved(time: float, residual: float, geom: str) -> None:
    """Warn about a step that is not solved."""
    line = (
        f"the step at {time:.6g} s is not solved: its forces, the largest of which "
        f"act on {geom}, are out of balance by {100 * residual:.2g} %; sand.effort "
        "counts such steps, and shorter steps are easier"
    )
    warn(line)


def layout_of(
    parts: ModelParts, bed: Bed, counts: np.ndarray, largest: np.ndarray
) -> Layout:
    """Return the layout of a bed under a model, whose steps write `Entry.counts` and
    `Entry.largest`."""
    from rft.mujoco.step.compiled import kernel

    kernel()
    arrays = _bed_arrays(parts, bed)
    arrays |= {
        "counts": counts,
        "largest": largest,
        "watch": np.zeros(1, np.int64),
        "watched": np.zeros(WATCHED_HEAD + 12 * len(bed.geoms)),
        "unsolved": np.zeros(3),
    }
    arrays = {name: np.ascontiguousarray(x) for name, x in arrays.items()}

    values = _bed_sizes(bed, arrays)
    values |= _model_numbers(parts)
    values |= _data_places()
    values |= _function_addresses(bed)
    values |= {name: x.ctypes.data for name, x in arrays.items()}
    if bed.prints:
        values |= _print_numbers(parts, bed.prints)
    numbers = np.array([values.get(name, 0) for name in NAMES], np.int64)
    return Layout(numbers, arrays)


def _bed_arrays(parts: ModelParts, bed: Bed) -> dict[str, np.ndarray]:
    """Return the arrays of a bed and of its model's structure that a step reads."""
    table, first = bed.blocks.rows
    ground = bed.ground
    geoms = bed.geoms
    surface = bed.surface
    arrays = {
        "table": table,
        "row_spheres": bed.blocks.row_spheres,
        "first": first.astype(np.int64),
        "geoms": np.stack([geoms.ids, geoms.bodies, geoms.roots], -1),
        "spheres": geoms.spheres,
        "dofs": np.concatenate([np.flatnonzero(one) for one in geoms.moved_by]),
        "first_dof": np.concatenate([[0], np.cumsum(geoms.moved_by.sum(1))]),
        "bodies": parts.bodies,
        "parents": parts.parents,
        "trees": parts.trees,
        "laws": _law_numbers(bed),
        "shapes": parts.shape_numbers(geoms.ids),
        "ground": np.array([*ground[:5], ground.rounding, ACCURACY]),
        "disturbed": np.array(ground.disturbed, float),
        "surface": np.array([*surface.up, *surface.ahead, surface.level]),
        "hills": surface.hills.grid,
        "hill_frame": surface.hills.frame,
        "planes": bed.zones.planes,
        "first_plane": bed.zones.first,
        "derivative_rows": parts.derivative_rows,
        "derivative_columns": parts.derivative_columns,
    }
    for name in ("dofs", "first_dof"):
        arrays[name] = arrays[name].astype(np.int64)
    if bed.prints:
        arrays |= {
            "print_grid": bed.prints.grid,
            "print_surface": bed.prints.surface,
            "print_points": bed.prints.points,
            "print_first": bed.prints.first,
        }
    return arrays


def _bed_sizes(bed: Bed, arrays: dict[str, np.ndarray]) -> dict[str, int]:
    """Return the sizes of a bed's arrays."""
    return {
        "n_table": len(arrays["table"]),
        "n_geoms": len(bed.geoms),
        "n_dofs": len(arrays["dofs"]),
        "disturbed_rows": arrays["disturbed"].shape[0],
        "disturbed_columns": arrays["disturbed"].shape[1],
        "hill_rows": arrays["hills"].shape[0],
        "hill_columns": arrays["hills"].shape[1],
        "n_zones": len(bed.laws),
        "n_planes": len(bed.zones.planes),
        "n_numbers": arrays["laws"].shape[1],
    }


def _model_numbers(parts: ModelParts) -> dict[str, int]:
    """Return sizes of a model, and addresses in its memory."""
    numbers = {name: parts.sizes[name] for name in ("nv", "ngeom", "nbody")}
    return numbers | {
        "is_sparse": parts.sizes["is_sparse"],
        "n_derivative": parts.sizes["nD"],
        "model": parts.address,
        "timestep": parts.timestep,
        "integrator": parts.integrator,
        "disableflags": parts.disableflags,
        "damping": parts.damping,
        "geom_size": parts.geom_size,
        "geom_type": parts.geom_type,
        "geom_dataid": parts.geom_dataid,
        "full_takes_data": full_m_takes_data(),
        "no_euler_damping": int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP),
    }


def _data_places() -> dict[str, int]:
    """Return the places of arrays, counts and contacts in an mjData."""
    where = places()
    contacts = where.contacts._asdict()
    numbers = {"time": where.time, **where.arrays, **where.counts}
    return numbers | {f"contact_{name}": place for name, place in contacts.items()}


def _function_addresses(bed: Bed) -> dict[str, int]:
    """Return the addresses of the functions that a step calls: compiled code for the
    bed's laws, reports in Python and MuJoCo's own."""
    from rft.mujoco.step.compiled_parts import element_code
    from rft.mujoco.step.compiled_solver import solver_code

    return functions() | {
        "element_code": element_code(_law_record_class(bed)).address,
        "solver_code": solver_code().address,
        "report": ctypes.cast(_report_unsolved, ctypes.c_void_p).value,
        "report_changed": ctypes.cast(_report_changed, ctypes.c_void_p).value,
    }


def _print_numbers(parts: ModelParts, prints: Prints) -> dict[str, int]:
    """Return the numbers of a layout by which footprints are remembered."""
    from rft.mujoco.step.compiled import recorder

    rows, columns = prints.shape
    return {
        "recorder": recorder().address,
        "memory_start": parts.sizes["nuserdata"] - prints.userdata_size,
        "print_rows": rows,
        "print_columns": columns,
    }


def _law_record_class(bed: Bed) -> type:
    """Return the class of the records of a bed's laws."""
    return type(record(bed.laws[0]))


def _law_numbers(bed: Bed) -> np.ndarray:
    """Return the numbers of a bed's laws, and the sine of the grazing angle of each in
    the last column."""
    rows = [[*record(law), law.grazing_sine] for law in bed.laws]
    return np.array(rows, float)
