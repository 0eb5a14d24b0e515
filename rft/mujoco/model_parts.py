"""What the equations of a step take from a model: fixed numbers, and addresses of those that a user may change."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from rft.mujoco.addresses import options_of, sizes_of, time_step


class ModelParts(NamedTuple):
    """Parts of a model, without a reference to it. address: of the model. sizes: `sizes_of`, and whether matrices are
    sparse. bodies: (nbody, 2), the last degree of freedom that moves each body, -1 for none, and its root. parents, trees:
    (nv,), of each degree of freedom. derivative_rows, derivative_columns: (nD,), of qDeriv. timestep, integrator,
    disableflags, damping: addresses in the model's own memory."""

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
        )


def last_dof(model: mujoco.MjModel, body: int) -> int:
    """Return the last degree of freedom that moves a body, its own or that of the body it is welded to; -1 for none."""
    while body and not model.body_dofnum[body]:
        body = model.body_parentid[body]
    if not body:
        return -1
    return int(model.body_dofadr[body] + model.body_dofnum[body] - 1)


def _address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]
