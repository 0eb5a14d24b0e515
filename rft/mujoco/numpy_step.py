"""The forces of the grains in a step by NumPy, at the address of an mjData, as
`rft.mujoco.step.compiled` computes them."""

from __future__ import annotations

import ctypes

import mujoco
import numpy as np

from rft.mujoco.bed import Bed
from rft.mujoco.memory.addresses import Arrays, full_m_takes_data, functions
from rft.mujoco.memory.model_parts import ModelParts
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
from rft.mujoco.step.implicit import ACCURACY, Result
from rft.mujoco.step.parts import cut
from rft.mujoco.step.rows import Rows

POINTER = ctypes.c_void_p


def add_forces(bed: Bed, parts: ModelParts, data: int):
    """Add the forces of the grains to qfrc_passive of the mjData at an address.

    Returns (result, geom, wrenches, twists) of
    `rft.mujoco.step.equations.solve_blocks`; None where no geom is in the ground."""
    arrays = Arrays(data, parts.sizes)
    frames = bed.frames(arrays)
    velocity = arrays.qvel
    distance = frames.height + (frames.up * bed.geoms.spheres[:, :3]).sum(1)
    in_reach = distance < bed.geoms.spheres[:, 3]
    if hasattr(mujoco.MjData, "body_awake"):
        in_reach &= (
            arrays.body_awake[bed.geoms.bodies] != 0
        )  # what sleeps needs no force
    if not in_reach.any() or not (np.abs(velocity) < FASTEST).all():
        return None
    height = np.where(in_reach, frames.height, np.inf)
    grains = cut(
        bed.blocks, bed.laws, bed.zones, bed.ground, frames._replace(height=height)
    )
    in_ground = np.zeros(len(bed.geoms), bool)
    in_ground[np.unique(grains.zones[0].owner)] = True
    if not in_ground.any():
        return None
    inputs = _inputs(bed, parts, data, arrays, frames, in_ground)
    wrenches, twists = np.zeros((2, len(bed.geoms), 6))
    result, geom = solve_blocks(
        inputs, grains, bed.ground.rounding, ACCURACY, wrenches, twists
    )
    arrays.qfrc_passive[:] += np.einsum("gin,gi->n", inputs.jacobian, wrenches)
    return result, geom, wrenches, twists


def _inputs(bed, parts, data: int, arrays: Arrays, frames, in_ground) -> Inputs:
    """Return what the motion follows from."""
    integrator = _integer(parts.integrator)
    step = ctypes.c_double.from_address(parts.timestep).value
    step = step / 2 if integrator == RUNGE_KUTTA else step
    force = _force_without_grains(parts, data, arrays)
    inertia = _inertia(parts, data, arrays)
    effective = inertia.copy()
    is_damped = _add_implicit_terms(parts, data, arrays, integrator, effective, step)
    moved = bed.geoms.moved_by
    return Inputs(
        inertia,
        effective,
        is_damped,
        force,
        arrays.qvel.copy(),
        arrays.qacc_warmstart.copy(),
        step,
        _jacobians(bed, arrays, frames, in_ground),
        np.concatenate([np.flatnonzero(one) for one in moved]),
        np.concatenate([[0], np.cumsum(moved.sum(1))]),
        in_ground,
        _constraint_rows(parts, data, arrays),
        parts.trees,
    )


def _call(name: str, *arguments) -> None:
    """Call one of MuJoCo's functions, which return nothing."""
    kinds = [ctypes.c_int32 if isinstance(x, np.int32) else POINTER for x in arguments]
    function = ctypes.CFUNCTYPE(None, *kinds)(functions()[name])
    function(*map(int, arguments))


def _integer(address: int) -> int:
    return ctypes.c_int32.from_address(address).value


