"""A connection as the NetCDF file that `geomech connection` writes."""

from __future__ import annotations

import io
import warnings
from dataclasses import replace
from itertools import combinations

import numpy as np

from geomech.core.variables import Variable
from geomech.geometry.connection import Connection
from geomech.geometry.harmonics import Harmonics
from geomech.geometry.metric import Finsler, Metric
from geomech.geometry.tube import Loop, TaylorSeries, Tube
from geomech.io.results import write_netcdf
from geomech.io.tables.base import (
    FORMATS,
    ROWS,
    SIGNS,
    UNKNOWN_FRAME,
    Stored,
    checked_axis,
    checked_body,
    checked_error,
    checked_level,
    checked_names,
    masks,
    numbers,
    rms,
)
from rft.core.refusal import Refusal

SOURCE = "write it anew with 'geomech connection SCENE -o FILE.nc'"
FITTED = "write it anew with 'geomech fit-gait LOG.csv -o FILE.nc'"
UNITS = {"body length": "BL", "BL": "BL", "m": "m"}
ANGLES = ("rad", "radian", "radians")
SHAPE = "shape variable "  # before the name of one that is no angle between links


@FORMATS.register(suffix=".nc", write=write_netcdf)
def parse(raw: bytes, sign: str, order: str, sha256: str) -> Stored:
    """Return the table in the bytes of a file; Refusal, to follow the file's name, if there is none."""
    if raw[:4] not in (b"CDF\x01", b"CDF\x02"):
        raise Refusal(_other_format(raw))
    if order not in ("", "ndgrid"):
        raise Refusal("names its dimensions", instead="drop order")
    from scipy.io import netcdf_file

    try:  # what is damaged makes SciPy raise whatever comes first
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file = netcdf_file(_OnceRead(raw), mmap=False)
            variables = {
                name: (tuple(v.dimensions), np.array(v.data))
                for name, v in file.variables.items()
            }
            units = {
                name: _text(getattr(v, "units", b""))
                for name, v in file.variables.items()
            }
            names = {
                name: _text(getattr(v, "long_name", b""))
                for name, v in file.variables.items()
            }
            attributes = {
                name: value
                for name, value in vars(file).items()
                if not name.startswith("_")
            }
    except Exception:
        raise Refusal("is damaged or cut short", instead=SOURCE) from None
    stored = _stored(variables, units, attributes, sign, sha256)
    shapes = [f"alpha_{k + 1}" for k in range(len(stored.connection.axes))]
    called = [_called(x, names[x]) for x in shapes]
    return replace(stored, shapes=checked_names(called, shapes))


class _OnceRead(io.BytesIO):
    """The bytes of a file of which none need be read twice: in one that says so, many
    variables lie in the same place."""

    def __init__(self, raw: bytes):
        super().__init__(raw)
        self.left = 2 * len(raw)

    def read(self, size: int | None = -1) -> bytes:
        found = super().read(size)
        self.left -= len(found)
        if self.left < 0:
            raise EOFError
        return found


def _other_format(raw: bytes) -> str:
    if raw[:4] == b"\x89HDF":
        return "is NetCDF-4 (HDF5): save it as classic NetCDF, from xarray by to_netcdf(..., format='NETCDF3_64BIT')"
    return f"is no NetCDF file{', but a MATLAB one: end its name in .mat' if raw[:6] == b'MATLAB' else f': {SOURCE}'}"


