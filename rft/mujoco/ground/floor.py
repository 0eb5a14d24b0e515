"""The floor of a model where the sand lies: geoms in the sand pass through it, all
others still touch it."""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from rft.core.refusal import Refusal, formatted, require
from rft.terradynamics.meshes.geoms import geom_name

NEAR = 1e-3  # m: planes that near the surface are the floor of the sand
PARALLEL = 1e-3  # rad: planes tilted by less are parallel to the surface
N_BITS = 31  # of a mask, besides the sign

# Geoms of a bed, and the planes that they do not touch.
Pair = tuple[tuple[int, ...], tuple[int, ...]]


class Masks(NamedTuple):
    """Bits that decide which geoms and flexes touch: contype and conaffinity of
    both."""

    contype: np.ndarray
    conaffinity: np.ndarray
    flex_contype: np.ndarray
    flex_conaffinity: np.ndarray

    @classmethod
    def of(cls, model: mujoco.MjModel) -> Masks:
        """Return the masks of a model, views of its arrays."""
        return cls(
            model.geom_contype,
            model.geom_conaffinity,
            model.flex_contype,
            model.flex_conaffinity,
        )

    def copies(self) -> Masks:
        """Return copies of the arrays."""
        return Masks(*(np.array(x) for x in self))


def floors(model: mujoco.MjModel, up: np.ndarray, level: float) -> list[int]:
    """Return the planes fixed to the world that lie in the surface of the sand, up . x
    = level."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    floor_planes = []
    for geom in np.flatnonzero(model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)):
        normal = data.geom_xmat[geom].reshape(3, 3)[:, 2]
        is_fixed = model.body_weldid[model.geom_bodyid[geom]] == 0
        is_parallel = normal @ up > np.cos(PARALLEL)
        is_near = abs(up @ data.geom_xpos[geom] - level) < NEAR
        if is_fixed and is_parallel and is_near:
            floor_planes.append(int(geom))
    return floor_planes


class Exclusion(NamedTuple):
    """Contacts between geoms in sand and its floors, which a model leaves out.

    old: masks that the model had. new: masks that exclude the contacts. pairs: for each
    bed its geoms and the planes that they do not touch."""

    old: Masks
    new: Masks
    pairs: tuple[Pair, ...]


_exclusions: weakref.WeakKeyDictionary[mujoco.MjModel, Exclusion] = (
    weakref.WeakKeyDictionary()
)


def exclude_floor_contacts(
    model: mujoco.MjModel, geoms: Sequence[int], planes: Sequence[int]
) -> Exclusion:
    """Return the exclusion of a model with contacts between these geoms and planes
    added; the model is not changed until `apply_exclusion`."""
    _require_no_pair(model, geoms, planes)
    old = Masks.of(model).copies()
    pairs: tuple[Pair, ...] = ()
    before = _exclusions.get(model)
    if before:
        old = before.old
        pairs = before.pairs
    pairs = (*pairs, (tuple(geoms), tuple(planes)))
    return Exclusion(old, _masks_without_contacts(old, pairs), pairs)


def _require_no_pair(
    model: mujoco.MjModel, geoms: Sequence[int], planes: Sequence[int]
) -> None:
    """Raise Refusal where a <pair>, which masks do not rule, makes a geom touch a
    plane."""
    for pair in zip(model.pair_geom1, model.pair_geom2):
        if {*pair} & {*planes} and {*pair} & {*geoms}:
            names = " and ".join(formatted(geom_name(model, g)) for g in pair)
            raise Refusal(
                f"a <pair> of <contact> makes {names} touch", instead="remove it"
            )


def apply_exclusion(model: mujoco.MjModel, exclusion: Exclusion) -> None:
    """Exclude contacts from a model."""
    _exclusions[model] = exclusion
    _write(model, exclusion.new)


def restore_floor_contacts(
    model: mujoco.MjModel, geoms: Sequence[int], planes: Sequence[int]
) -> None:
    """Let these geoms touch these planes again; masks that the user has set since
    stay."""
    exclusion = _exclusions.get(model)
    if exclusion is None:
        return
    for present, written in zip(Masks.of(model), exclusion.new):
        if not np.array_equal(present, written):
            return
    removed = (tuple(geoms), tuple(planes))
    pairs = tuple(pair for pair in exclusion.pairs if pair != removed)
    masks = _masks_without_contacts(exclusion.old, pairs)
    _write(model, masks)
    if pairs:
        _exclusions[model] = Exclusion(exclusion.old, masks, pairs)
    else:
        del _exclusions[model]


def _masks_without_contacts(old: Masks, pairs: Iterable[Pair]) -> Masks:
    """Return masks with which geoms touch none of their planes, and everything else
    touches as before.

    Each plane gets one bit that no contype has. Whatever touched the plane, except for
    those geoms, gets the bit in its conaffinity."""
    new = old.copies()
    used = int(np.bitwise_or.reduce([*map(int, np.concatenate(old)), 0])) & 0xFFFFFFFF
    planes = {plane for _, its_planes in pairs for plane in its_planes}
    for plane in sorted(planes):
        free = [bit for bit in range(N_BITS) if not used >> bit & 1]
        require(
            len(free) > 0,
            "no bit is left to distinguish the floor from other geoms",
            instead="use fewer contypes",
        )
        flag = 1 << free[0]
        used |= flag
        contype = old.contype[plane]
        conaffinity = old.conaffinity[plane]

        touching = ((old.contype & conaffinity) | (old.conaffinity & contype)) != 0
        touching[plane] = False
        for geoms, its_planes in pairs:
            if plane in its_planes:
                touching[list(geoms)] = False
        new.conaffinity[touching] |= flag

        flexes = (old.flex_contype & conaffinity) | (old.flex_conaffinity & contype)
        new.flex_conaffinity[flexes != 0] |= flag
        new.contype[plane] = flag
        new.conaffinity[plane] = 0
    return new


def _write(model: mujoco.MjModel, masks: Masks) -> None:
    """Write masks into a model."""
    for own, other in zip(Masks.of(model), masks):
        own[:] = other
