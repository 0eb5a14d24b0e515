"""Where the arrays of MuJoCo's structures lie, found at run time: no version's layout is written down."""

from __future__ import annotations

import ctypes
import functools
import math
import struct
from typing import NamedTuple

import mujoco
import numpy as np

from rft.refusal import require


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
            views.append(
                np.ctypeslib.as_array(
                    (ctypes.c_double * math.prod(shape)).from_address(first)
                ).reshape(shape)
            )
        return cls(*views)


FARTHEST = (
    400_000  # bytes: where the search in a structure of 4.0, some 165 kB long, gives up
)
POINTERS = 30  # words after the first that may hold the same address
# Models of different parts. An array without entries has the address of the next one that has some, so that one model alone
# does not tell them apart.
BODY = """<body name="{0}" pos="0 0 {1}"><freejoint/><geom size="0.1"/><site name="{0}"/><camera/><light/>
<body><joint name="j{0}"/><geom size="0.1"/></body></body>"""
PARTS = """<worldbody><body mocap="true"><geom size="0.1"/></body></worldbody>
<tendon><fixed name="t"><joint joint="ja" coef="1"/></fixed></tendon><equality><weld body1="a" body2="b"/></equality>
<actuator><motor joint="ja"/><general joint="jb" dyntype="integrator"/></actuator>
<sensor><framepos objtype="site" objname="a"/></sensor>"""
MODELS = (
    f"<worldbody>{BODY.format('a', 1)}</worldbody>",
    f"<worldbody>{BODY.format('a', 1)}{BODY.format('b', 0)}</worldbody>{PARTS}",
    "<worldbody><body><joint/><geom size='0.1'/></body></worldbody>",
)


@functools.cache
def offsets() -> np.ndarray:
    """Return the places (6,) of the pointers to the arrays of `Arrays` in an mjData, in units of 8 bytes.

    The address of each array is looked up in the structures of data of several models. Where it stands at more than one
    place in all of them, the last is right: empty arrays come before the one whose address they share."""
    all_data = [
        mujoco.MjData(mujoco.MjModel.from_xml_string(f"<mujoco>{text}</mujoco>"))
        for text in MODELS
    ]
    found = []
    for name in Arrays._fields:
        places = [_places(data, name) for data in all_data]
        found.append(max(functools.reduce(set.intersection, places), default=None))
    require(
        None not in found,
        UNKNOWN,
        because="its arrays are not where they are looked for",
        instead="report it",
    )
    return np.array(found)


@functools.cache
def memory_offsets() -> tuple[int, int]:
    """Return the places of the time and of the pointer to userdata in an mjData, in units of 8 bytes."""
    found = []
    for k, text in enumerate(MODELS):
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco><size nuserdata="{k + 5}"/>{text}</mujoco>'
        )
        data = mujoco.MjData(model)
        data.time = 0.1234567 * (k + 1)
        time = struct.unpack("<q", struct.pack("<d", data.time))[0]
        words = next(
            ({j} for j in range(FARTHEST // 8) if _word(data, j) == time), set()
        )
        found.append((words, _places(data, "userdata")))
    times, pointers = (set.intersection(*x) for x in zip(*found))
    require(
        bool(times and pointers),
        UNKNOWN,
        because="its userdata are not where they are looked for",
        instead="report it",
    )
    return max(times), max(pointers)


def time_step(model: mujoco.MjModel) -> np.ndarray:
    """Return the time step of a model, s, (1,), in the model's own memory."""
    return _before_gravity(model, _step_offset())


@functools.cache
def _step_offset() -> int:
    """Return how many numbers the time step stands before gravity in an mjOption."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="0.1234567"/></mujoco>'
    )
    found = (
        k
        for k in range(1, POINTERS)
        if _before_gravity(model, k)[0] == model.opt.timestep
    )
    offset = next(found, 0)
    require(
        offset > 0,
        UNKNOWN,
        because="its time step is not where it is looked for",
        instead="report it",
    )
    return offset


def _before_gravity(model: mujoco.MjModel, k: int) -> np.ndarray:
    """Return the number, (1,), that stands k numbers before gravity in a model's mjOption; it shares its memory."""
    gravity = model.opt.gravity.__array_interface__["data"][0]
    return np.ctypeslib.as_array((ctypes.c_double * 1).from_address(gravity - 8 * k))


UNKNOWN = f"MuJoCo {mujoco.__version__} is unknown"


def check_offsets(data: mujoco.MjData, with_memory: bool = False) -> None:
    """Raise Refusal unless the arrays of data of a model lie where `offsets` says; also userdata, with its memory."""
    right = all(
        _word(data, int(k)) == _address(data, name)
        for k, name in zip(offsets(), Arrays._fields)
    )
    right = right and not (
        with_memory and _word(data, memory_offsets()[1]) != _address(data, "userdata")
    )
    require(
        right,
        UNKNOWN,
        because="its arrays are not where they are looked for",
        instead="report it",
    )


def _address(data: mujoco.MjData, name: str) -> int:
    return getattr(data, name).__array_interface__["data"][0]


def _word(data: mujoco.MjData, k: int) -> int:
    return ctypes.c_uint64.from_address(data._address + 8 * k).value


def _places(data: mujoco.MjData, name: str) -> set[int]:
    """Return the places of all words from the start of the structure on that are the address of an array."""
    address = _address(data, name)
    first = next((k for k in range(FARTHEST // 8) if _word(data, k) == address), None)
    if first is None:
        return set()
    return {k for k in range(first, first + POINTERS) if _word(data, k) == address}
