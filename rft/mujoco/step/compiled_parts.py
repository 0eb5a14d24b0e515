"""The loads of `rft.mujoco.step.parts` for compiled code, eight elements at once.
Importing this module loads numba."""

from __future__ import annotations

import functools
from collections import namedtuple
from typing import NamedTuple

import numpy as np
from numba import carray, types
from numba.extending import overload, register_jitable
from numba.np.unsafe.ndarray import to_fixed_tuple

from rft.formulas.simd import (
    WIDTH,
    add_vector,
    any_of,
    register_formulas,
    store,
    sum_of,
)
from rft.formulas.simd import load as read
from rft.formulas.vectors import sqrt
from rft.mujoco.memory.c_calls import (
    call,
    compiled_c,
    integers_at,
    numbers_at,
    pointer_to,
)
from rft.mujoco.step import parts
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.forces.compiled import read_face
from rft.terradynamics.meshes.forces.contact import (
    Motion,
    Part,
    corner_heights,
    load,
    load_with_slopes,
    part_below,
    velocity_of_middle,
    whole_part,
)
from rft.terradynamics.meshes.forces.triples import dot, plus
from rft.terradynamics.meshes.forces.zones import (
    NOWHERE,
    PARTLY,
    Place,
    extent_in,
    share_in,
    share_of_part,
)

FIELDS = 12  # vectors of eight that hold a part of eight faces
SLOPE_SUMS = 36  # that the slopes of loads follow from
DAMPER_SUMS = 10  # that the slopes of dampers follow from
LOADS, SLOPES, ADD_DAMPERS = range(3)  # what the C function adds


class Grains(NamedTuple):
    """What the loads of a step follow from. code, solver: addresses of the C functions
    of `element_code` and of `rft.mujoco.step.compiled_solver.solver_code`. handle:
    (12,), numbers and addresses that the first reads, by the names of `AT`. arrays:
    those there, which must outlive it."""

    code: int
    solver: int
    handle: np.ndarray
    arrays: tuple


Handle = namedtuple(
    "Handle",
    "n_geoms n_zones laws ground disturbed disturbed_rows disturbed_columns cache first"
    " up ahead x",
)
AT = Handle(*range(12))


@register_jitable
def _reaches_ground(spheres, k, motion):
    """Return whether the sphere around row number k of eight faces reaches below the
    surface."""
    x, y, z = motion.up
    height = motion.height + x * spheres[k, 0] + y * spheres[k, 1] + z * spheres[k, 2]
    return height < spheres[k, 3]


@register_jitable
def cut_rows(table, spheres, begin, end, motion, zones, zone, place, cache, count):
    """Keep the parts below the surface of rows of eight faces, in ``cache`` from part
    ``count`` on; return how many parts it has then. zone: of which the parts keep their
    share, negative for all."""
    for k in range(begin, end):
        if not _reaches_ground(spheres, k, motion):
            continue
        face = read_face(table[k], 0)
        z = corner_heights(face, motion)
        if any_of((z[0] < 0.0) | (z[1] < 0.0) | (z[2] < 0.0)):
            if any_of((z[0] >= 0.0) | (z[1] >= 0.0) | (z[2] >= 0.0)):
                part = part_below(face, z)
            else:
                part = whole_part(face, z)
            if zone >= 0:
                part = share_of_part(part, share_in(zones, zone, face, place))
            i = FIELDS * count
            for j in range(3):
                store(cache, i + j, part.n[j])
                store(cache, i + 3 + j, part.middle[j])
                store(cache, i + 8 + j, part.arms[j])
            store(cache, i + 6, part.area)
            store(cache, i + 7, part.depth)
            store(cache, i + 11, face.sheet)
            count += 1
    return count


