"""Where the arrays of MuJoCo's structures lie, found at run time: no version's layout is written down."""

from __future__ import annotations

import ctypes
import functools

import mujoco
import numpy as np

from rft.refusal import Refusal

READ = "qfrc_passive", "geom_xpos", "geom_xmat", "cvel", "cdof", "subtree_com"
FARTHEST = 400_000  # bytes: where the search in a structure of 4.0, some 165 kB long, gives up
BODY = '<body><freejoint/><geom size="0.1"/></body>'


@functools.cache
def offsets() -> np.ndarray:
    """Return the places (6,) of the pointers to the arrays `READ` in an mjData, in units of 8 bytes.

    The address of each array is looked up in the structure of one MjData and must stand in another one's at the same
    place."""
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{BODY}</worldbody></mujoco>")
    first, second = mujoco.MjData(model), mujoco.MjData(model)
    found = [_offset(first, name) for name in READ]
    if None in found or any(_word(second, k) != _address(second, name) for k, name in zip(found, READ)):
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
