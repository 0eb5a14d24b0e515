"""The passive callback of MuJoCo in compiled code: C functions that never enter Python. Importing this module loads numba.

MuJoCo has one such callback for all models of a process. `dispatcher` looks a model up in a table and calls the kernel of
its law with its `Layout` and the model's and the data's addresses."""

from __future__ import annotations

import functools

import numpy as np
from numba import carray, types
from numba.core.ccallback import CFunc
from numba.extending import register_jitable

from rft.formulas.simd import WIDTH, register_formulas
from rft.mujoco import (
    c_calls,
    compiled_algebra,
    compiled_parts,
    compiled_solver,
    equations,
    hills,
)
from rft.mujoco.addresses import FARTHEST
from rft.mujoco.c_calls import (
    address_of,
    call,
    compiled_c,
    integers_at,
    numbers_at,
    pointer_to,
    short_integers_at,
)
from rft.mujoco.compiled_parts import cut, grains_of
from rft.mujoco.equations import (
    FASTEST,
    IMPLICIT,
    IMPLICIT_FAST,
    RUNGE_KUTTA,
    Inputs,
    add_body_forces,
    add_implicit_terms,
    elliptic_rows,
    solve_blocks,
)
from rft.mujoco.footprints import (
    COMPILED,
    HEAD,
    PER_CELL,
    PER_GEOM,
    memory_of,
    remember,
)
from rft.mujoco.implicit import COARSER, UNSOLVED
from rft.mujoco.layout import (
    AT,
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
from rft.mujoco.parts import Frames
from rft.mujoco.rows import Rows
from rft.terradynamics.meshes.zones import Zones

LAYOUT = len(NAMES)
for function in (
    *hills.COMPILED,
    *COMPILED,
    *equations.COMPILED,
):
    register_jitable(function)


@register_jitable
def _frames(row, fields, levels):
    """Return the frames of all geoms, the middles (G, 3) and radii (G,) of spheres around them, and which of them may be in
    the ground. levels: (G,), of the ground that footprints have left, or empty."""
    count = row[AT.n_geoms]
    geoms = integers_at(row[AT.geoms], (count, 3))
    spheres = numbers_at(row[AT.spheres], (count, 4))
    xpos = numbers_at(fields[AT.geom_xpos], (row[AT.ngeom], 3))
    xmat = numbers_at(fields[AT.geom_xmat], (row[AT.ngeom], 3, 3))
    surface = numbers_at(row[AT.surface], 7)
    hill_shape = (row[AT.hill_rows], row[AT.hill_columns], 3)
    hill_grid = numbers_at(row[AT.hills], hill_shape)
    hill_frame = numbers_at(row[AT.hill_frame], 7)
    ups, aheads = np.empty((count, 3)), np.empty((count, 3))
    xs, heights, middles = np.empty(count), np.empty(count), np.empty((count, 3))
    turns, places = np.empty((count, 3, 3)), np.empty((count, 3))
    in_reach = np.zeros(count, np.bool_)
    up, level = (surface[0], surface[1], surface[2]), surface[6]
    for g in range(count):
        turn, place, sphere = xmat[geoms[g, 0]], xpos[geoms[g, 0]], spheres[g]
        turns[g], places[g] = turn, place
        for i in range(3):
            middles[g, i] = place[i]
            for j in range(3):
                middles[g, i] += turn[i, j] * sphere[j]
        if row[AT.hill_rows] > 0:
            up, level = hills.tangent_plane(
                hill_grid, hill_frame, middles[g, 0], middles[g, 1]
            )
        heights[g], xs[g], distance = -level, 0.0, -level
        if len(levels) > 0:
            heights[g] -= up[2] * levels[g]
            distance = heights[g]
        for i in range(3):
            heights[g] += up[i] * place[i]
            distance += up[i] * middles[g, i]
            xs[g] += surface[3 + i] * place[i]
            ups[g, i] = turn[0, i] * up[0] + turn[1, i] * up[1] + turn[2, i] * up[2]
            aheads[g, i] = (
                turn[0, i] * surface[3]
                + turn[1, i] * surface[4]
                + turn[2, i] * surface[5]
            )
        in_reach[g] = distance < sphere[3]
    if fields[AT.body_awake] > 0:
        awake = short_integers_at(fields[AT.body_awake], row[AT.nbody])
        for g in range(count):
            in_reach[g] &= awake[geoms[g, 1]] != 0  # what sleeps needs no force
    frames = Frames(ups, aheads, xs, heights, turns, places)
    return frames, middles, spheres[:, 3], in_reach


@register_jitable
def _is_sane(velocity):
    """Return whether no velocity is beyond what MuJoCo calls bad."""
    return (np.abs(velocity) < FASTEST).all()


@register_jitable
def _is_unchanged(row):
    """Return whether the geoms are as their elements were made for."""
    count = row[AT.n_geoms]
    geoms = integers_at(row[AT.geoms], (count, 3))
    form = numbers_at(row[AT.shapes], (count, 5))
    sizes = numbers_at(row[AT.geom_size], (row[AT.ngeom], 3))
    kinds = short_integers_at(row[AT.geom_type], row[AT.ngeom])
    meshes = short_integers_at(row[AT.geom_dataid], row[AT.ngeom])
    for g in range(count):
        geom = geoms[g, 0]
        same = kinds[geom] == form[g, 3] and meshes[geom] == form[g, 4]
        for i in range(3):
            same = same and sizes[geom, i] == form[g, i]
        if not same:
            return False
    return True


@register_jitable
def _jacobians(row, fields, in_ground):
    """Return the Jacobians (G, 6, nv) of the geoms in the ground along their own axes."""
    count, nv = row[AT.n_geoms], row[AT.nv]
    geoms = integers_at(row[AT.geoms], (count, 3))
    xpos = numbers_at(fields[AT.geom_xpos], (row[AT.ngeom], 3))
    xmat = numbers_at(fields[AT.geom_xmat], (row[AT.ngeom], 3, 3))
    centers = numbers_at(fields[AT.subtree_com], (row[AT.nbody], 3))
    cdof = numbers_at(fields[AT.cdof], (nv, 6))
    dofs = integers_at(row[AT.dofs], row[AT.n_dofs])
    first = integers_at(row[AT.first_dof], count + 1)
    jacobian = np.zeros((count, 6, nv))
    for g in range(count):
        if not in_ground[g]:
            continue
        turn, place = xmat[geoms[g, 0]], xpos[geoms[g, 0]]
        center = centers[geoms[g, 2]]
        x, y, z = place[0] - center[0], place[1] - center[1], place[2] - center[2]
        for c in dofs[first[g] : first[g + 1]]:
            d = cdof[c]
            v0 = d[3] + d[1] * z - d[2] * y
            v1 = d[4] + d[2] * x - d[0] * z
            v2 = d[5] + d[0] * y - d[1] * x
            for i in range(3):
                jacobian[g, i, c] = turn[0, i] * v0 + turn[1, i] * v1 + turn[2, i] * v2
                jacobian[g, 3 + i, c] = (
                    turn[0, i] * d[0] + turn[1, i] * d[1] + turn[2, i] * d[2]
                )
    return jacobian, dofs, first


@register_jitable
def _inertia(row, data, fields):
    """Return the inertia (nv, nv)."""
    matrix = np.zeros((row[AT.nv], row[AT.nv]))
    model, address = pointer_to(row[AT.model]), pointer_to(matrix.ctypes.data)
    if row[AT.full_takes_data] != 0:
        call(row[AT.mj_fullM], (model, data, address))
    else:
        call(row[AT.mj_fullM], (model, address, pointer_to(fields[AT.qM])))
    return matrix


@register_jitable
def _known_force(row, data, fields):
    """Return all smooth forces (nv,) of this step but those of the grains."""
    nv, nbody = row[AT.nv], row[AT.nbody]
    model = pointer_to(row[AT.model])
    force = np.empty(nv)
    call(row[AT.mj_rne], (model, data, np.int32(0), pointer_to(force.ctypes.data)))
    call(row[AT.mj_fwdActuation], (model, data))
    passive = numbers_at(fields[AT.qfrc_passive], nv)
    applied = numbers_at(fields[AT.qfrc_applied], nv)
    motors = numbers_at(fields[AT.qfrc_actuator], nv)
    for i in range(nv):
        force[i] = passive[i] - force[i] + applied[i] + motors[i]
    bodies = integers_at(row[AT.bodies], (nbody, 2))
    add_body_forces(
        force,
        numbers_at(fields[AT.xfrc_applied], (nbody, 6)),
        numbers_at(fields[AT.xipos], (nbody, 3)),
        numbers_at(fields[AT.subtree_com], (nbody, 3)),
        numbers_at(fields[AT.cdof], (nv, 6)),
        bodies[:, 0],
        bodies[:, 1],
        integers_at(row[AT.parents], nv),
    )
    return force


@register_jitable
def _constraint_rows(row, data, fields):
    """Return MuJoCo's constraint rows, by all degrees of freedom."""
    nv = row[AT.nv]
    count = short_integers_at(address_of(data), FARTHEST // 4)[row[AT.nefc]]
    jacobian = np.zeros((count, nv))
    kinds, weight, reference = (
        np.empty(count, np.int64),
        np.empty(count),
        np.empty(count),
    )
    limits = np.empty(count)
    cones, scales = np.zeros((0, 2), np.int64), np.zeros((0, 6))
    if count > 0:
        call(row[AT.mj_referenceConstraint], (pointer_to(row[AT.model]), data))
        _fill_jacobian(row, fields, jacobian)
        kinds[:] = short_integers_at(fields[AT.efc_type], count)
        weight[:] = numbers_at(fields[AT.efc_D], count)
        reference[:] = numbers_at(fields[AT.efc_aref], count)
        limits[:] = numbers_at(fields[AT.efc_frictionloss], count)
        cones, scales = _cones(row, data, fields, kinds)
    return Rows(jacobian, jacobian, weight, reference, kinds, limits, cones, scales)


@register_jitable
def _fill_jacobian(row, fields, jacobian):
    """Write the constraints' Jacobian (r, nv)."""
    count, nv = jacobian.shape
    if row[AT.is_sparse] == 0:
        jacobian[:] = numbers_at(fields[AT.efc_J], (count, nv))
        return
    numbers = short_integers_at(fields[AT.efc_J_rownnz], count)
    first = short_integers_at(fields[AT.efc_J_rowadr], count)
    size = first[count - 1] + numbers[count - 1]
    values = numbers_at(fields[AT.efc_J], size)
    columns = short_integers_at(fields[AT.efc_J_colind], size)
    for i in range(count):
        for j in range(first[i], first[i] + numbers[i]):
            jacobian[i, columns[j]] = values[j]


@register_jitable
def _cones(row, data, fields, kinds):
    """Return first rows and numbers of rows (c, 2), and mu and friction (c, 6), of elliptic contacts."""
    count = short_integers_at(address_of(data), FARTHEST // 4)[row[AT.ncon]]
    cones, scales = np.zeros((count, 2), np.int64), np.zeros((count, 6))
    for c in range(count):
        at = fields[AT.contact_pointer] + c * row[AT.contact_size]
        cones[c, 0] = short_integers_at(at + row[AT.contact_address], 1)[0]
        cones[c, 1] = short_integers_at(at + row[AT.contact_dim], 1)[0]
        scales[c, 0] = numbers_at(at + row[AT.contact_mu], 1)[0]
        scales[c, 1:] = numbers_at(at + row[AT.contact_friction], 5)
    return elliptic_rows(kinds, cones, scales)


@register_jitable
def _implicit_terms(row, data, fields, effective, step):
    """Add what the integrator takes implicitly to the inertia, and return whether there is any."""
    integrator = short_integers_at(row[AT.integrator], 1)[0]
    flags = short_integers_at(row[AT.disableflags], 1)[0]
    if integrator in (IMPLICIT, IMPLICIT_FAST):
        with_bias = np.int32(integrator == IMPLICIT)
        call(row[AT.mjd_smooth_vel], (pointer_to(row[AT.model]), data, with_bias))
    elif flags & row[AT.no_euler_damping] != 0:
        return False
    return add_implicit_terms(
        effective,
        step,
        integrator,
        numbers_at(row[AT.damping], row[AT.nv]),
        numbers_at(fields[AT.qDeriv], row[AT.n_derivative]),
        integers_at(row[AT.derivative_rows], row[AT.n_derivative]),
        integers_at(row[AT.derivative_columns], row[AT.n_derivative]),
    )


@register_jitable
def _count(row, data, result, geom, time):
    """Count a step, and report the first that is not solved."""
    counts = integers_at(row[AT.counts], N_COUNTS)
    counts[STEPS] += 1
    counts[ITERATIONS] += result.iterations
    counts[MOST_ITERATIONS] = max(counts[MOST_ITERATIONS], result.iterations)
    largest = numbers_at(row[AT.largest], 1)
    largest[0] = max(largest[0], result.residual)
    if result.status == COARSER:
        counts[COARSER_STEPS] += 1
    if result.status == UNSOLVED:
        counts[UNSOLVED_STEPS] += 1
        if counts[UNSOLVED_STEPS] == 1:
            unsolved = numbers_at(row[AT.unsolved], 3)
            unsolved[TIME], unsolved[RESIDUAL], unsolved[GEOM] = (
                time,
                result.residual,
                geom,
            )
            call(row[AT.report], (data, pointer_to(row[AT.unsolved])))


@register_jitable
def _watch(row, result, wrenches, twists):
    """Write what the grains do in this step where it is asked for."""
    count = row[AT.n_geoms]
    watched = numbers_at(row[AT.watched], WATCHED_HEAD + 12 * count)
    watched[WATCHED_RESIDUAL] = result.residual
    watched[WATCHED_STATUS] = result.status
    watched[WATCHED_ROUNDING] = result.rounding
    for g in range(count):
        begin = WATCHED_HEAD + 12 * g
        watched[begin : begin + 6] = wrenches[g]
        watched[begin + 6 : begin + 12] = twists[g]


@functools.cache
def kernel() -> CFunc:
    """Return the C function (data, layout) that adds the forces of the grains to qfrc_passive. layout: int64 numbers and
    addresses, by the names of `rft.mujoco.layout`."""
    register_formulas()

    def add_forces(data, layout):
        row = carray(layout, LAYOUT, np.int64)
        words = carray(data, FARTHEST // 8, np.int64)
        fields = np.zeros(LAYOUT, np.int64)
        for i in range(AT.qfrc_passive, AT.efc_frictionloss + 1):
            fields[i] = words[row[i]] if row[i] >= 0 else 0
        fields[AT.contact_pointer] = words[row[AT.contact_pointer]]
        if not _is_unchanged(row):
            call(row[AT.report_changed], (data, layout))
            return
        nv, n_geoms, n_zones = row[AT.nv], row[AT.n_geoms], row[AT.n_zones]
        levels = np.zeros(0)
        if row[AT.recorder] != 0:
            call(row[AT.recorder], (data, layout))
            begin = fields[AT.userdata] + 8 * (row[AT.memory_start] + HEAD)
            levels = numbers_at(begin, n_geoms)
        velocity = numbers_at(fields[AT.qvel], nv)
        frames, middles, radii, in_reach = _frames(row, fields, levels)
        if not in_reach.any() or not _is_sane(velocity):
            return
        zones = Zones(
            numbers_at(row[AT.planes], (row[AT.n_planes], 3)),
            integers_at(row[AT.first_plane], n_zones + 1),
        )
        laws = numbers_at(row[AT.laws], (n_zones, row[AT.n_numbers]))
        first_part = np.zeros(n_zones * n_geoms + 1, np.int64)
        cache = cut(
            numbers_at(row[AT.table], (row[AT.n_table], 14, WIDTH)),
            numbers_at(row[AT.row_spheres], (row[AT.n_table], 4)),
            integers_at(row[AT.first], n_geoms + 1),
            zones,
            n_zones,
            (frames, middles, radii),
            first_part,
            in_reach,
        )
        in_ground = np.zeros(n_geoms, np.bool_)
        for k in range(n_zones * n_geoms):
            in_ground[k % n_geoms] |= first_part[k + 1] > first_part[k]
        if not in_ground.any():
            return
        numbers = numbers_at(row[AT.ground], 7)
        rounding, accuracy = numbers[5], numbers[6]
        shape = (row[AT.disturbed_rows], row[AT.disturbed_columns])
        grains = grains_of(
            (row[AT.element_code], row[AT.solver_code]),
            (n_geoms, n_zones),
            laws,
            numbers,
            numbers_at(row[AT.disturbed], shape),
            cache,
            first_part,
            frames,
        )
        step = numbers_at(row[AT.timestep], 1)[0]
        if short_integers_at(row[AT.integrator], 1)[0] == RUNGE_KUTTA:
            step *= 0.5
        jacobian, dofs, first = _jacobians(row, fields, in_ground)
        force = _known_force(row, data, fields)
        inertia = _inertia(row, data, fields)
        effective = inertia.copy()
        is_damped = _implicit_terms(row, data, fields, effective, step)
        inputs = Inputs(
            inertia,
            effective,
            is_damped,
            force,
            velocity,
            numbers_at(fields[AT.qacc_warmstart], nv),
            step,
            jacobian,
            dofs,
            first,
            in_ground,
            _constraint_rows(row, data, fields),
            integers_at(row[AT.trees], nv),
        )
        wrenches, twists = np.zeros((n_geoms, 6)), np.zeros((n_geoms, 6))
        result, geom = solve_blocks(
            inputs, grains, rounding, accuracy, wrenches, twists
        )
        passive = numbers_at(fields[AT.qfrc_passive], nv)
        for g in range(n_geoms):
            if in_ground[g]:
                for c in dofs[first[g] : first[g + 1]]:
                    for i in range(6):
                        passive[c] += jacobian[g, i, c] * wrenches[g, i]
        if integers_at(row[AT.watch], 1)[0] == address_of(data):
            _watch(row, result, wrenches, twists)
        else:
            time = numbers_at(address_of(data) + 8 * row[AT.time], 1)[0]
            _count(row, data, result, geom, time)

    purpose = "the callback of grains in MuJoCo"
    modules = compiled_algebra, compiled_parts, compiled_solver, c_calls
    return compiled_c(add_forces, (types.voidptr, types.voidptr), purpose, *modules)


@functools.cache
def recorder() -> CFunc:
    """Return the C function (data, layout) that lets footprints remember a step."""

    def record(data, layout):
        row = carray(layout, LAYOUT, np.int64)
        words = carray(data, FARTHEST // 8, np.int64)
        ngeom, nbody, n_geoms = row[AT.ngeom], row[AT.nbody], row[AT.n_geoms]
        shape = (row[AT.print_rows], row[AT.print_columns])
        first = integers_at(row[AT.print_first], n_geoms + 1)
        size = HEAD + PER_GEOM * n_geoms + PER_CELL * shape[0] * shape[1]
        begin = words[row[AT.userdata]] + 8 * row[AT.memory_start]
        prints = (
            numbers_at(row[AT.print_grid], 6),
            numbers_at(row[AT.print_surface], shape),
            numbers_at(row[AT.print_points], (first[n_geoms], 3)),
            first,
        )
        bodies = (
            integers_at(row[AT.geoms], (n_geoms, 3)),
            numbers_at(row[AT.spheres], (n_geoms, 4)),
        )
        poses = (
            numbers_at(words[row[AT.geom_xpos]], (ngeom, 3)),
            numbers_at(words[row[AT.geom_xmat]], (ngeom, 3, 3)),
            numbers_at(words[row[AT.cvel]], (nbody, 6)),
            numbers_at(words[row[AT.subtree_com]], (nbody, 3)),
        )
        surface = numbers_at(row[AT.surface], 7)
        hill_shape = (row[AT.hill_rows], row[AT.hill_columns], 3)
        slopes = (
            numbers_at(row[AT.hills], hill_shape),
            numbers_at(row[AT.hill_frame], 7),
            (surface[0], surface[1], surface[2]),
            surface[6],
        )
        time = numbers_at(address_of(data) + 8 * row[AT.time], 1)[0]
        remember(
            memory_of(numbers_at(begin, size), n_geoms, shape[0], shape[1]),
            time,
            prints,
            bodies,
            poses,
            slopes,
        )

    purpose = "footprints in the ground of MuJoCo"
    return compiled_c(record, (types.voidptr, types.voidptr), purpose, c_calls)


def dispatcher(table: np.ndarray) -> CFunc:
    """Return MuJoCo's passive callback, a C function (model, data), that calls for every row of a table (R, 3) with the
    model's address the kernel in the second column with the layout in the third. A row that begins with 0 ends the table.

    table: int64; the function reads its memory, which must outlive it."""
    address, rows_ = table.ctypes.data, len(table)

    def passive(model, data):
        entries = carray(pointer_to(address), (rows_, 3), np.int64)
        wanted = address_of(model)
        for k in range(rows_):
            if entries[k, 0] == 0:
                return
            if entries[k, 0] == wanted:
                call(entries[k, 1], (data, pointer_to(entries[k, 2])))

    return compiled_c(passive, (types.voidptr, types.voidptr), "")