@register_jitable
def cut(table, spheres, first, zones, n_zones, frames, cache_first, in_reach):
    """Return the cache of all parts below the surface, and write the first part of each
    geom in each zone.

    spheres: (R, 4), `rft.terradynamics.meshes.forces.blocks.Blocks.row_spheres`.
    frames: (frames, middles, radii): `rft.mujoco.step.parts.Frames`, and middles
    (G, 3), m, and radii (G,) of spheres around the geoms. in_reach: (G,), whether a
    geom may be in the ground."""
    frame, middles, radii = frames
    geoms = len(radii)
    capacity = 0
    for g in range(geoms):
        if in_reach[g]:
            motion = _motion_at_rest(frame, g)
            for k in range(first[g], first[g + 1]):
                capacity += _reaches_ground(spheres, k, motion)
    # A row of eight faces across a boundary is kept once in each of the zones.
    cache = np.empty((FIELDS * max(capacity * n_zones, 1), WIDTH))
    count = 0
    for zone in range(n_zones):
        for g in range(geoms):
            cache_first[zone * geoms + g] = count
            if not in_reach[g]:
                continue
            extent = 2
            if n_zones > 1:
                extent = extent_in(zones, zone, middles[g, 0], middles[g, 1], radii[g])
            if extent == NOWHERE:
                continue
            only = zone if extent == PARTLY else -1
            place = Place(frame.turn[g], frame.place[g])
            count = cut_rows(
                table,
                spheres,
                first[g],
                first[g + 1],
                _motion_at_rest(frame, g),
                zones,
                only,
                place,
                cache,
                count,
            )
    cache_first[n_zones * geoms] = count
    return cache


@register_jitable
def _motion_at_rest(frame, g):
    """Return where a geom is, as a motion without velocity."""
    rest = (0.0, 0.0, 0.0)
    up = (frame.up[g, 0], frame.up[g, 1], frame.up[g, 2])
    ahead = (frame.ahead[g, 0], frame.ahead[g, 1], frame.ahead[g, 2])
    return Motion(rest, rest, frame.x[g], up, ahead, frame.height[g])


@register_jitable
def handle_at(address):
    """Return the handle of grains at an address."""
    return integers_at(address, 12)


@register_jitable
def pack_grains(codes, sizes, laws, ground, disturbed, cache, first, frames):
    """Return the grains of a step. codes: (2,), addresses of C functions. sizes: (2,),
    numbers of geoms and of zones.

    laws: (Z, n + 1), numbers of the laws of all zones, and the sines of their grazing
    angles. ground: (5,), its numbers. first: (Z G + 1,), the first part of each geom in
    each zone. frames: `rft.mujoco.step.parts.Frames`."""
    handle = np.empty(12, np.int64)
    handle[AT.n_geoms], handle[AT.n_zones] = sizes
    handle[AT.laws] = laws.ctypes.data
    handle[AT.ground] = ground.ctypes.data
    handle[AT.disturbed] = disturbed.ctypes.data
    handle[AT.disturbed_rows] = disturbed.shape[0]
    handle[AT.disturbed_columns] = disturbed.shape[1]
    handle[AT.cache] = cache.ctypes.data
    handle[AT.first] = first.ctypes.data
    handle[AT.up] = frames.up.ctypes.data
    handle[AT.ahead] = frames.ahead.ctypes.data
    handle[AT.x] = frames.x.ctypes.data
    return Grains(
        codes[0], codes[1], handle, (laws, ground, disturbed, cache, first, frames)
    )


@register_jitable
def _read_part(cache, k):
    """Return part number k of eight faces, and whether these are of sheets."""
    i = FIELDS * k
    n = (read(cache, i), read(cache, i + 1), read(cache, i + 2))
    middle = (read(cache, i + 3), read(cache, i + 4), read(cache, i + 5))
    arms = (read(cache, i + 8), read(cache, i + 9), read(cache, i + 10))
    part = Part(n, middle, read(cache, i + 6), read(cache, i + 7), arms)
    return part, read(cache, i + 11) > 0.0


