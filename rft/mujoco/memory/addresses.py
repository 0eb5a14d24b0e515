"""Where the arrays of MuJoCo's structures lie, found at run time: no version's layout
is written down."""

from __future__ import annotations

import ctypes
import functools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from rft.core.refusal import require

UNKNOWN = f"MuJoCo {mujoco.__version__} is not supported"
# Bytes: where the search in a structure of 4.0, some 165 kB long, gives up.
FARTHEST = 400_000
POINTERS = 30  # words after the first that may hold the same address
NEFC_MAX = 100_000  # more rows or contacts than that are a fault of the search

# Arrays of an mjData by name: shape in sizes of the model, and type. "rows": of all
# constraint rows, "entries": of the entries of their Jacobian, "contacts": of the
# contacts; these lengths change from step to step.
ARRAYS = {
    "qfrc_passive": (("nv",), float),
    "geom_xpos": (("ngeom", 3), float),
    "geom_xmat": (("ngeom", 3, 3), float),
    "cvel": (("nbody", 6), float),
    "cdof": (("nv", 6), float),
    "subtree_com": (("nbody", 3), float),
    "userdata": (("nuserdata",), float),
    "qvel": (("nv",), float),
    "qfrc_applied": (("nv",), float),
    "xfrc_applied": (("nbody", 6), float),
    "xipos": (("nbody", 3), float),
    "qacc_warmstart": (("nv",), float),
    "qfrc_actuator": (("nv",), float),
    "qDeriv": (("nD",), float),
    "qM": (("nM",), float),
    "body_awake": (("nbody",), np.int32),
    "efc_J": (("entries",), float),
    "efc_J_rownnz": (("rows",), np.int32),
    "efc_J_rowadr": (("rows",), np.int32),
    "efc_J_colind": (("entries",), np.int32),
    "efc_D": (("rows",), float),
    "efc_aref": (("rows",), float),
    "efc_type": (("rows",), np.int32),
    "efc_frictionloss": (("rows",), float),
}
NOT_EVERYWHERE = {"body_awake", "qM"}  # arrays that 4.0 adds or lacks
COUNTS = ("nefc", "ncon")
FUNCTIONS = (
    "mj_fullM",
    "mj_rne",
    "mj_fwdActuation",
    "mj_referenceConstraint",
    "mjd_smooth_vel",
)


class Contacts(NamedTuple):
    """Where contacts lie. pointer: place of the pointer to the first one in an mjData,
    in units of 8 bytes. size: of one, bytes. mu, friction, dim, address: of its fields,
    bytes from its start."""

    pointer: int
    size: int
    mu: int
    friction: int
    dim: int
    address: int


class Places(NamedTuple):
    """Where things lie in an mjData. arrays: places of the pointers to `ARRAYS`, in
    units of 8 bytes, -1 for those that this version lacks. time: of the time, in units
    of 8 bytes. counts: of `COUNTS`, in units of 4 bytes."""

    arrays: dict[str, int]
    time: int
    counts: dict[str, int]
    contacts: Contacts


# Models of different parts. An array without entries has the address of the next one
# that has some, so that one model alone does not tell them apart. All have contacts of
# several kinds and more rows or fewer than before.
BODY = """<body name="{0}" pos="{2} 0 {1}"><freejoint/>
<geom size="0.1" condim="{3}"/><site name="{0}"/><camera/><light/>
<body><joint name="j{0}" frictionloss="0.1" damping="0.1"/><geom size="0.1"/></body>
</body>"""
FLOOR = '<geom type="plane" size="9 9 1"/>'
PARTS = """<worldbody><body mocap="true"><geom size="0.1"/></body></worldbody>
<tendon><fixed name="t"><joint joint="ja" coef="1"/></fixed></tendon>
<equality><weld body1="a" body2="b"/></equality>
<actuator><motor joint="ja"/><general joint="jb" dyntype="integrator"/></actuator>
<sensor><framepos objtype="site" objname="a"/></sensor>"""
BODY_A = BODY.format("a", 0.09, 0, 3)
BODY_A_OF_6 = BODY.format("a", 0.09, 0, 6)
BODY_B = BODY.format("b", 0.08, 2, 4)
FREE_BALL = '<body pos="0 0 0.09"><freejoint/><geom size="0.1"/></body>'
HINGED_BALL = """<body><joint frictionloss="1"/>
<geom size="0.1" pos="0 0 0.09"/></body>"""
MODELS = (
    f"<worldbody>{FLOOR}{BODY_A}</worldbody>",
    f"<worldbody>{FLOOR}{BODY_A_OF_6}{BODY_B}</worldbody>{PARTS}",
    f"<worldbody>{FLOOR}{FREE_BALL}</worldbody>",
    f"<worldbody>{FLOOR}{HINGED_BALL}</worldbody>",
)