def _text(value) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _stored(
    variables: dict, units: dict, attributes: dict, sign: str, sha256: str
) -> Stored:
    joints = (
        len(variables["joint"][1])
        if "joint" in variables and variables["joint"][1].ndim == 1
        else 0
    )
    names = tuple(f"alpha_{k + 1}" for k in range(joints))
    if missing := [
        name for name in ("joint", *names, "A", "fit_residual") if name not in variables
    ]:
        raise Refusal(f"holds no connection, {missing[0]} is missing", instead=SOURCE)
    for name in names:
        if units[name] not in ("", *ANGLES):
            raise Refusal(
                f"has {name} in {units[name]!r}", because="shapes are angles in rad"
            )
    axes = tuple(checked_axis(name, variables[name][1]) for name in names)
    pick = lambda name, *lead: _array(variables, name, (*lead, *names), axes)
    A, residual = pick("A", "component", "joint"), pick("fit_residual", "component")
    if A.shape[:2] != (3, joints) or residual.shape[0] != 3 or not _rows(variables):
        raise Refusal(
            f"has A of shape {A.shape} where it must be (3, {joints}, ...), rows x, y, theta"
        )
    masked = np.isnan(A).any((0, 1))
    masks("A", A, masked, attributes)
    unknown = np.isnan(residual).all() and not masked.all()
    masks("fit_residual", np.where(unknown, 0.0, residual), masked, attributes)
    # Files of the first versions called it speed.
    rms_name = "xi_rms" if "xi_rms" in variables else "speed"
    if rms_name in variables:
        speed = pick(rms_name, "component")
    else:
        speed = rms(A, residual)
    sized = "length_unit" in attributes
    length, unit = (
        attributes.get("body_length", 1.0),
        UNITS.get(_text(attributes.get("length_unit", b"body length"))),
    )
    length = (
        float(length)
        if np.ndim(length) == 0 and np.asarray(length).dtype.kind in "iuf"
        else np.nan
    )
    if unit is None or not 0 < length < 1e9:
        raise Refusal(
            "has a body_length or length_unit that makes no sense", instead=SOURCE
        )
    degree = (
        int(d) if (d := attributes.get("interpolation", 3)) in (1, 2, 3, 4, 5) else 3
    )
    if min(map(len, axes)) <= degree:
        raise Refusal(
            f"has too few shapes for a spline of degree {degree}", instead=SOURCE
        )
    stated = next(
        (
            s
            for s, text in SIGNS.items()
            if text == _text(attributes.get("sign_of_A", b""))
        ),
        "+",
    )
    sign = sign or stated
    turn = 1.0 if sign == "+" else -1.0
    harmonics = None
    if "harmonics" in variables and not masked.any():
        rows = pick("harmonics", "component", "coefficient")
        residual_of_series = (
            pick("harmonics_residual", "component")
            if "harmonics_residual" in variables
            else residual
        )
        if (
            rows.shape[0] != 3
            or residual_of_series.shape[0] != 3
            or rows.shape[1] % 2
            or not rows.size
        ):
            raise Refusal(
                f"has harmonics of shape {rows.shape} where it must be (3, an even number, ...)"
            )
        harmonics = Harmonics(
            axes,
            turn * numbers("harmonics", rows),
            numbers("harmonics_residual", residual_of_series),
            degree,
        )
    size = {"unit": unit, "length": length} if sized else {}
    connection = Connection(axes, turn * A, residual, speed, degree, **size)
    if "gait" in variables:
        connection = Tube(
            axes,
            turn * A,
            residual,
            speed,
            degree,
            _taylor_series(variables, attributes, turn),
            **size,
        )
    frame = _text(attributes.get("frame", UNKNOWN_FRAME))
    even = (
        numbers("even_part", pick("even_part", "component"))
        if "even_part" in variables and not masked.any()
        else None
    )
    if even is not None and even.shape[0] != 3:
        raise Refusal(f"has even_part of shape {even.shape} where it must be (3, ...)")
    _check_pairs(variables, axes, masked)
    metric, power = _metric(variables, attributes, axes, degree)
    has_error = "A_error" in variables
    error = (
        checked_error("A_error", pick("A_error", "component", "joint"), A, attributes)
        if has_error
        else None
    )
    return Stored(
        connection, harmonics, even, length, unit, frame, sign, "ndgrid", (), sha256, metric=metric, power_degree=power,
        A_error=error, level=checked_level(attributes), sized=sized,
        body=checked_body(_text(attributes.get("body", b""))),
    )  # fmt: skip


def shape_name(axis: Variable) -> str:
    """Return the name of the shape variable along an axis of a field."""
    return _called(axis.name, axis.label)


def _called(name: str, label: str) -> str:
    return label.removeprefix(SHAPE) if label.startswith(SHAPE) else name


def _taylor_series(variables: dict, attributes: dict, turn: float) -> TaylorSeries:
    """Return the Taylor series about a gait (`geomech.geometry.tube`), A times ``turn``."""
    sized = {
        "gait": 2,
        "gait_A": 3,
        "gait_slope": 4,
        "gait_errors": 5,
        "gait_spread": 3,
        "gait_beyond": 1,
    }
    if missing := [
        name
        for name in sized
        if name not in variables or variables[name][1].ndim != sized[name]
    ]:
        raise Refusal(f"has a gait, but no {missing[0]} that fits it", instead=FITTED)
    gait, A, slope, errors, spread, beyond = (
        numbers(name, variables[name][1]) for name in sized
    )
    standard_error = (
        numbers("gait_off", variables["gait_off"][1])
        if "gait_off" in variables
        else np.zeros((3, 2, 1))
    )  # of an older file
    d, wide = len(gait), A.shape[-1]
    right = (
        A.shape == (3, d, wide),
        slope.shape == (3, d, d - 1, wide),
        errors.shape[1:] == (3, d, d, wide),
    )
    level, factor = (attributes.get(name, np.nan) for name in ("level", "error_factor"))
    good = (
        spread.shape[:2] == (d, d)
        and beyond.shape == (3,)
        and standard_error.ndim == 3
        and standard_error.shape[:2] == (3, 2)
        and standard_error.size > 0
        and (np.linalg.eigvalsh(np.moveaxis(spread, -1, 0)) > 0).all()
    )
    number = all(
        np.ndim(x) == 0 and np.asarray(x).dtype.kind in "iuf" for x in (level, factor)
    )
    if not (
        all(right)
        and good
        and number
        and wide % 2
        and gait.shape[1] % 2
        and 0 < level < 1
        and 0 < factor < 1e6
    ):
        raise Refusal("has a gait whose parts do not fit each other", instead=FITTED)
    if d < 2 or not np.abs(gait[:, 1:]).max(initial=0.0) > 0:
        raise Refusal("has a gait that does not move", instead=FITTED)
    beyond, standard_error = np.abs(beyond), np.abs(standard_error)
    return TaylorSeries(
        Loop(gait),
        turn * A,
        turn * slope,
        turn * errors,
        spread,
        beyond,
        standard_error,
        float(factor),
        float(level),
    )