@functools.cache
def element_code(Law: type):
    """Return the C function (handle, members, count, rounding, twists, out, kind) that
    adds to ``out`` the wrenches on geoms, their slopes or the slopes of dampers, by
    kind, for laws whose records have one class.

    members: geoms, ``count`` of them. twists: (G, 6). out: (G, 6) for wrenches, else
    (G, 6, 6)."""
    register_formulas()
    n_numbers = len(Law._fields)

    def add_elements(handle, members, count, rounding, twists, out, kind):
        at = carray(handle, 12, np.int64)
        n_geoms = at[AT.n_geoms]
        n_zones = at[AT.n_zones]
        geoms = carray(members, count, np.int64)
        moves = carray(twists, (n_geoms, 6), np.float64)
        wrenches = carray(out, (n_geoms, 6), np.float64)
        slopes = carray(out, (n_geoms, 6, 6), np.float64)
        laws = numbers_at(at[AT.laws], (n_zones, n_numbers + 1))
        ground = numbers_at(at[AT.ground], 5)
        shape = (at[AT.disturbed_rows], at[AT.disturbed_columns])
        disturbed = numbers_at(at[AT.disturbed], shape)
        first = integers_at(at[AT.first], n_zones * n_geoms + 1)
        cache = numbers_at(
            at[AT.cache], (FIELDS * max(first[n_zones * n_geoms], 1), WIDTH)
        )
        up = numbers_at(at[AT.up], (n_geoms, 3))
        ahead = numbers_at(at[AT.ahead], (n_geoms, 3))
        x = numbers_at(at[AT.x], n_geoms)
        sums = np.empty((SLOPE_SUMS, WIDTH))
        for zone in range(n_zones):
            law = Law(*to_fixed_tuple(laws[zone, :n_numbers], n_numbers))
            own = Ground(
                ground[0],
                ground[1],
                rounding,
                laws[zone, n_numbers],
                ground[4],
                disturbed,
            )
            for g in geoms:
                begin = first[zone * n_geoms + g]
                end = first[zone * n_geoms + g + 1]
                if begin == end:
                    continue
                t = moves[g]
                motion = Motion(
                    (t[0], t[1], t[2]),
                    (t[3], t[4], t[5]),
                    x[g],
                    (up[g, 0], up[g, 1], up[g, 2]),
                    (ahead[g, 0], ahead[g, 1], ahead[g, 2]),
                    0.0,
                )
                if kind == LOADS:
                    add_loads(law, own, cache, begin, end, motion, wrenches[g])
                elif kind == SLOPES:
                    add_slopes(law, own, cache, begin, end, motion, sums, slopes[g])
                else:
                    add_dampers(law, own, cache, begin, end, motion, sums, slopes[g])

    arguments = (
        types.voidptr,
        types.voidptr,
        types.int64,
        types.float64,
        types.voidptr,
        types.voidptr,
        types.int32,
    )
    return compiled_c(
        add_elements,
        arguments,
        f"the forces of grains in MuJoCo of the form {Law.__name__}",
    )


@register_jitable
def add_loads(law, ground, cache, begin, end, motion, wrench):
    """Add the wrench of parts of eight faces from ``begin`` to ``end``."""
    zero = 0.0 * read(cache, 0)
    force = (zero, zero, zero)
    moment = (zero, zero, zero)
    for k in range(begin, end):
        part, sheet = _read_part(cache, k)
        v = velocity_of_middle(part, motion)
        if any_of((dot(part.n, v) >= 0.0) | sheet):  # others bear nothing
            f, m, _ = load(law, ground, part, motion, v, sheet)
            force = plus(force, f)
            moment = plus(moment, m)
    for i in range(3):
        wrench[i] += sum_of(force[i])
        wrench[3 + i] += sum_of(moment[i])


@register_jitable
def add_slopes(law, ground, cache, begin, end, motion, sums, slopes):
    """Add the slopes (6, 6) of the wrench of parts by the twist. sums: (SLOPE_SUMS, 8),
    of which nothing is kept."""
    sums[:] = 0.0
    for k in range(begin, end):
        part, sheet = _read_part(cache, k)
        v = velocity_of_middle(part, motion)
        if any_of((dot(part.n, v) >= 0.0) | sheet):
            _, _, by_v, moment_by_v = load_with_slopes(
                law, ground, part, motion, v, sheet
            )
            x, y, z = part.middle
            for i in range(3):
                _add_row(sums, 6 * i, by_v, i, x, y, z)
                _add_row(sums, 18 + 6 * i, moment_by_v, i, x, y, z)
    for i in range(6):
        for j in range(6):
            slopes[i, j] += sum_of(read(sums, 6 * i + j))


