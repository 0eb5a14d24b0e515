"""The passive callback of MuJoCo in compiled code: C functions that never enter Python. Importing this module loads numba.

MuJoCo has one such callback for all models of a process. `dispatcher` looks a model up in a table and calls the kernel of
its law with its `Layout` and the model's and the data's addresses."""

from __future__ import annotations

import functools
import math
import sys

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.core import sigutils
from numba.core.ccallback import CFunc
from numba.extending import intrinsic, register_jitable
from numba.np.unsafe.ndarray import to_fixed_tuple

from rft.balance.cache import Cache
from rft.ground import Ground
from rft.meshes.compiled import on_faces
from rft.meshes.contact import Motion
from rft.meshes.triples import cross, dot, minus, plus, times
from rft.meshes.zones import NOWHERE, PARTLY, Place, Zones, extent_in
from rft.mujoco.addresses import FARTHEST
from rft.mujoco.footprints import (
    COMPILED,
    HEAD,
    PER_CELL,
    PER_GEOM,
    memory_of,
    remember,
)
from rft.mujoco.hills import tangent_plane
from rft.mujoco.rest import COMPILED as HOLDING
from rft.mujoco.rest import PER_GEOM as NUMBERS
from rft.mujoco.rest import Rest, begin, damping, held_of, hold, let_go
from rft.simd import WIDTH, register_formulas

LAYOUT = 48  # numbers that `rft.mujoco.installed.layout_of` writes
for function in (tangent_plane, *COMPILED, *HOLDING):
    register_jitable(function)
OPTIONS = {"nopython": True, "nogil": True, "error_model": "numpy"}


@intrinsic
def _pointer(context, address):
    """Return an address as a pointer."""

    def emit(context, builder, sig, args):
        return builder.inttoptr(args[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), emit


@intrinsic
def _address(context, pointer):
    """Return a pointer as an address."""

    def emit(context, builder, sig, args):
        return builder.ptrtoint(args[0], ir.IntType(64))

    return types.int64(types.voidptr), emit


@intrinsic
def _call(context, function, data, layout):
    """Call the C function at an address, void (void *data, void *layout)."""

    def emit(context, builder, sig, args):
        pointer = context.get_value_type(types.voidptr)
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer])
        called = builder.inttoptr(args[0], kind.as_pointer())
        builder.call(called, [args[1], builder.inttoptr(args[2], pointer)])
        return context.get_dummy_value()

    return types.void(types.int64, types.voidptr, types.int64), emit


