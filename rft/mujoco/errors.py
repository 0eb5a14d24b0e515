"""The error of a run in sand, by two runs more: one with steps half as long, one with elements half as long."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from rft.mujoco import installed
from rft.mujoco.bed import Bed
from rft.terradynamics.meshes.blocks import Blocks
from rft.terradynamics.meshes.contact import faces
from rft.terradynamics.meshes.geoms import mesh_of_elements

# A difference d of runs at lengths h and h / 2 leaves the error d / (1 - 2^-p) of the first, p the order.
ORDER_OF_STEPS, ORDER_OF_ELEMENTS = 1, 2
Control = Callable[[mujoco.MjModel, mujoco.MjData], None]


class RunError(NamedTuple):
    """Errors of where the geoms in the sand are after a run, m, the largest of all geoms.

    step: of the time step, which is of order 1. elements: of their length, of order 2. moved: how far the geom has moved
    that moved farthest, m."""

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
    """Return `rft.mujoco.sand.Sand.error`."""
    state = _state(model, data)
    start = _places(model, bed, state, 0.0, 1, None)
    plain = _places(model, bed, state, seconds, 1, control)
    halved = _places(model, bed, state, seconds, 2, control)
    finer = _places(
        model, _finer(model, bed, hulls, element), state, seconds, 1, control
    )
    return RunError(
        _largest(plain, halved) / (1 - 2.0**-ORDER_OF_STEPS),
        _largest(plain, finer) / (1 - 2.0**-ORDER_OF_ELEMENTS),
        _largest(plain, start),
    )


def _largest(places: np.ndarray, others: np.ndarray) -> float:
    """Return the largest distance between places (G, 3), m."""
    return float(np.linalg.norm(places - others, axis=1).max())


def _state(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Return all numbers that the further motion depends on."""
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.zeros(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def _places(model, bed: Bed, state, seconds: float, share: int, control) -> np.ndarray:
    """Return where the geoms are, (G, 3), after a run from a state with the ``share``-th part of the time step."""
    own = copy.copy(model)
    own.opt.timestep = model.opt.timestep / share
    data = mujoco.MjData(own)
    mujoco.mj_setState(own, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    row = installed.install(own, bed)
    try:
        steps = share * round(seconds / model.opt.timestep)
        for _ in range(steps if control else 0):
            control(own, data)
            mujoco.mj_step(own, data)
        if not control and steps:
            mujoco.mj_step(own, data, steps)
        mujoco.mj_kinematics(own, data)
        return data.geom_xpos[bed.geoms].copy()
    finally:
        installed.remove(row)


def _finer(model: mujoco.MjModel, bed: Bed, hulls: bool, element: float | None) -> Bed:
    """Return the bed with elements half as long on each geom, in all directions. element: m, of edges; None for those that
    the shapes ask for."""
    half, own = element and element / 2, []
    for geom in bed.geoms:
        mesh = mesh_of_elements(model, int(geom), half, hulls, 1.0 if half else 0.5)
        own.append(faces(mesh.vertices[mesh.faces], mesh.middle_normals))
    return replace(bed, blocks=Blocks(own))