@register_jitable
def _add_row(sums, row, by_v, i, x, y, z):
    """Add the slopes of one component of a load by the six components of the twist."""
    a, b, c = by_v[0][i], by_v[1][i], by_v[2][i]
    add_vector(sums, row, a)
    add_vector(sums, row + 1, b)
    add_vector(sums, row + 2, c)
    add_vector(sums, row + 3, c * y - b * z)
    add_vector(sums, row + 4, a * z - c * x)
    add_vector(sums, row + 5, b * x - a * y)


@register_jitable
def add_dampers(law, ground, cache, begin, end, motion, sums, slopes):
    """Add the slopes (6, 6) of dampers that bear as much as parts at their speeds."""
    sums[:] = 0.0
    for k in range(begin, end):
        part, sheet = _read_part(cache, k)
        v = velocity_of_middle(part, motion)
        f, _, _ = load(law, ground, part, motion, v, sheet)
        size = sqrt(dot(f, f) / (dot(v, v) + ground.rounding * ground.rounding))
        x, y, z = part.middle
        add_vector(sums, 0, size)
        add_vector(sums, 1, size * x)
        add_vector(sums, 2, size * y)
        add_vector(sums, 3, size * z)
        add_vector(sums, 4, size * x * x)
        add_vector(sums, 5, size * y * y)
        add_vector(sums, 6, size * z * z)
        add_vector(sums, 7, size * x * y)
        add_vector(sums, 8, size * y * z)
        add_vector(sums, 9, size * z * x)
    total = np.empty(DAMPER_SUMS)
    for i in range(DAMPER_SUMS):
        total[i] = sum_of(read(sums, i))
    _add_damper(slopes, total)


@register_jitable
def _add_damper(slopes, total):
    """Add the slopes (6, 6) of a damper from sums of its size, times nothing, x, y, z,
    x^2, y^2, z^2, x y, y z and z x."""
    size = total[0]
    x, y, z = total[1], total[2], total[3]
    xx, yy, zz = total[4], total[5], total[6]
    xy, yz, zx = total[7], total[8], total[9]
    for i in range(3):
        slopes[i, i] += size
    _add_pair(slopes, 0, 4, z)
    _add_pair(slopes, 0, 5, -y)
    _add_pair(slopes, 1, 3, -z)
    _add_pair(slopes, 1, 5, x)
    _add_pair(slopes, 2, 3, y)
    _add_pair(slopes, 2, 4, -x)
    slopes[3, 3] += yy + zz
    slopes[4, 4] += xx + zz
    slopes[5, 5] += xx + yy
    _add_pair(slopes, 3, 4, -xy)
    _add_pair(slopes, 3, 5, -zx)
    _add_pair(slopes, 4, 5, -yz)


@register_jitable
def _add_pair(slopes, i, j, value):
    slopes[i, j] += value
    slopes[j, i] += value


@register_jitable
def _add(grains, members, rounding, twists, out, kind):
    """Call the C function of the elements."""
    arguments = (
        pointer_to(grains.handle.ctypes.data),
        pointer_to(members.ctypes.data),
        len(members),
        rounding,
        pointer_to(twists.ctypes.data),
        pointer_to(out.ctypes.data),
        np.int32(kind),
    )
    call(grains.code, arguments)


@overload(parts.write_wrenches)
def _write_wrenches(grains, members, rounding, twists, wrenches):
    def write_wrenches(grains, members, rounding, twists, wrenches):
        wrenches[:] = 0.0
        _add(grains, members, rounding, twists, wrenches, LOADS)

    return write_wrenches


@overload(parts.write_slopes)
def _write_slopes(grains, members, rounding, twists, slopes):
    def write_slopes(grains, members, rounding, twists, slopes):
        slopes[:] = 0.0
        _add(grains, members, rounding, twists, slopes, SLOPES)

    return write_slopes


@overload(parts.add_dampers)
def _add_dampers(grains, members, rounding, twists, dampers):
    def add_dampers(grains, members, rounding, twists, dampers):
        _add(grains, members, rounding, twists, dampers, ADD_DAMPERS)

    return add_dampers