@functools.cache
def kernel(Law: type, has_regions: bool = False) -> CFunc:
    """Return the C function (data, layout) that adds the forces of the grains to qfrc_passive, for laws whose records have
    one class, in one medium or in several regions. layout: int64 numbers and addresses, in the order in which
    `rft.mujoco.installed.layout_of` writes them."""
    register_formulas()
    count = len(Law._fields)

    def add_forces(data, layout):
        row = carray(layout, LAYOUT, np.int64)
        fields = carray(data, FARTHEST // 8, np.int64)
        nv, ngeom, nbody, rows, groups = row[6], row[7], row[8], row[9], row[10]
        qfrc = carray(_pointer(fields[row[0]]), nv, np.float64)
        xpos = carray(_pointer(fields[row[1]]), (ngeom, 3), np.float64)
        xmat = carray(_pointer(fields[row[2]]), (ngeom, 3, 3), np.float64)
        cvel = carray(_pointer(fields[row[3]]), (nbody, 6), np.float64)
        cdof = carray(_pointer(fields[row[4]]), (nv, 6), np.float64)
        com = carray(_pointer(fields[row[5]]), (nbody, 3), np.float64)
        table = carray(_pointer(row[11]), (rows, 14, WIDTH), np.float64)
        first = carray(_pointer(row[12]), groups + 1, np.int64)
        numbers = carray(_pointer(row[13]), (groups, 4), np.int64)
        spheres = carray(_pointer(row[14]), (groups, 4), np.float64)
        parents = carray(_pointer(row[15]), nv, np.int64)
        zones = Zones(
            carray(_pointer(row[27]), (row[29], 3), np.float64),
            carray(_pointer(row[28]), row[30] + 1, np.int64),
        )
        laws = carray(_pointer(row[16]), (row[30], count + 1), np.float64)
        g = carray(_pointer(row[17]), 13, np.float64)
        disturbed = carray(_pointer(row[18]), (row[19], row[20]), np.float64)
        up, ahead, level, fastest = (
            (g[5], g[6], g[7]),
            (g[8], g[9], g[10]),
            g[11],
            g[12],
        )
        grid = carray(_pointer(row[23]), (row[24], row[25], 3), np.float64)
        field = carray(_pointer(row[26]), 7, np.float64)
        fast = carray(_pointer(row[21]), 1, np.int64)
        levels = g[:0]
        if row[31] != 0:
            _call(row[31], data, _address(layout))
            levels = carray(
                _pointer(fields[row[32]] + 8 * (row[33] + HEAD)), groups, np.float64
            )
        only_law = Law(*to_fixed_tuple(laws[0, :count], count))
        only_ground = Ground(g[0], g[1], g[2], laws[0, count], g[4], disturbed)
        passed, holds = 0.0, row[41] != 0
        if holds:
            held = held_of(
                carray(
                    _pointer(fields[row[42]] + 8 * row[43]),
                    1 + NUMBERS * groups,
                    np.float64,
                ),
                groups,
            )
            holding = Rest(
                carray(_pointer(row[44]), groups, np.float64),
                carray(_pointer(row[45]), groups, np.float64),
                carray(_pointer(row[46]), groups, np.int64),
                carray(_pointer(row[47]), 1, np.float64),
            )
            passed = begin(
                held,
                holding,
                carray(_pointer(_address(data) + 8 * row[41]), 1, np.float64)[0],
            )
        for k in range(groups):
            geom, body, root, dof = (
                numbers[k, 0],
                numbers[k, 1],
                numbers[k, 2],
                numbers[k, 3],
            )
            turn, place = xmat[geom], (xpos[geom, 0], xpos[geom, 1], xpos[geom, 2])
            x_axis = (turn[0, 0], turn[1, 0], turn[2, 0])
            y_axis = (turn[0, 1], turn[1, 1], turn[2, 1])
            z_axis = (turn[0, 2], turn[1, 2], turn[2, 2])
            center, radius = (
                (spheres[k, 0], spheres[k, 1], spheres[k, 2]),
                spheres[k, 3],
            )
            middle = plus(
                plus(times(center[0], x_axis), times(center[1], y_axis)),
                times(center[2], z_axis),
            )
            middle = plus(place, middle)
            if row[24] > 0:
                up, level = tangent_plane(grid, field, middle[0], middle[1])
            height = dot(up, place) - level
            if row[31] != 0:
                height -= up[2] * levels[k]
            local_up = (dot(x_axis, up), dot(y_axis, up), dot(z_axis, up))
            if not height + dot(local_up, center) < radius:
                if holds:
                    let_go(held, k)
                continue
            spin = (cvel[body, 0], cvel[body, 1], cvel[body, 2])
            arm = minus(place, (com[root, 0], com[root, 1], com[root, 2]))
            velocity = plus(
                (cvel[body, 3], cvel[body, 4], cvel[body, 5]), cross(spin, arm)
            )
            if (
                not dot(velocity, velocity) + dot(spin, spin) * radius**2
                < fastest * fastest
            ):
                if holds:
                    let_go(held, k)
                fast[0] += 1
                if fast[0] == 1:
                    _call(row[22], data, _address(layout))
                continue
            motion = Motion(
                (dot(x_axis, velocity), dot(y_axis, velocity), dot(z_axis, velocity)),
                (dot(x_axis, spin), dot(y_axis, spin), dot(z_axis, spin)),
                dot(ahead, place),
                local_up,
                (dot(x_axis, ahead), dot(y_axis, ahead), dot(z_axis, ahead)),
                height,
            )
            f, m = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            if has_regions:  # a branch that the compiler drops
                for zone in range(row[30]):
                    extent = extent_in(zones, zone, middle[0], middle[1], radius)
                    if extent == NOWHERE:
                        continue
                    law = Law(*to_fixed_tuple(laws[zone, :count], count))
                    ground = Ground(
                        g[0], g[1], g[2], laws[zone, count], g[4], disturbed
                    )
                    only, at = zone if extent == PARTLY else -1, Place(turn, place)
                    df, dm = on_faces(
                        law,
                        ground,
                        table,
                        first[k],
                        first[k + 1],
                        motion,
                        zones,
                        only,
                        at,
                    )
                    f, m = plus(f, df), plus(m, dm)
            else:
                f, m = on_faces(
                    only_law, only_ground, table, first[k], first[k + 1], motion
                )
            force = plus(
                plus(times(f[0], x_axis), times(f[1], y_axis)), times(f[2], z_axis)
            )
            moment = plus(
                plus(times(m[0], x_axis), times(m[1], y_axis)), times(m[2], z_axis)
            )
            if holds:
                speed = math.sqrt(dot(velocity, velocity) + dot(spin, spin) * radius**2)
                hold(held, holding, k, passed, speed, g[2], (*force, *moment))
                own, share = held.wrenches[k], damping(speed, held.speeds[k], g[2])
                force = plus((own[0], own[1], own[2]), times(share, force))
                moment = plus((own[3], own[4], own[5]), times(share, moment))
            moment = plus(moment, cross(arm, force))
            while dof >= 0:
                c = cdof[dof]
                qfrc[dof] += dot((c[0], c[1], c[2]), moment) + dot(
                    (c[3], c[4], c[5]), force
                )
                dof = parents[dof]

    return _compiled(
        add_forces, f"the forces of grains in MuJoCo of the form {Law.__name__}"
    )


@functools.cache
def recorder() -> CFunc:
    """Return the C function (data, layout) that lets footprints remember a step."""

    def record(data, layout):
        row = carray(layout, LAYOUT, np.int64)
        fields = carray(data, FARTHEST // 8, np.int64)
        ngeom, nbody, groups, g = (
            row[7],
            row[8],
            row[10],
            carray(_pointer(row[17]), 13, np.float64),
        )
        shape, first = (
            (row[34], row[35]),
            carray(_pointer(row[39]), groups + 1, np.int64),
        )
        size = HEAD + PER_GEOM * groups + PER_CELL * shape[0] * shape[1]
        numbers = carray(_pointer(fields[row[32]] + 8 * row[33]), size, np.float64)
        prints = (
            carray(_pointer(row[36]), 6, np.float64),
            carray(_pointer(row[37]), shape, np.float64),
            carray(_pointer(row[38]), (first[groups], 3), np.float64),
            first,
        )
        bodies = (
            carray(_pointer(row[13]), (groups, 4), np.int64),
            carray(_pointer(row[14]), (groups, 4), np.float64),
        )
        poses = (
            carray(_pointer(fields[row[1]]), (ngeom, 3), np.float64),
            carray(_pointer(fields[row[2]]), (ngeom, 3, 3), np.float64),
            carray(_pointer(fields[row[3]]), (nbody, 6), np.float64),
            carray(_pointer(fields[row[5]]), (nbody, 3), np.float64),
        )
        hills = (
            carray(_pointer(row[23]), (row[24], row[25], 3), np.float64),
            carray(_pointer(row[26]), 7, np.float64),
        )
        time = carray(_pointer(_address(data) + 8 * row[40]), 1, np.float64)[0]
        slopes = hills[0], hills[1], (g[5], g[6], g[7]), g[11]
        remember(
            memory_of(numbers, groups, shape[0], shape[1]),
            time,
            prints,
            bodies,
            poses,
            slopes,
        )

    return _compiled(record, "footprints in the ground of MuJoCo")


def _compiled(function, purpose: str) -> CFunc:
    """Return a C function (pointer, pointer), stored on disk; print one line if it has yet to be compiled."""
    signature = sigutils.normalize_signature(types.void(types.voidptr, types.voidptr))
    compiled = CFunc(function, signature, {}, OPTIONS)
    compiled._cache = Cache(function)
    if not compiled._cache.path.exists():
        print(f"compiling {purpose}: some seconds, once", file=sys.stderr)
    compiled.compile()
    return compiled


def dispatcher(table: np.ndarray) -> CFunc:
    """Return MuJoCo's passive callback, a C function (model, data), that calls for every row of a table (R, 3) with the
    model's address the kernel in the second column with the layout in the third. A row that begins with 0 ends the table.

    table: int64; the function reads its memory, which must outlive it."""
    address, rows = table.ctypes.data, len(table)

    def passive(model, data):
        entries = carray(_pointer(address), (rows, 3), np.int64)
        wanted = _address(model)
        for k in range(rows):
            if entries[k, 0] == 0:
                return
            if entries[k, 0] == wanted:
                _call(entries[k, 1], data, entries[k, 2])

    compiled = CFunc(
        passive,
        sigutils.normalize_signature(types.void(types.voidptr, types.voidptr)),
        {},
        OPTIONS,
    )
    compiled.compile()
    return compiled
