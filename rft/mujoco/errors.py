"""The error of a run in sand, by two more runs: one with steps half as long, one with
elements half as long."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from rft.mujoco import installed
from rft.mujoco.bed import Bed
from rft.terradynamics.meshes.forces.blocks import Blocks
from rft.terradynamics.meshes.forces.contact import faces
from rft.terradynamics.meshes.geoms import mesh_of_elements

# A difference d of runs at lengths h and h / 2 leaves the error d / (1 - 2^-p) of the
# first, p the order.
ORDER_OF_STEPS = 1
ORDER_OF_ELEMENTS = 2
Control = Callable[[mujoco.MjModel, mujoco.MjData], None]


class RunError(NamedTuple):
    """Errors of the places of the geoms in the sand after a run, m, the largest of all
    geoms.

    step: of the time step, which is of order 1. elements: of their length, of order 2.
    moved: the farthest distance that a geom has moved, m."""

    step: float
    elements: float
    moved: float


def error_of_run(
    model: mujoco.MjModel,
    bed: Bed,
    data: mujoco.MjData,
    seconds: float,
    control: Control | None,
    hulls: bool,
    element: float | None = None,
) -> RunError:
    """Return the errors of `rft.mujoco.sand.Sand.error`."""
    state = _state(model, data)
    half_elements = _with_half_elements(model, bed, hulls, element)
    start = _places_after(model, bed, state, 0.0, 1, None)
    plain = _places_after(model, bed, state, seconds, 1, control)
    half_steps = _places_after(model, bed, state, seconds, 2, control)
    finer = _places_after(model, half_elements, state, seconds, 1, control)
    return RunError(
        _largest_distance(plain, half_steps) / (1 - 2.0**-ORDER_OF_STEPS),
        _largest_distance(plain, finer) / (1 - 2.0**-ORDER_OF_ELEMENTS),
        _largest_distance(plain, start),
    )


def _largest_distance(places: np.ndarray, others: np.ndarray) -> float:
    """Return the largest distance between places (G, 3), m."""
    return float(np.linalg.norm(places - others, axis=1).max())


def _state(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Return all numbers that the further motion depends on."""
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.zeros(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def _places_after(
    model: mujoco.MjModel,
    bed: Bed,
    state: np.ndarray,
    seconds: float,
    substeps: int,
    control: Control | None,
) -> np.ndarray:
    """Return the places of the geoms, (G, 3), m, after a run from a state with each
    time step in ``substeps`` parts."""
    own = copy.copy(model)
    own.opt.timestep = model.opt.timestep / substeps
    data = mujoco.MjData(own)
    mujoco.mj_setState(own, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    steps = substeps * round(seconds / model.opt.timestep)
    row = installed.install(own, bed)
    try:
        if control:
            for _ in range(steps):
                control(own, data)
                mujoco.mj_step(own, data)
        elif steps:
            mujoco.mj_step(own, data, steps)
        mujoco.mj_kinematics(own, data)
        return data.geom_xpos[bed.geoms.ids].copy()
    finally:
        installed.remove(row)


def _with_half_elements(
    model: mujoco.MjModel, bed: Bed, hulls: bool, element: float | None
) -> Bed:
    """Return the bed with elements half as long on each geom. element: m, of edges;
    None for those that the shapes ask for."""
    if element:
        half, share = element / 2, 1.0
    else:
        half, share = None, 0.5
    own_faces = []
    for geom in bed.geoms.ids:
        mesh = mesh_of_elements(model, int(geom), half, hulls, share)
        own_faces.append(faces(mesh.vertices[mesh.faces], mesh.middle_normals))
    return replace(bed, blocks=Blocks(own_faces))
