"""What the equations of a step take from a model: fixed numbers, and addresses of those
that a user may change."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import mujoco
import numpy as np

from rft.mujoco.memory.addresses import options_of, sizes_of, time_step


class ModelParts(NamedTuple):
    """Parts of a model, without a reference to it. address: of the model. sizes:
    `sizes_of`, and whether matrices are sparse. bodies: (nbody, 2), the last degree of
    freedom that moves each body, -1 for none, and its root. parents, trees: (nv,), of
    each degree of freedom. derivative_rows, derivative_columns: (nD,), of qDeriv.
    timestep, integrator, disableflags, damping, geom_size, geom_type, geom_dataid:
    addresses in the model's own memory."""

    address: int
    sizes: dict[str, int]
    bodies: np.ndarray
    parents: np.ndarray
    trees: np.ndarray
    derivative_rows: np.ndarray
    derivative_columns: np.ndarray
    timestep: int
    integrator: int
    disableflags: int
    damping: int
    geom_size: int
    geom_type: int
    geom_dataid: int

    @classmethod
    def of(cls, model: mujoco.MjModel) -> ModelParts:
        """Return the parts of a model."""
        sizes = sizes_of(model) | {"is_sparse": int(mujoco.mj_isSparse(model))}
        last = [last_dof(model, body) for body in range(model.nbody)]
        structure = model if hasattr(model, "D_rownnz") else mujoco.MjData(model)
        rows = np.repeat(np.arange(model.nv), structure.D_rownnz)
        integrator, flags = options_of(model).tolist()
        return cls(
            model._address,
            sizes,
            np.stack([last, model.body_rootid], -1).astype(np.int64),
            model.dof_parentid.astype(np.int64),
            model.dof_treeid.astype(np.int64),
            rows.astype(np.int64),
            structure.D_colind.astype(np.int64),
            _address(time_step(model)),
            integrator,
            flags,
            _address(model.dof_damping),
            _address(model.geom_size),
            _address(model.geom_type),
            _address(model.geom_dataid),
        )

    def shape_numbers(self, geoms: np.ndarray) -> np.ndarray:
        """Return the numbers that the elements of geoms follow from, as they are now,
        (G, 5)."""
        count = self.sizes["ngeom"]
        sizes = (ctypes.c_double * (3 * count)).from_address(self.geom_size)
        kinds = (ctypes.c_int32 * count).from_address(self.geom_type)
        meshes = (ctypes.c_int32 * count).from_address(self.geom_dataid)
        size = np.ctypeslib.as_array(sizes).reshape(count, 3)[geoms]
        rest = [np.ctypeslib.as_array(x)[geoms, None] for x in (kinds, meshes)]
        return np.concatenate([size, *rest], axis=1)


def last_dof(model: mujoco.MjModel, body: int) -> int:
    """Return the last degree of freedom that moves a body, its own or that of the body
    it is welded to; -1 for none."""
    while body and not model.body_dofnum[body]:
        body = model.body_parentid[body]
    if not body:
        return -1
    return int(model.body_dofadr[body] + model.body_dofnum[body] - 1)


def _address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]