@functools.cache
def places() -> Places:
    """Return where the arrays, the time and the counts lie in an mjData.

    The address of each array is looked up in the structures of data of several models.
    Where it stands at more than one place in all of them, the last is right: empty
    arrays come before the one whose address they share."""
    arrays: dict[str, set[int]] = {}
    counts: dict[str, set[int]] = {}
    times: set[int] = set()
    contacts: set[int] = set()
    for k, text in enumerate(MODELS):
        option = f'<option cone="elliptic"/><size nuserdata="{k + 5}"/>'
        model = mujoco.MjModel.from_xml_string(f"<mujoco>{option}{text}</mujoco>")
        data = mujoco.MjData(model)
        # Lifted bodies touch less, and have fewer constraint rows.
        for lift in (0.0, 0.005, 1.0):
            data.qpos[2 if model.nq > 2 else 0] += lift
            mujoco.mj_forward(model, data)
            data.time = 0.1234567 * (k + 1) + lift
            ints = _numbers(data, np.int32)
            for name in COUNTS:
                found = {*np.flatnonzero(ints == getattr(data, name)).tolist()}
                counts[name] = counts.get(name, found) & found
            if lift == 0.0:
                words = _numbers(data, np.int64)
                moment = np.float64(data.time).view(np.int64)
                now = {*np.flatnonzero(words == moment).tolist()}
                times = times & now if times else now
                for name in ARRAYS:
                    if hasattr(data, name):
                        found = _places(data, _address(getattr(data, name)))
                        arrays[name] = arrays.get(name, found) & found
                found = _places(data, _address(data.contact.dist))
                contacts = contacts & found if contacts else found
        if k == 1:
            data.qpos[2] -= 1.005
            mujoco.mj_forward(model, data)
            fields = _fields_of_contact(data.contact)
    lacking = [x for x in ARRAYS if not arrays.get(x) and x not in NOT_EVERYWHERE]
    is_complete = not lacking and bool(contacts and times and all(counts.values()))
    _require_known(is_complete)
    return Places(
        {name: max(arrays.get(name, [-1])) for name in ARRAYS},
        max(times),
        {name: min(counts[name]) for name in COUNTS},
        Contacts(max(contacts), *fields),
    )


def _fields_of_contact(contact) -> tuple[int, ...]:
    """Return the size of a contact and the places of its fields, bytes."""
    first = _address(contact.dist)
    size = contact.dist.__array_interface__["strides"][0]
    fields = contact.mu, contact.friction, contact.dim, contact.efc_address
    return size, *(_address(field) - first for field in fields)


def _numbers(data: mujoco.MjData, kind: type) -> np.ndarray:
    """Return the memory of an mjData as numbers of a kind."""
    item = np.ctypeslib.as_ctypes_type(kind)
    count = FARTHEST // np.dtype(kind).itemsize
    return np.ctypeslib.as_array((item * count).from_address(data._address))


def _places(data: mujoco.MjData, address: int) -> set[int]:
    """Return the places of all words from the start of the structure on that are an
    address, near the first of them."""
    found = np.flatnonzero(_numbers(data, np.int64) == address)
    return {*found[found < found[:1].sum() + POINTERS].tolist()}


def _address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def _require_known(is_known: bool) -> None:
    """Raise Refusal for a version of MuJoCo whose arrays are not found."""
    require(
        is_known,
        UNKNOWN,
        because="its arrays are not at the expected addresses",
        instead="please report it",
    )


@functools.cache
def functions() -> dict[str, int]:
    """Return the addresses of MuJoCo's functions that a step calls."""
    return {
        name: ctypes.cast(getattr(_library(), name), ctypes.c_void_p).value or 0
        for name in FUNCTIONS
    }


@functools.cache
def _library() -> ctypes.CDLL:
    """Return MuJoCo's library, which its Python module has loaded."""
    folder = Path(mujoco.__file__).parent
    found = [
        path
        for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
        for path in sorted(folder.glob(pattern))
    ]
    _require_known(len(found) > 0)
    return ctypes.CDLL(str(found[0]))


def full_m_takes_data() -> bool:
    """Return whether mj_fullM takes the data, as since 4.0, or their matrix and that
    last."""
    return int(mujoco.__version__.partition(".")[0]) >= 4


def sizes_of(model: mujoco.MjModel) -> dict[str, int]:
    """Return the sizes that arrays of a model's data have."""
    n_entries = getattr(model, "nD", None)
    if n_entries is None:
        n_entries = len(mujoco.MjData(model).qDeriv)
    names = "nv", "ngeom", "nbody", "nuserdata", "nM"
    return {name: int(getattr(model, name, 0)) for name in names} | {
        "nD": int(n_entries)
    }


