"""The solution of a block (`rft.mujoco.step.implicit.solve_block`) as a C function of
its own. Importing this module loads numba.

Compiled within the callback it would be optimised anew with each function above it: two
minutes in place of some seconds."""

from __future__ import annotations

import functools
from collections import namedtuple
from collections.abc import Callable

import numpy as np
from numba import carray, types
from numba.extending import overload, register_jitable

from rft.mujoco.memory import c_calls
from rft.mujoco.memory.c_calls import (
    call,
    compiled_c,
    integers_at,
    numbers_at,
    pointer_to,
)
from rft.mujoco.step import compiled_algebra, compiled_parts, implicit, rows
from rft.mujoco.step.compiled_parts import Grains, handle_at
from rft.mujoco.step.implicit import Motion, Point, Result, System, solve
from rft.mujoco.step.rows import Rows

Block = namedtuple(
    "Block",
    "n n_geoms n_members n_dofs n_rows n_cones code grains"
    " inertia effective lower force velocity jacobian members dofs first"
    " row_jacobian by_change weight reference kinds limits cones scales"
    " change wrenches residual",
)
AT = Block(*range(len(Block._fields)))
SIZE = len(Block._fields)
STEP, ROUNDING, ACCURACY, RESIDUAL, STATUS, REACHED, ITERATIONS, N_NUMBERS = range(8)


for function in (*implicit.COMPILED, *rows.COMPILED):
    register_jitable(function)


@functools.cache
def solver_code() -> Callable:
    """Return the C function (block, numbers) that solves a block. block: int64, by the
    names of `AT`. numbers: (N_NUMBERS,), step, rounding and accuracy, and where the
    `Result` goes."""

    def solve_one(block, numbers):
        at = carray(block, SIZE, np.int64)
        number = carray(numbers, N_NUMBERS, np.float64)
        n = at[AT.n]
        geoms = at[AT.n_geoms]
        n_rows = at[AT.n_rows]
        motion = Motion(
            numbers_at(at[AT.jacobian], (geoms, 6, n)),
            integers_at(at[AT.members], at[AT.n_members]),
            integers_at(at[AT.dofs], at[AT.n_dofs]),
            integers_at(at[AT.first], geoms + 1),
        )
        system = System(
            numbers_at(at[AT.inertia], (n, n)),
            numbers_at(at[AT.effective], (n, n)),
            numbers_at(at[AT.lower], (n, n)),
            numbers_at(at[AT.force], n),
            numbers_at(at[AT.velocity], n),
            number[STEP],
            motion,
        )
        own_rows = Rows(
            numbers_at(at[AT.row_jacobian], (n_rows, n)),
            numbers_at(at[AT.by_change], (n_rows, n)),
            numbers_at(at[AT.weight], n_rows),
            numbers_at(at[AT.reference], n_rows),
            integers_at(at[AT.kinds], n_rows),
            numbers_at(at[AT.limits], n_rows),
            integers_at(at[AT.cones], (at[AT.n_cones], 2)),
            numbers_at(at[AT.scales], (at[AT.n_cones], 6)),
        )
        point = Point(
            numbers_at(at[AT.change], n),
            numbers_at(at[AT.wrenches], (geoms, 6)),
            numbers_at(at[AT.residual], n),
        )
        grains = Grains(at[AT.code], 0, handle_at(at[AT.grains]), 0)
        result = solve(
            system, own_rows, grains, number[ROUNDING], number[ACCURACY], point
        )
        number[RESIDUAL] = result.residual
        number[STATUS] = result.status
        number[REACHED] = result.rounding
        number[ITERATIONS] = result.iterations

    modules = compiled_algebra, compiled_parts, c_calls
    arguments = types.voidptr, types.voidptr
    purpose = "the equations of robots on grains in MuJoCo"
    return compiled_c(solve_one, arguments, purpose, *modules)


@overload(implicit.solve_block)
def _solve_block(system, rows, grains, rounding, accuracy, point):
    def solve_block(system, rows, grains, rounding, accuracy, point):
        motion = system.motion
        at = np.empty(SIZE, np.int64)
        at[AT.n] = len(system.force)
        at[AT.n_geoms] = len(motion.jacobian)
        at[AT.n_members] = len(motion.members)
        at[AT.n_dofs] = len(motion.dofs)
        at[AT.n_rows] = len(rows.weight)
        at[AT.n_cones] = len(rows.cones)
        at[AT.code] = grains.code
        at[AT.grains] = grains.handle.ctypes.data
        at[AT.inertia] = system.inertia.ctypes.data
        at[AT.effective] = system.effective.ctypes.data
        at[AT.lower] = system.lower.ctypes.data
        at[AT.force] = system.force.ctypes.data
        at[AT.velocity] = system.velocity.ctypes.data
        at[AT.jacobian] = motion.jacobian.ctypes.data
        at[AT.members] = motion.members.ctypes.data
        at[AT.dofs] = motion.dofs.ctypes.data
        at[AT.first] = motion.first.ctypes.data
        at[AT.row_jacobian] = rows.jacobian.ctypes.data
        at[AT.by_change] = rows.by_change.ctypes.data
        at[AT.weight] = rows.weight.ctypes.data
        at[AT.reference] = rows.reference.ctypes.data
        at[AT.kinds] = rows.kinds.ctypes.data
        at[AT.limits] = rows.limits.ctypes.data
        at[AT.cones] = rows.cones.ctypes.data
        at[AT.scales] = rows.scales.ctypes.data
        at[AT.change] = point.change.ctypes.data
        at[AT.wrenches] = point.wrenches.ctypes.data
        at[AT.residual] = point.residual.ctypes.data
        number = np.empty(N_NUMBERS)
        number[STEP] = system.step
        number[ROUNDING] = rounding
        number[ACCURACY] = accuracy
        arguments = pointer_to(at.ctypes.data), pointer_to(number.ctypes.data)
        call(grains.solver, arguments)
        return Result(
            number[RESIDUAL],
            int(number[STATUS]),
            number[REACHED],
            int(number[ITERATIONS]),
        )

    return solve_block
