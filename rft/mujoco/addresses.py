"""Where the arrays of MuJoCo's structures lie, found at run time: no version's layout is written down."""

from __future__ import annotations

import ctypes
import functools
import math
from typing import NamedTuple

import mujoco
import numpy as np

from rft.refusal import Refusal


class Arrays(NamedTuple):
    """Arrays of an mjData that the forces of grains follow from, and the one that they go to. cvel: angular and linear
    velocity of each body about subtree_com of its root; cdof: the same for a unit of each velocity of a joint."""

    qfrc_passive: np.ndarray
    geom_xpos: np.ndarray
    geom_xmat: np.ndarray
    cvel: np.ndarray
    cdof: np.ndarray
    subtree_com: np.ndarray

    @classmethod
    def at(cls, data: int, nv: int, ngeom: int, nbody: int) -> Arrays:
        """Return the arrays of the mjData at an address; they share its memory."""
        shapes = (nv,), (ngeom, 3), (ngeom, 9), (nbody, 6), (nv, 6), (nbody, 3)
        views = []
        for offset, shape in zip(offsets(), shapes):
            first = ctypes.c_uint64.from_address(data + 8 * int(offset)).value
            views.append(np.ctypeslib.as_array((ctypes.c_double * math.prod(shape)).from_address(first)).reshape(shape))
        return cls(*views)


FARTHEST = 400_000  # bytes: where the search in a structure of 4.0, some 165 kB long, gives up
BODY = '<body><freejoint/><geom size="0.1"/></body>'


@functools.cache
def offsets() -> np.ndarray:
    """Return the places (6,) of the pointers to the arrays of `Arrays` in an mjData, in units of 8 bytes.

    The address of each array is looked up in the structure of one MjData and must stand in another one's at the same
    place."""
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{BODY}</worldbody></mujoco>")
    first, second = mujoco.MjData(model), mujoco.MjData(model)
    found = [_offset(first, name) for name in Arrays._fields]
    if None in found or any(_word(second, k) != _address(second, name) for k, name in zip(found, Arrays._fields)):
        raise Refusal(
            f"MuJoCo {mujoco.__version__} keeps its arrays where they are not found", instead="uninstall numba"
        )
    return np.array(found)


def _address(data: mujoco.MjData, name: str) -> int:
    return getattr(data, name).__array_interface__["data"][0]


def _word(data: mujoco.MjData, k: int) -> int:
    return ctypes.c_uint64.from_address(data._address + 8 * k).value


def _offset(data: mujoco.MjData, name: str) -> int | None:
    address = _address(data, name)
    return next((k for k in range(FARTHEST // 8) if _word(data, k) == address), None)
