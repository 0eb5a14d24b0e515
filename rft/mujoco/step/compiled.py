"""The passive callback of MuJoCo in compiled code: C functions that never enter Python.
Importing this module loads numba.

MuJoCo has one such callback for all models of a process. `dispatcher` looks a model up
in a table and calls the kernel of its bed with the addresses of the data and of the
bed's `Layout`."""

from __future__ import annotations

import functools

import numpy as np
from numba import carray, types
from numba.core.ccallback import CFunc
from numba.extending import register_jitable

from rft.formulas.simd import WIDTH, register_formulas
from rft.mujoco.ground import hills
from rft.mujoco.ground.footprints import (
    COMPILED,
    HEAD,
    PER_CELL,
    PER_GEOM,
    memory_of,
    remember,
)
from rft.mujoco.ground.hills import tangent_plane
from rft.mujoco.memory import c_calls
from rft.mujoco.memory.addresses import FARTHEST
from rft.mujoco.memory.c_calls import (
    address_of,
    call,
    compiled_c,
    integers_at,
    numbers_at,
    pointer_to,
    short_integers_at,
)
from rft.mujoco.memory.layout import (
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
from rft.mujoco.step import compiled_algebra, compiled_parts, compiled_solver, equations
from rft.mujoco.step.compiled_parts import cut, pack_grains
from rft.mujoco.step.equations import (
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
from rft.mujoco.step.implicit import COARSER, UNSOLVED
from rft.mujoco.step.parts import Frames
from rft.mujoco.step.rows import Rows
from rft.terradynamics.meshes.forces.zones import Zones

LAYOUT = len(NAMES)
for function in (
    *hills.COMPILED,
    *COMPILED,
    *equations.COMPILED,
):
    register_jitable(function)


@register_jitable
def _frames(row, fields, levels):
    """Return the frames of all geoms, the middles (G, 3) and radii (G,) of spheres
    around them, and which of them may be in the ground. levels: (G,), of the ground
    with its footprints, or empty."""
    count = row[AT.n_geoms]
    geoms = integers_at(row[AT.geoms], (count, 3))
    spheres = numbers_at(row[AT.spheres], (count, 4))
    xpos = numbers_at(fields[AT.geom_xpos], (row[AT.ngeom], 3))
    xmat = numbers_at(fields[AT.geom_xmat], (row[AT.ngeom], 3, 3))
    surface = numbers_at(row[AT.surface], 7)
    hill_shape = (row[AT.hill_rows], row[AT.hill_columns], 3)
    hill_grid = numbers_at(row[AT.hills], hill_shape)
    hill_frame = numbers_at(row[AT.hill_frame], 7)
    ups = np.empty((count, 3))
    aheads = np.empty((count, 3))
    xs = np.empty(count)
    heights = np.empty(count)
    middles = np.empty((count, 3))
    turns = np.empty((count, 3, 3))
    places = np.empty((count, 3))
    in_reach = np.zeros(count, np.bool_)
    up = (surface[0], surface[1], surface[2])
    ahead = (surface[3], surface[4], surface[5])
    level = surface[6]
    for g in range(count):
        turn = xmat[geoms[g, 0]]
        place = xpos[geoms[g, 0]]
        sphere = spheres[g]
        turns[g] = turn
        places[g] = place
        for i in range(3):
            middles[g, i] = place[i]
            for j in range(3):
                middles[g, i] += turn[i, j] * sphere[j]
        if row[AT.hill_rows] > 0:
            up, level = tangent_plane(
                hill_grid, hill_frame, middles[g, 0], middles[g, 1]
            )

        heights[g] = -level
        if len(levels) > 0:
            heights[g] -= up[2] * levels[g]
        distance = heights[g]
        xs[g] = 0.0
        for i in range(3):
            heights[g] += up[i] * place[i]
            distance += up[i] * middles[g, i]
            xs[g] += ahead[i] * place[i]
            ups[g, i] = _along_axis(turn, i, up)
            aheads[g, i] = _along_axis(turn, i, ahead)
        in_reach[g] = distance < sphere[3]

    if fields[AT.body_awake] > 0:
        awake = short_integers_at(fields[AT.body_awake], row[AT.nbody])
        for g in range(count):
            # Bodies that sleep need no force.
            in_reach[g] &= awake[geoms[g, 1]] != 0
    frames = Frames(ups, aheads, xs, heights, turns, places)
    return frames, middles, spheres[:, 3], in_reach


@register_jitable
def _along_axis(turn, i, vector):
    """Return a vector's component along the axis i of a geom."""
    return turn[0, i] * vector[0] + turn[1, i] * vector[1] + turn[2, i] * vector[2]


@register_jitable
def _is_sane(velocity):
    """Return whether MuJoCo accepts all velocities."""
    return (np.abs(velocity) < FASTEST).all()


@register_jitable
def _is_unchanged(row):
    """Return whether the geoms have the shapes that their elements were made for."""
    count = row[AT.n_geoms]
    geoms = integers_at(row[AT.geoms], (count, 3))
    shapes = numbers_at(row[AT.shapes], (count, 5))
    sizes = numbers_at(row[AT.geom_size], (row[AT.ngeom], 3))
    kinds = short_integers_at(row[AT.geom_type], row[AT.ngeom])
    meshes = short_integers_at(row[AT.geom_dataid], row[AT.ngeom])
    for g in range(count):
        geom = geoms[g, 0]
        if kinds[geom] != shapes[g, 3] or meshes[geom] != shapes[g, 4]:
            return False
        for i in range(3):
            if sizes[geom, i] != shapes[g, i]:
                return False
    return True


@register_jitable
def _jacobians(row, fields, in_ground):
    """Return the Jacobians (G, 6, nv) of the geoms in the ground along their own axes,
    the degrees of freedom of all geoms, and the first of each geom, (G + 1,)."""
    count = row[AT.n_geoms]
    nv = row[AT.nv]
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
        turn = xmat[geoms[g, 0]]
        place = xpos[geoms[g, 0]]
        center = centers[geoms[g, 2]]
        x = place[0] - center[0]
        y = place[1] - center[1]
        z = place[2] - center[2]
        for c in dofs[first[g] : first[g + 1]]:
            d = cdof[c]
            # d[:3] is the rotation, d[3:] the velocity at the centre of the tree.
            v_x = d[3] + d[1] * z - d[2] * y
            v_y = d[4] + d[2] * x - d[0] * z
            v_z = d[5] + d[0] * y - d[1] * x
            for i in range(3):
                jacobian[g, i, c] = _along_axis(turn, i, (v_x, v_y, v_z))
                jacobian[g, 3 + i, c] = _along_axis(turn, i, (d[0], d[1], d[2]))
    return jacobian, dofs, first


@register_jitable
def _inertia(row, data, fields):
    """Return the inertia (nv, nv)."""
    matrix = np.zeros((row[AT.nv], row[AT.nv]))
    model = pointer_to(row[AT.model])
    address = pointer_to(matrix.ctypes.data)
    if row[AT.full_takes_data] != 0:
        call(row[AT.mj_fullM], (model, data, address))
    else:
        call(row[AT.mj_fullM], (model, address, pointer_to(fields[AT.qM])))
    return matrix


@register_jitable
def _force_without_grains(row, data, fields):
    """Return all smooth forces (nv,) of this step except those of the grains."""
    nv = row[AT.nv]
    nbody = row[AT.nbody]
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
    kinds = np.empty(count, np.int64)
    weight = np.empty(count)
    reference = np.empty(count)
    limits = np.empty(count)
    cones = np.zeros((0, 2), np.int64)
    scales = np.zeros((0, 6))
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
    """Return first rows and numbers of rows (c, 2), and mu and friction (c, 6), of
    elliptic contacts."""
    count = short_integers_at(address_of(data), FARTHEST // 4)[row[AT.ncon]]
    cones = np.zeros((count, 2), np.int64)
    scales = np.zeros((count, 6))
    for c in range(count):
        contact = fields[AT.contact_pointer] + c * row[AT.contact_size]
        cones[c, 0] = short_integers_at(contact + row[AT.contact_address], 1)[0]
        cones[c, 1] = short_integers_at(contact + row[AT.contact_dim], 1)[0]
        scales[c, 0] = numbers_at(contact + row[AT.contact_mu], 1)[0]
        scales[c, 1:] = numbers_at(contact + row[AT.contact_friction], 5)
    return elliptic_rows(kinds, cones, scales)


@register_jitable
def _implicit_terms(row, data, fields, effective, step):
    """Add the integrator's own implicit terms to the inertia, and return whether there
    are any."""
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
            unsolved[TIME] = time
            unsolved[RESIDUAL] = result.residual
            unsolved[GEOM] = geom
            call(row[AT.report], (data, pointer_to(row[AT.unsolved])))


@register_jitable
def _write_observation(row, result, wrenches, twists):
    """Write what the grains do in this step into the array "watched"."""
    count = row[AT.n_geoms]
    watched = numbers_at(row[AT.watched], WATCHED_HEAD + 12 * count)
    watched[WATCHED_RESIDUAL] = result.residual
    watched[WATCHED_STATUS] = result.status
    watched[WATCHED_ROUNDING] = result.rounding
    for g in range(count):
        begin = WATCHED_HEAD + 12 * g
        watched[begin : begin + 6] = wrenches[g]
        watched[begin + 6 : begin + 12] = twists[g]


@register_jitable
def _field_addresses(row, data):
    """Return the addresses of the data's arrays, 0 for those that this version of
    MuJoCo lacks, by the names of `rft.mujoco.memory.layout`."""
    words = carray(data, FARTHEST // 8, np.int64)
    fields = np.zeros(LAYOUT, np.int64)
    for i in range(AT.qfrc_passive, AT.efc_frictionloss + 1):
        if row[i] >= 0:
            fields[i] = words[row[i]]
    fields[AT.contact_pointer] = words[row[AT.contact_pointer]]
    return fields


@register_jitable
def _record_footprints(row, data, layout, fields):
    """Let footprints remember this step, and return the levels (G,) of the ground that
    the geoms are in; empty for ground that remembers nothing."""
    if row[AT.recorder] == 0:
        return np.zeros(0)
    call(row[AT.recorder], (data, layout))
    begin = fields[AT.userdata] + 8 * (row[AT.memory_start] + HEAD)
    return numbers_at(begin, row[AT.n_geoms])


@register_jitable
def _cut_elements(row, frames, middles, radii, in_reach):
    """Return the parts of elements below the surface, and the first part of each geom
    in each zone, (Z G + 1,)."""
    n_geoms = row[AT.n_geoms]
    n_zones = row[AT.n_zones]
    zones = Zones(
        numbers_at(row[AT.planes], (row[AT.n_planes], 3)),
        integers_at(row[AT.first_plane], n_zones + 1),
    )
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
    return cache, first_part


@register_jitable
def _geoms_with_parts(row, first_part):
    """Return whether each geom has a part below the surface, (G,)."""
    n_geoms = row[AT.n_geoms]
    in_ground = np.zeros(n_geoms, np.bool_)
    for k in range(len(first_part) - 1):
        in_ground[k % n_geoms] |= first_part[k + 1] > first_part[k]
    return in_ground


@register_jitable
def _grains(row, frames, cache, first_part):
    """Return what the loads of this step follow from."""
    disturbed_shape = (row[AT.disturbed_rows], row[AT.disturbed_columns])
    return pack_grains(
        (row[AT.element_code], row[AT.solver_code]),
        (row[AT.n_geoms], row[AT.n_zones]),
        numbers_at(row[AT.laws], (row[AT.n_zones], row[AT.n_numbers])),
        numbers_at(row[AT.ground], 7),
        numbers_at(row[AT.disturbed], disturbed_shape),
        cache,
        first_part,
        frames,
    )


@register_jitable
def _inputs(row, data, fields, in_ground):
    """Return all that the motion in this step follows from, without the grains."""
    nv = row[AT.nv]
    step = numbers_at(row[AT.timestep], 1)[0]
    if short_integers_at(row[AT.integrator], 1)[0] == RUNGE_KUTTA:
        step *= 0.5
    jacobian, dofs, first = _jacobians(row, fields, in_ground)
    force = _force_without_grains(row, data, fields)
    inertia = _inertia(row, data, fields)
    effective = inertia.copy()
    is_damped = _implicit_terms(row, data, fields, effective, step)
    return Inputs(
        inertia,
        effective,
        is_damped,
        force,
        numbers_at(fields[AT.qvel], nv),
        numbers_at(fields[AT.qacc_warmstart], nv),
        step,
        jacobian,
        dofs,
        first,
        in_ground,
        _constraint_rows(row, data, fields),
        integers_at(row[AT.trees], nv),
    )


@register_jitable
def _add_joint_forces(passive, inputs, wrenches):
    """Add the generalised forces of wrenches (G, 6) on the geoms to passive forces
    (nv,)."""
    for g in range(len(wrenches)):
        if not inputs.in_ground[g]:
            continue
        for c in inputs.dofs[inputs.first[g] : inputs.first[g + 1]]:
            for i in range(6):
                passive[c] += inputs.jacobian[g, i, c] * wrenches[g, i]


@functools.cache
def kernel() -> CFunc:
    """Return the C function (data, layout) that adds the forces of the grains to
    qfrc_passive. layout: int64 numbers and addresses, by the names of
    `rft.mujoco.memory.layout`."""
    register_formulas()

    def add_forces(data, layout):
        row = carray(layout, LAYOUT, np.int64)
        fields = _field_addresses(row, data)
        if not _is_unchanged(row):
            call(row[AT.report_changed], (data, layout))
            return

        # The geoms that are in the ground, and their parts there.
        levels = _record_footprints(row, data, layout, fields)
        frames, middles, radii, in_reach = _frames(row, fields, levels)
        velocity = numbers_at(fields[AT.qvel], row[AT.nv])
        if not in_reach.any() or not _is_sane(velocity):
            return
        cache, first_part = _cut_elements(row, frames, middles, radii, in_reach)
        in_ground = _geoms_with_parts(row, first_part)
        if not in_ground.any():
            return

        # The forces at the velocities that the step ends with.
        grains = _grains(row, frames, cache, first_part)
        inputs = _inputs(row, data, fields, in_ground)
        ground = numbers_at(row[AT.ground], 7)
        rounding = ground[5]
        accuracy = ground[6]
        wrenches = np.zeros((row[AT.n_geoms], 6))
        twists = np.zeros((row[AT.n_geoms], 6))
        result, geom = solve_blocks(
            inputs, grains, rounding, accuracy, wrenches, twists
        )
        passive = numbers_at(fields[AT.qfrc_passive], row[AT.nv])
        _add_joint_forces(passive, inputs, wrenches)

        if integers_at(row[AT.watch], 1)[0] == address_of(data):
            _write_observation(row, result, wrenches, twists)
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
        ngeom = row[AT.ngeom]
        nbody = row[AT.nbody]
        n_geoms = row[AT.n_geoms]
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
    """Return MuJoCo's passive callback, a C function (model, data).

    For every row of a table (R, 3) with the model's address it calls the kernel in the
    second column with the layout in the third. A row that begins with 0 ends the table.
    table: int64; the function reads its memory, which must outlive it."""
    address = table.ctypes.data
    n_rows = len(table)

    def passive(model, data):
        entries = carray(pointer_to(address), (n_rows, 3), np.int64)
        model_address = address_of(model)
        for k in range(n_rows):
            if entries[k, 0] == 0:
                return
            if entries[k, 0] == model_address:
                call(entries[k, 1], (data, pointer_to(entries[k, 2])))

    return compiled_c(passive, (types.voidptr, types.voidptr), "")
