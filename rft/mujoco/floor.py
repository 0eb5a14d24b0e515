"""The floor of a model where the sand lies: geoms in the sand pass through it, all others go on to touch it."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from rft.core.refusal import formatted, require
from rft.terradynamics.meshes.geoms import geom_name

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
        return cls(
            model.geom_contype,
            model.geom_conaffinity,
            model.flex_contype,
            model.flex_conaffinity,
        )

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
        if (
            fixed
            and along > np.cos(PARALLEL)
            and abs(up @ data.geom_xpos[geom] - level) < NEAR
        ):
            found.append(int(geom))
    return found


class Apart(NamedTuple):
    """What touches no floor in a model. old: masks that the model had. new: those that it was given. pairs: geoms of each
    bed, and the planes that they do not touch."""

    old: Masks
    new: Masks
    pairs: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]


_apart: weakref.WeakKeyDictionary[mujoco.MjModel, Apart] = weakref.WeakKeyDictionary()


def apart(model: mujoco.MjModel, geoms: Sequence[int], planes: Sequence[int]) -> Apart:
    """Return what touches no floor once these geoms do not touch these planes either; nothing is changed yet."""
    known = _apart.get(model) or Apart(Masks.of(model).copied(), Masks.of(model), ())
    named = [
        x
        for x in zip(model.pair_geom1, model.pair_geom2)
        if {*x} & {*planes} and {*x} & {*geoms}
    ]
    names = " and ".join(
        formatted(geom_name(model, g)) for pair in named[:1] for g in pair
    )
    require(not named, f"a <pair> of <contact> makes {names} touch", instead="drop it")
    pairs = (*known.pairs, (tuple(geoms), tuple(planes)))
    return Apart(known.old, _masks(known.old, pairs), pairs)


def part(model: mujoco.MjModel, separation: Apart) -> None:
    """Let geoms and planes touch each other no more."""
    _apart[model] = separation
    _write(model, separation.new)


def rejoin(model: mujoco.MjModel, geoms: Sequence[int], planes: Sequence[int]) -> None:
    """Let these geoms touch these planes again; masks that the user has set since stay."""
    known = _apart.get(model)
    if known is None or not all(
        np.array_equal(a, b) for a, b in zip(Masks.of(model), known.new)
    ):
        return
    pairs = tuple(pair for pair in known.pairs if pair != (tuple(geoms), tuple(planes)))
    _write(model, _masks(known.old, pairs))
    if pairs:
        _apart[model] = Apart(known.old, _masks(known.old, pairs), pairs)
    else:
        del _apart[model]


def _masks(old: Masks, pairs) -> Masks:
    """Return masks with which geoms touch none of their planes, and everything else touches as before.

    Each plane has one bit, which no contype has; what touched it, but for those geoms, gets the bit in its conaffinity."""
    new, used = (
        old.copied(),
        int(np.bitwise_or.reduce([*map(int, np.concatenate(old)), 0]) & 0xFFFFFFFF),
    )
    for plane in sorted({plane for _, planes in pairs for plane in planes}):
        free = next((bit for bit in range(31) if not used >> bit & 1), None)
        require(
            free is not None,
            "no bit is free to tell the floor from other geoms",
            instead="use fewer contypes",
        )
        used |= 1 << free
        contype, conaffinity = old.contype[plane], old.conaffinity[plane]
        touched = ((old.contype & conaffinity) | (old.conaffinity & contype)) != 0
        touched[
            [geom for geoms, planes in pairs if plane in planes for geom in geoms]
            + [plane]
        ] = False
        new.conaffinity[touched] |= 1 << free
        touched = (
            (old.flex_contype & conaffinity) | (old.flex_conaffinity & contype)
        ) != 0
        new.flex_conaffinity[touched] |= 1 << free
        new.contype[plane], new.conaffinity[plane] = 1 << free, 0
    return new


def _write(model: mujoco.MjModel, masks: Masks) -> None:
    """Write masks into a model."""
    for own, other in zip(Masks.of(model), masks):
        own[:] = other