def _force_without_grains(parts: ModelParts, data: int, arrays: Arrays) -> np.ndarray:
    """Return all smooth forces (nv,) of this step but those of the grains."""
    bias = np.zeros(parts.sizes["nv"])
    _call("mj_rne", parts.address, data, np.int32(0), bias.ctypes.data)
    _call("mj_fwdActuation", parts.address, data)
    force = arrays.qfrc_passive - bias + arrays.qfrc_applied + arrays.qfrc_actuator
    last, roots = parts.bodies.T
    add_body_forces(
        force,
        arrays.xfrc_applied,
        arrays.xipos,
        arrays.subtree_com,
        arrays.cdof,
        last,
        roots,
        parts.parents,
    )
    return force


def _inertia(parts: ModelParts, data: int, arrays: Arrays) -> np.ndarray:
    """Return the inertia (nv, nv)."""
    nv = parts.sizes["nv"]
    matrix = np.zeros((nv, nv))
    if full_m_takes_data():
        _call("mj_fullM", parts.address, data, matrix.ctypes.data)
    else:
        _call("mj_fullM", parts.address, matrix.ctypes.data, arrays.qM.ctypes.data)
    return matrix


def _add_implicit_terms(parts, data, arrays, integrator, effective, step) -> bool:
    """Add what the integrator takes implicitly to the inertia, and return whether there
    is any."""
    if integrator in (IMPLICIT, IMPLICIT_FAST):
        with_bias = np.int32(integrator == IMPLICIT)
        _call("mjd_smooth_vel", parts.address, data, with_bias)
    elif _integer(parts.disableflags) & int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP):
        return False
    count = parts.sizes["nv"]
    damping = np.ctypeslib.as_array(
        (ctypes.c_double * count).from_address(parts.damping)
    )
    return add_implicit_terms(
        effective,
        step,
        integrator,
        damping,
        arrays.qDeriv,
        parts.derivative_rows,
        parts.derivative_columns,
    )


def _jacobians(bed: Bed, arrays: Arrays, frames, in_ground) -> np.ndarray:
    """Return the Jacobians (G, 6, nv) of the geoms in the ground along their own
    axes."""
    arm = frames.place - arrays.subtree_com[bed.geoms.roots]
    spin, speed = arrays.cdof[None, :, :3], arrays.cdof[None, :, 3:]
    speed = speed + np.cross(spin, arm[:, None])
    spin = np.broadcast_to(spin, speed.shape)
    both = [np.einsum("gij,gvi->gjv", frames.turn, x) for x in (speed, spin)]
    moves = bed.geoms.moved_by & in_ground[:, None]
    return np.concatenate(both, 1) * moves[:, None]


def _constraint_rows(parts: ModelParts, data: int, arrays: Arrays) -> Rows:
    """Return MuJoCo's constraint rows, by all degrees of freedom."""
    count, nv = arrays.nefc, parts.sizes["nv"]
    if count:
        _call("mj_referenceConstraint", parts.address, data)
    jacobian = np.zeros((count, nv))
    if count and parts.sizes["is_sparse"]:
        row_of = np.repeat(np.arange(count), arrays.efc_J_rownnz)
        jacobian[row_of, arrays.efc_J_colind] = arrays.efc_J
    elif count:
        jacobian[:] = arrays.efc_J.reshape(count, nv)
    kinds = arrays.efc_type.astype(np.int64)
    cones, scales = np.zeros((0, 2), np.int64), np.zeros((0, 6))
    contacts = [*arrays.cones()]
    if contacts and count:
        cones = np.array([(first, dim) for first, dim, _, _ in contacts], np.int64)
        scales = np.array([(mu, *friction) for _, _, mu, friction in contacts])
    cones, scales = elliptic_rows(kinds, cones, scales)
    return Rows(
        jacobian,
        jacobian,
        arrays.efc_D.copy(),
        arrays.efc_aref.copy(),
        kinds,
        arrays.efc_frictionloss.copy(),
        cones,
        scales,
    )


__all__ = ["Result", "add_forces"]