class Arrays:
    """Arrays of the mjData at an address, which share its memory, by name; and the
    counts `COUNTS`."""

    def __init__(self, data: int, sizes: dict[str, int]):
        self._data = data
        for name, place in places().counts.items():
            setattr(self, name, ctypes.c_int32.from_address(data + 4 * place).value)
        self._sizes = sizes | {"rows": self.nefc}

    def __getattr__(self, name: str) -> np.ndarray:
        shape, kind = ARRAYS[name]
        sizes = self._sizes
        if "entries" in shape:
            sizes = sizes | {"entries": self._entries()}
        counts = [sizes[n] if isinstance(n, str) else n for n in shape]
        pointer = self._word(places().arrays[name])
        if not math.prod(counts):
            return np.zeros(counts, kind)
        item = np.ctypeslib.as_ctypes_type(kind) * math.prod(counts)
        return np.ctypeslib.as_array(item.from_address(pointer)).reshape(counts)

    def _word(self, place: int) -> int:
        return ctypes.c_int64.from_address(self._data + 8 * place).value

    def _entries(self) -> int:
        """Return the number of entries of the constraints' Jacobian."""
        if not self._sizes["is_sparse"]:
            return self.nefc * self._sizes["nv"]
        if not self.nefc:
            return 0
        return int(self.efc_J_rowadr[-1] + self.efc_J_rownnz[-1])

    @property
    def time(self) -> float:
        """Time, s."""
        place = places().time
        return ctypes.c_double.from_address(self._data + 8 * place).value

    def cones(self) -> Iterator[tuple[int, int, float, np.ndarray]]:
        """Yield first row, number of rows, mu and the five coefficients of friction of
        the contacts."""
        where = places().contacts
        first = self._word(where.pointer)
        for k in range(self.ncon):
            contact = first + k * where.size
            friction = (ctypes.c_double * 5).from_address(contact + where.friction)
            yield (
                ctypes.c_int32.from_address(contact + where.address).value,
                ctypes.c_int32.from_address(contact + where.dim).value,
                ctypes.c_double.from_address(contact + where.mu).value,
                np.ctypeslib.as_array(friction),
            )


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
        because="its time step is not at the expected address",
        instead="please report it",
    )
    return offset


def _before_gravity(model: mujoco.MjModel, k: int) -> np.ndarray:
    """Return the number, (1,), that stands k numbers before gravity in a model's
    mjOption; it shares its memory."""
    gravity = model.opt.gravity.__array_interface__["data"][0]
    return np.ctypeslib.as_array((ctypes.c_double * 1).from_address(gravity - 8 * k))


@functools.cache
def flag_offsets() -> dict[str, int]:
    """Return where integrator and disabled flags stand in an mjOption, bytes from
    gravity."""
    text = (
        '<mujoco><option integrator="{}"><flag energy="disable" {}/></option></mujoco>'
    )
    found: dict[str, set[int]] = {}
    for integrator, flag in (
        ("Euler", ""),
        ("RK4", 'eulerdamp="disable"'),
        ("implicit", 'gravity="disable"'),
        ("implicitfast", ""),
    ):
        model = mujoco.MjModel.from_xml_string(text.format(integrator, flag))
        gravity = model.opt.gravity.__array_interface__["data"][0]
        ints = np.ctypeslib.as_array((ctypes.c_int32 * 200).from_address(gravity))
        for name in ("integrator", "disableflags"):
            matches = {*np.flatnonzero(ints == getattr(model.opt, name)).tolist()}
            found[name] = found.get(name, matches) & matches
    _require_known(all(found.values()))
    return {name: 4 * min(where) for name, where in found.items()}


def options_of(model: mujoco.MjModel) -> np.ndarray:
    """Return integrator and disabled flags of a model, (2,) addresses of 32-bit
    integers in the model's own memory."""
    gravity = model.opt.gravity.__array_interface__["data"][0]
    offsets = flag_offsets()
    return np.array(
        [gravity + offsets["integrator"], gravity + offsets["disableflags"]]
    )


def check_places(data: mujoco.MjData) -> None:
    """Raise Refusal unless the arrays of data of a model lie where `places` says."""
    words = _numbers(data, np.int64)
    for name, place in places().arrays.items():
        rows = {"rows", "entries"} & {*ARRAYS[name][0]}
        if place >= 0 and not rows and getattr(data, name).size:
            _require_known(int(words[place]) == _address(getattr(data, name)))
