"""The equations of a step of all robots in the sand, block by block.

Trees of bodies that constraints join, or that stand alone, are a block; blocks without
a geom in the ground need no solution. What the force without grains is made of follows
MuJoCo's own order (`mj_step`). Compiled code takes these functions, too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.mujoco.step.algebra import (
    dot,
    geom_twists,
    multiply,
    number_blocks,
    solve_cholesky,
    solve_linear,
    submatrix,
)
from rft.mujoco.step.implicit import (
    SOLVED,
    Motion,
    Result,
    block_system,
    new_point,
    solve_block,
)
from rft.mujoco.step.rows import ELLIPTIC, Rows

RUNGE_KUTTA, IMPLICIT, IMPLICIT_FAST = 1, 2, 3  # mjtIntegrator
FASTEST = 1e10  # mjMAXVAL: velocities beyond that are bad, and MuJoCo begins anew


class Inputs(NamedTuple):
    """All that the motion of a model's n degrees of freedom in a step follows from,
    without the grains.

    inertia, effective: (n, n), M and N of `rft.mujoco.step.implicit`. is_damped:
    whether these differ. force, velocity, start: (n,), tau, v and the acceleration to
    start from. step: s. jacobian, dofs, first: of all geoms, as of `Motion`. in_ground:
    (G,).
    rows: those of MuJoCo's constraints, by all degrees of freedom. trees: (n,), of each
    degree of freedom."""

    inertia: np.ndarray
    effective: np.ndarray
    is_damped: bool
    force: np.ndarray
    velocity: np.ndarray
    start: np.ndarray
    step: float
    jacobian: np.ndarray
    dofs: np.ndarray
    first: np.ndarray
    in_ground: np.ndarray
    rows: Rows
    trees: np.ndarray


def add_body_forces(
    force, body_forces, places, centers, cdof, last_dofs, roots, parents
):
    """Add the generalised forces of forces and moments on bodies (B, 6), at places
    (B, 3), to a force (n,).

    centers: (B, 3), subtree_com. last_dofs, roots: (B,), of each body. parents: (n,),
    of each degree of freedom."""
    for body in range(len(body_forces)):
        f = body_forces[body]
        dof = last_dofs[body]
        if dof < 0 or not f.any():
            continue
        arm = places[body] - centers[roots[body]]
        x = f[3] + arm[1] * f[2] - arm[2] * f[1]
        y = f[4] + arm[2] * f[0] - arm[0] * f[2]
        z = f[5] + arm[0] * f[1] - arm[1] * f[0]
        while dof >= 0:
            d = cdof[dof]
            force[dof] += d[0] * x + d[1] * y + d[2] * z
            force[dof] += d[3] * f[0] + d[4] * f[1] + d[5] * f[2]
            dof = parents[dof]


def add_implicit_terms(
    effective, step, integrator, damping, derivative, row_of, column_of
):
    """Add what the integrator takes implicitly to the inertia (n, n), and return
    whether there is any.

    damping: (n,), of the joints. derivative: (k,), of the smooth forces by the
    velocities, in the rows and columns ``row_of`` and ``column_of`` (k,)."""
    is_damped = False
    if integrator in (IMPLICIT, IMPLICIT_FAST):
        for k in range(len(derivative)):
            if derivative[k] == 0.0:
                continue
            is_damped = True
            i = row_of[k]
            j = column_of[k]
            term = step * derivative[k]
            if integrator == IMPLICIT_FAST:
                effective[i, j] -= 0.5 * term
                effective[j, i] -= 0.5 * term
            else:
                effective[i, j] -= term
    elif integrator != RUNGE_KUTTA:
        for i in range(len(damping)):
            if damping[i] != 0.0:
                is_damped = True
                effective[i, i] += step * damping[i]
    return is_damped


def elliptic_rows(kinds, cones, scales):
    """Return the elliptic contacts among contacts (c, 2) that have rows."""
    is_elliptic = np.zeros(len(cones), np.bool_)
    for c in range(len(cones)):
        first = cones[c, 0]
        count = cones[c, 1]
        is_elliptic[c] = first >= 0 and count > 1 and kinds[max(first, 0)] == ELLIPTIC
    index = np.flatnonzero(is_elliptic)
    return cones[index], scales[index]


def solve_blocks(inputs, grains, rounding, accuracy, wrenches, twists) -> tuple:
    """Write the wrenches (G, 6) of the grains on the geoms and their twists at the end
    of the step, along the geoms' axes.

    Returns the `Result` of the worst block, and the geom in it that bears most, -1 for
    none."""
    used = np.zeros(len(inputs.velocity), np.bool_)
    for geom in range(len(inputs.in_ground)):
        if inputs.in_ground[geom]:
            used[inputs.dofs[inputs.first[geom] : inputs.first[geom + 1]]] = True
    block = number_blocks(inputs.trees, inputs.rows.jacobian, used)
    worst = Result(0.0, SOLVED, rounding, 0)
    geom = -1
    iterations = 0
    for number in range(block.max() + 1):
        dofs = np.flatnonzero(block == number)
        own, members = _solve_one(
            inputs, grains, rounding, accuracy, block, number, dofs, wrenches, twists
        )
        iterations += own.iterations
        if own.status > worst.status or own.residual > worst.residual:
            worst = own
            geom = _most_loaded_geom(members, wrenches)
    result = Result(worst.residual, worst.status, worst.rounding, iterations)
    return result, geom


def _most_loaded_geom(members, wrenches) -> int:
    """Return the geom on which the grains exert the largest force."""
    largest = -1.0
    geom = -1
    for g in members:
        force2 = dot(wrenches[g, :3], wrenches[g, :3])
        if force2 > largest:
            largest = force2
            geom = g
    return geom


def _solve_one(
    inputs, grains, rounding, accuracy, block, number, dofs, wrenches, twists
):
    """Solve a block, and return its result and its geoms in the ground."""
    place = np.full(len(inputs.velocity), -1)
    place[dofs] = np.arange(len(dofs))
    motion = _motion_of_block(inputs, block, number, dofs, place)
    rows = _rows_of_block(inputs.rows, dofs)
    system = block_system(
        submatrix(inputs.inertia, dofs, dofs),
        submatrix(inputs.effective, dofs, dofs),
        inputs.force[dofs],
        inputs.velocity[dofs],
        inputs.step,
        motion,
    )
    start = inputs.start[dofs]
    if inputs.is_damped:
        start = solve_linear(system.effective.copy(), multiply(system.inertia, start))
        for i in range(len(rows.weight)):
            own = solve_cholesky(system.lower, rows.jacobian[i])
            rows.by_change[i] = multiply(system.effective.T, own)
    if not (system.velocity + system.step * start).any():
        # At rest the stress has no slope: start as if there were no grains.
        start = solve_linear(system.effective.copy(), system.force)
    point = new_point(start, len(wrenches))
    result = solve_block(system, rows, grains, rounding, accuracy, point)
    ends = geom_twists(motion, system.velocity + system.step * point.change)
    for g in motion.members:
        wrenches[g] = point.wrenches[g]
        twists[g] = ends[g]
    return result, motion.members


def _motion_of_block(inputs, block, number, dofs, place) -> Motion:
    """Return how the degrees of freedom of a block move its geoms."""
    geoms = len(inputs.in_ground)
    own = np.zeros(geoms, np.bool_)
    for g in range(geoms):
        begin = inputs.first[g]
        end = inputs.first[g + 1]
        if inputs.in_ground[g] and end > begin:
            own[g] = block[inputs.dofs[begin]] == number
    jacobian = np.zeros((geoms, 6, len(dofs)))
    members = np.flatnonzero(own)
    for g in members:
        for c in inputs.dofs[inputs.first[g] : inputs.first[g + 1]]:
            jacobian[g, :, place[c]] = inputs.jacobian[g, :, c]
    return Motion(jacobian, members, place[inputs.dofs], inputs.first)


def _rows_of_block(rows, dofs) -> Rows:
    """Return the constraint rows that act on some degrees of freedom."""
    acts = np.zeros(len(rows.weight), np.bool_)
    for i in range(len(acts)):
        acts[i] = rows.jacobian[i][dofs].any()
    index = np.flatnonzero(acts)
    position = np.full(len(acts), -1)
    position[index] = np.arange(len(index))
    in_block = np.zeros(len(rows.cones), np.bool_)
    cones = rows.cones.copy()
    for c in range(len(cones)):
        first = position[cones[c, 0]]
        in_block[c] = first >= 0
        cones[c, 0] = first
    cone_index = np.flatnonzero(in_block)
    jacobian = submatrix(rows.jacobian, index, dofs)
    return Rows(
        jacobian,
        jacobian.copy(),
        rows.weight[index],
        rows.reference[index],
        rows.kinds[index],
        rows.limits[index],
        cones[cone_index],
        rows.scales[cone_index],
    )


COMPILED = (
    add_body_forces,
    add_implicit_terms,
    elliptic_rows,
    solve_blocks,
    _most_loaded_geom,
    _solve_one,
    _motion_of_block,
    _rows_of_block,
)