def _metric(
    variables: dict, attributes: dict, axes, degree: int
) -> tuple[Metric | Finsler | None, float | None]:
    """Return the metric of shape space, and the degree of its power, None for a metric of another kind; (None, None) of
    a file without one."""
    power, names, joints = (
        attributes.get("power_degree"),
        tuple(f"alpha_{k + 1}" for k in range(len(axes))),
        len(axes),
    )
    if "metric" not in variables and ("norm" not in variables or power is None):
        return None, None
    if power is not None and (
        np.ndim(power)
        or np.asarray(power).dtype.kind not in "iuf"
        or not 0 < power < 100
    ):
        raise Refusal("has a power_degree that makes no sense", instead=SOURCE)
    if "metric" in variables:
        M = numbers(
            "metric",
            _array(variables, "metric", ("joint", "other_joint", *names), axes),
        )
        if M.shape[:2] != (joints, joints) or not np.allclose(
            M, M.swapaxes(0, 1), rtol=0, atol=1e-9 * np.abs(M).max()
        ):
            raise Refusal(
                f"has a metric of shape {M.shape} where it must be ({joints}, {joints}, ...) and symmetric"
            )
        return Metric(axes, M, degree), None if power is None else float(power)
    rows = numbers(
        "norm", _array(variables, "norm", ("norm_coefficient", *names), axes)
    )
    if joints != 2 or len(rows) % 2 == 0:
        raise Refusal(
            f"has a norm of shape {rows.shape} where it must be (an odd number, ...) of two joints"
        )
    residual = (
        numbers("norm_residual", _array(variables, "norm_residual", names, axes))
        if "norm_residual" in variables
        else 0 * rows[0]
    )
    return Finsler(axes, rows, residual, degree), float(power)


def _check_pairs(variables: dict, axes, masked: np.ndarray) -> None:
    """Raise Refusal for a CCF of pairs of joints that fits neither grid nor pairs; it is computed anew from A."""
    pairs = np.array([*combinations(range(1, len(axes) + 1), 2)], float)
    if "pair_joints" in variables and not np.array_equal(
        variables["pair_joints"][1], pairs
    ):
        raise Refusal(
            f"has pair_joints other than {pairs.astype(int).tolist()}", instead=SOURCE
        )
    dimensions = ("pair", "component", *(f"alpha_{k + 1}" for k in range(len(axes))))
    for name in {"ccf_pairs", "ccf_pairs_error"} & variables.keys():
        values = _array(variables, name, dimensions, axes)
        if values.shape[:2] != (len(pairs), 3):
            raise Refusal(
                f"has {name} of shape {values.shape} where it must be ({len(pairs)}, 3, ...)",
                instead=SOURCE,
            )
        if not masked.any():
            numbers(name, values)


def _array(variables: dict, name: str, dimensions: tuple[str, ...], axes) -> np.ndarray:
    """Return a variable; Refusal unless its dimensions are those, in that order, and its shape ends in the grid's."""
    given, values = variables[name]
    if given != dimensions:
        raise Refusal(
            f"has {name} over ({', '.join(given)}) where it must be ({', '.join(dimensions)})",
            instead=SOURCE,
        )
    if values.dtype.kind != "f" or values.shape[-len(axes) :] != tuple(map(len, axes)):
        raise Refusal(
            f"has {name} of shape {values.shape} that does not fit its grid",
            instead=SOURCE,
        )
    return values.astype(float)


def _rows(variables: dict) -> bool:
    """Return whether the components are x, y and theta, in that order, if they are named."""
    if "component" not in variables:
        return True
    names = variables["component"][1]
    if names.dtype.kind == "S" and names.ndim == 2:
        names = [
            b"".join(row).rstrip(b"\0 ").decode("ascii", "replace") for row in names
        ]
    return [str(name) for name in names] == list(ROWS)
