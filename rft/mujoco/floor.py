"""The floor of a model where the sand lies: geoms in the sand pass through it, all others go on to touch it."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from rft.mujoco.geoms import geom_name
from rft.refusal import formatted, require

NEAR = 1e-3  # m: planes that near the surface are the floor of the sand
PARALLEL = 1e-3  # rad


class Masks(NamedTuple):
    """Bits that decide which geoms and flexes touch: contype and conaffinity of both."""

    contype: np.ndarray
    conaffinity: np.ndarray
    flex_contype: np.ndarray
    flex_conaffinity: np.ndarray

    @classmethod
    def of(cls, model: mujoco.MjModel) -> Masks:
        """Return the masks of a model, views of its arrays."""
        return cls(model.geom_contype, model.geom_conaffinity, model.flex_contype, model.flex_conaffinity)

    def copied(self) -> Masks:
        """Return copies of the arrays."""
        return Masks(*(np.array(x) for x in self))


def floors(model: mujoco.MjModel, up: np.ndarray, level: float) -> list[int]:
    """Return the planes fixed to the world that lie in the surface of the sand, up . x = level."""
    data, found = mujoco.MjData(model), []
    mujoco.mj_kinematics(model, data)
    for geom in np.flatnonzero(model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)):
        along = data.geom_xmat[geom].reshape(3, 3)[:, 2] @ up
        fixed = model.body_weldid[model.geom_bodyid[geom]] == 0
        if fixed and along > np.cos(PARALLEL) and abs(up @ data.geom_xpos[geom] - level) < NEAR:
            found.append(int(geom))
    return found


def masks_without_contact(model: mujoco.MjModel, geoms: list[int], planes: list[int]) -> Masks:
    """Return masks with which these geoms touch none of the planes, and everything else touches as before.

    The planes keep one bit, which no other contype has; what touched them, but for the geoms, gets it in its
    conaffinity."""
    old, pairs = Masks.of(model).copied(), zip(model.pair_geom1, model.pair_geom2)
    named = next((x for x in pairs if {*x} & {*planes} and {*x} & {*geoms}), None)
    names = named and " and ".join(formatted(geom_name(model, g)) for g in named)
    require(named is None, f"a <pair> of <contact> makes {names} touch", instead="drop it")
    used = int(np.bitwise_or.reduce([*map(int, np.concatenate([x.ravel() for x in old])), 0]) & 0xFFFFFFFF)
    free = next((bit for bit in range(31) if not used >> bit & 1), None)
    require(free is not None, "no bit is free to tell the floor from other geoms", instead="use fewer bits of contype")
    bit, new = 1 << free, old.copied()
    for contype, conaffinity, own, plane_types in (
        (old.contype, old.conaffinity, new.conaffinity, geoms + planes),
        (old.flex_contype, old.flex_conaffinity, new.flex_conaffinity, []),
    ):
        touched = np.zeros(len(contype), bool)
        for plane in planes:
            touched |= ((contype & old.conaffinity[plane]) != 0) | ((conaffinity & old.contype[plane]) != 0)
        touched[plane_types] = False
        own[touched] |= bit
    new.contype[planes], new.conaffinity[planes] = bit, 0
    return new


def set_masks(model: mujoco.MjModel, masks: Masks) -> None:
    """Write masks into a model."""
    for own, other in zip(Masks.of(model), masks):
        own[:] = other
