"""A connection as the NetCDF file that `geomech connection` writes."""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from geomech.core.variables import Variable
from geomech.io.results import write_netcdf
from geomech.io.tables.base import (
    FORMATS,
    PERIOD,
    ROWS,
    SIGNS,
    UNKNOWN_FRAME,
    Stored,
    check_mask,
    checked_axis,
    checked_body,
    checked_error,
    checked_level,
    checked_names,
    checked_numbers,
    is_real_number,
    rms,
)
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.periods import (
    Periods,
    check_axes,
    checked_periods,
)
from geomech.mathematics.geometry.representations.harmonics import Harmonics
from geomech.mathematics.geometry.representations.tube import Loop, TaylorSeries, Tube
from rft.core.refusal import Refusal

SOURCE = "write it again with 'geomech connection SCENE -o FILE.nc'"
FITTED = "write it again with 'geomech fit-gait LOG.csv -o FILE.nc'"
UNITS = {"body length": "BL", "BL": "BL", "m": "m"}
ANGLES = ("rad", "radian", "radians")
SHAPE = "shape variable "  # before the name of one that is no angle between links
TAYLOR_VARIABLES = {  # of the series about a gait, with their numbers of dimensions
    "gait": 2,
    "gait_A": 3,
    "gait_slope": 4,
    "gait_errors": 5,
    "gait_spread": 3,
    "gait_beyond": 1,
}


@FORMATS.register(suffix=".nc", write=write_netcdf, periods=True)
def parse(raw: bytes, sign: str, order: str, sha256: str) -> Stored:
    """Return the table in the bytes of a file. Refusal, whose words follow the file's
    name, if there is none."""
    if raw[:4] not in (b"CDF\x01", b"CDF\x02"):
        raise Refusal(_other_format(raw))
    if order not in ("", "ndgrid"):
        raise Refusal("names its dimensions", instead="remove order")
    contents = _read(raw)
    stored = _stored(contents, sign, sha256)
    names = contents.axis_names
    stated = [strip_prefix(name, contents.labels[name]) for name in names]
    return replace(stored, shapes=checked_names(stated, list(names)))


def shape_name(axis: Variable) -> str:
    """Return the name of the shape variable along an axis of a field."""
    return strip_prefix(axis.name, axis.label)


def strip_prefix(name: str, label: str) -> str:
    """Return the name that a label has behind `SHAPE`; else ``name``."""
    if label.startswith(SHAPE):
        return label.removeprefix(SHAPE)
    return name


# The contents of a file.


class _Contents:
    """What a file has.

    variables: (dimensions, values) by name. units, labels: of variables, by name.
    attributes: of the file."""

    def __init__(
        self,
        variables: Mapping[str, tuple[tuple[str, ...], np.ndarray]],
        units: Mapping[str, str],
        attributes: Mapping[str, Any],
        labels: Mapping[str, str] | None = None,
    ):
        self.variables = variables
        self.units = units
        self.attributes = attributes
        self.labels = labels or {}
        self.joints = 0
        if "joint" in variables and variables["joint"][1].ndim == 1:
            self.joints = len(variables["joint"][1])
        self.axis_names = tuple(f"alpha_{k + 1}" for k in range(self.joints))

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    @cached_property
    def axes(self) -> tuple[np.ndarray, ...]:
        """The axes of the grid, rad; Refusal if one is in another unit."""
        for name in self.axis_names:
            if self.units[name] not in ("", *ANGLES):
                raise Refusal(
                    f"has {name} in the unit {self.units[name]!r}",
                    because="shapes must be angles in rad",
                )
        return tuple(
            checked_axis(name, self.variables[name][1]) for name in self.axis_names
        )

    @cached_property
    def periods(self) -> Periods:
        """The periods of the axes; Refusal for one that cannot be, or that its axis
        does not cover."""
        periods = []
        for name in self.axis_names:
            _, period = self.variables.get(f"{PERIOD}{name}", ((), None))
            if period is not None and np.shape(period) != ():
                raise Refusal(f"has a {PERIOD}{name} that is no number", instead=SOURCE)
            periods.append(None if period is None else float(period))
        try:
            checked = checked_periods(tuple(periods), self.joints)
            check_axes(self.axes, checked)
        except Refusal as refusal:
            raise Refusal(
                "has a period that does not fit its axis",
                because=str(refusal),
                instead=SOURCE,
            ) from None
        return checked

    def values(self, name: str) -> np.ndarray:
        """Return a variable as finite numbers."""
        return checked_numbers(name, self.variables[name][1])

    def field(self, name: str, *lead: str) -> np.ndarray:
        """Return a variable over ``lead`` dimensions and the grid. Refusal if it has
        other dimensions, or another size than the grid."""
        dims, values = self.variables[name]
        expected = (*lead, *self.axis_names)
        if dims != expected:
            raise Refusal(
                f"has {name} over the dimensions ({', '.join(dims)}); they must be "
                f"({', '.join(expected)})",
                instead=SOURCE,
            )
        grid = tuple(map(len, self.axes))
        if values.dtype.kind != "f" or values.shape[-len(grid) :] != grid:
            raise Refusal(
                f"has {name} of shape {values.shape} that does not fit its grid",
                instead=SOURCE,
            )
        return values.astype(float)


class _OnceRead(io.BytesIO):
    """The bytes of a file, which raise EOFError when twice their number has been read.

    A damaged or hostile file can place many variables at the same bytes, and so ask for
    far more memory than it has bytes."""

    def __init__(self, raw: bytes):
        super().__init__(raw)
        self.bytes_left = 2 * len(raw)

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        self.bytes_left -= len(data)
        if self.bytes_left < 0:
            raise EOFError
        return data


def _read(raw: bytes) -> _Contents:
    from scipy.io import netcdf_file

    variables = {}
    units = {}
    labels = {}
    attributes = {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file = netcdf_file(_OnceRead(raw), mmap=False)
            for name, variable in file.variables.items():
                dims = tuple(variable.dimensions)
                variables[name] = dims, np.array(variable.data)
                units[name] = _text(getattr(variable, "units", b""))
                labels[name] = _text(getattr(variable, "long_name", b""))
            for name, value in vars(file).items():
                if not name.startswith("_"):
                    attributes[name] = value
    except Exception:  # SciPy raises errors of all kinds for a damaged file
        raise Refusal("is damaged or incomplete", instead=SOURCE) from None
    return _Contents(variables, units, attributes, labels)


def _other_format(raw: bytes) -> str:
    """Return what a file is that is no NetCDF file of the classic format."""
    if raw[:4] == b"\x89HDF":
        return (
            "is NetCDF-4 (HDF5): save it as classic NetCDF, from xarray by "
            "to_netcdf(..., format='NETCDF3_64BIT')"
        )
    if raw[:6] == b"MATLAB":
        return (
            "is a MATLAB file, not a NetCDF file: change the ending of its name to .mat"
        )
    return f"is not a NetCDF file: {SOURCE}"


def _text(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value)


# The steps from contents to a table.


def _stored(contents: _Contents, sign: str, sha256: str) -> Stored:
    _check_complete(contents)
    attributes = contents.attributes
    axes = contents.axes
    A, residual = _checked_entries(contents)
    masked = np.isnan(A).any((0, 1))
    speed = _speed(contents, A, residual)
    length, unit = _checked_length(attributes)
    degree = _checked_degree(attributes, axes)
    sign = sign or _stated_sign(attributes)
    factor = 1.0 if sign == "+" else -1.0
    harmonics = None
    if "harmonics" in contents and not masked.any():
        harmonics = _harmonics(contents, residual, factor, degree)

    # Without a stated unit the numbers are taken to be in body lengths.
    sized = "length_unit" in attributes
    size = {"unit": unit, "length": length} if sized else {}
    if "gait" in contents:
        series = _taylor_series(contents, factor)
        connection: Connection = Tube(
            axes, factor * A, residual, speed, degree, series, **size
        )
    else:
        connection = Connection(
            axes, factor * A, residual, speed, degree, **size, periods=contents.periods
        )
        _ = connection.field  # refuses ends that differ where there is a period

    even = None
    if "even_part" in contents and not masked.any():
        field = contents.field("even_part", "component")
        even = checked_numbers("even_part", field)
    _check_pairs(contents, masked)
    metric, power_degree = _metric(contents, degree)
    error = None
    if "A_error" in contents:
        half_widths = contents.field("A_error", "component", "joint")
        error = checked_error("A_error", half_widths, A, attributes)
    return Stored(
        connection,
        harmonics,
        even,
        length,
        unit,
        frame=_text(attributes.get("frame", UNKNOWN_FRAME)),
        sign=sign,
        order="ndgrid",
        sha256=sha256,
        metric=metric,
        power_degree=power_degree,
        A_error=error,
        level=checked_level(attributes),
        sized=sized,
        body=checked_body(_text(attributes.get("body", b""))),
    )


def _check_complete(contents: _Contents) -> None:
    """Raise Refusal for a file without a variable that each connection has."""
    for name in ("joint", *contents.axis_names, "A", "fit_residual"):
        if name not in contents:
            raise Refusal(f"holds no connection, {name} is missing", instead=SOURCE)


def _checked_entries(contents: _Contents) -> tuple[np.ndarray, np.ndarray]:
    """Return A (3, d, N_1, ...) and the residual of its fit (3, N_1, ...). Both are nan
    at singular shapes; a residual that is unknown is nan everywhere."""
    A = contents.field("A", "component", "joint")
    residual = contents.field("fit_residual", "component")
    joints = contents.joints
    if (
        A.shape[:2] != (3, joints)
        or residual.shape[0] != 3
        or not _has_standard_rows(contents)
    ):
        raise Refusal(
            f"has A of shape {A.shape}; it must be (3, {joints}, ...), with the rows "
            "x, y, theta"
        )
    masked = np.isnan(A).any((0, 1))
    check_mask("A", A, masked, contents.attributes)
    is_unknown = np.isnan(residual).all() and not masked.all()
    checked_residual = np.where(is_unknown, 0.0, residual)
    check_mask("fit_residual", checked_residual, masked, contents.attributes)
    return A, residual


def _has_standard_rows(contents: _Contents) -> bool:
    """Return whether the components are x, y and theta, in that order, if they are
    named."""
    if "component" not in contents:
        return True
    names = contents.variables["component"][1]
    if names.dtype.kind == "S" and names.ndim == 2:
        words = [b"".join(row).rstrip(b"\0 ") for row in names]
        names = [word.decode("ascii", "replace") for word in words]
    return [str(name) for name in names] == list(ROWS)


def _speed(contents: _Contents, A: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Return the rms (3, N_1, ...) of xi over directions of alphadot."""
    # Files of the first versions called it speed.
    name = "xi_rms" if "xi_rms" in contents else "speed"
    if name in contents:
        return contents.field(name, "component")
    return rms(A, residual)


def _checked_length(attributes: Mapping) -> tuple[float, str]:
    """Return the body length and its unit, "BL" or "m"."""
    length = attributes.get("body_length", 1.0)
    unit = UNITS.get(_text(attributes.get("length_unit", b"body length")))
    if unit is None or not is_real_number(length) or not 0 < length < 1e9:
        raise Refusal(
            "has a body_length or length_unit that is not valid", instead=SOURCE
        )
    return float(length), unit


def _checked_degree(attributes: Mapping, axes: tuple[np.ndarray, ...]) -> int:
    """Return the degree of the spline through the table."""
    degree = attributes.get("interpolation", 3)
    degree = int(degree) if degree in (1, 2, 3, 4, 5) else 3
    if min(map(len, axes)) <= degree:
        raise Refusal(
            f"has too few shapes for a spline of degree {degree}", instead=SOURCE
        )
    return degree


def _stated_sign(attributes: Mapping) -> str:
    """Return the sign of A that a file states; "+" where it states none."""
    stated = _text(attributes.get("sign_of_A", b""))
    for sign, text in SIGNS.items():
        if text == stated:
            return sign
    return "+"


def _harmonics(
    contents: _Contents, residual: np.ndarray, factor: float, degree: int
) -> Harmonics:
    """Return the odd harmonics of xi, times ``factor``. residual: of the fit of A,
    which is taken where the series has none of its own."""
    rows = contents.field("harmonics", "component", "coefficient")
    if "harmonics_residual" in contents:
        residual = contents.field("harmonics_residual", "component")
    has_pairs = rows.size > 0 and rows.shape[1] % 2 == 0
    if rows.shape[0] != 3 or residual.shape[0] != 3 or not has_pairs:
        raise Refusal(
            f"has harmonics of shape {rows.shape}; it must be (3, an even number, ...)"
        )
    return Harmonics(
        contents.axes,
        factor * checked_numbers("harmonics", rows),
        checked_numbers("harmonics_residual", residual),
        degree,
        periods=contents.periods,
    )


def _taylor_series(contents: _Contents, factor: float) -> TaylorSeries:
    """Return the Taylor series about a gait
    (`geomech.mathematics.geometry.representations.tube`), with A times ``factor``."""
    for name, count in TAYLOR_VARIABLES.items():
        if name not in contents or contents.variables[name][1].ndim != count:
            raise Refusal(f"has a gait, but no {name} that matches it", instead=FITTED)
    gait, A, slope, errors, spread, beyond = map(contents.values, TAYLOR_VARIABLES)
    d = len(gait)
    terms = A.shape[-1]
    if "gait_off" in contents:
        standard_error = contents.values("gait_off")
    else:  # an older file
        standard_error = np.zeros((3, 2, 1))
    level = contents.attributes.get("level", np.nan)
    error_factor = contents.attributes.get("error_factor", np.nan)
    fits = (
        A.shape == (3, d, terms)
        and slope.shape == (3, d, d - 1, terms)
        and errors.shape[1:] == (3, d, d, terms)
        and beyond.shape == (3,)
        and terms % 2 == 1
        and gait.shape[1] % 2 == 1
        and _is_spread(spread, d)
        and _is_standard_error(standard_error)
        and is_real_number(level)
        and is_real_number(error_factor)
        and 0 < level < 1
        and 0 < error_factor < 1e6
    )
    if not fits:
        raise Refusal("has a gait whose parts do not match", instead=FITTED)
    if d < 2 or not np.abs(gait[:, 1:]).max(initial=0.0) > 0:
        raise Refusal("has a gait that does not move", instead=FITTED)
    return TaylorSeries(
        Loop(gait),
        factor * A,
        factor * slope,
        factor * errors,
        spread,
        np.abs(beyond),
        np.abs(standard_error),
        float(error_factor),
        float(level),
    )


def _is_spread(spread: np.ndarray, d: int) -> bool:
    """Return whether (d, d, K) are positive definite matrices."""
    if spread.shape[:2] != (d, d):
        return False
    eigenvalues = np.linalg.eigvalsh(np.moveaxis(spread, -1, 0))
    return bool((eigenvalues > 0).all())


def _is_standard_error(values: np.ndarray) -> bool:
    return values.ndim == 3 and values.shape[:2] == (3, 2) and values.size > 0


def _metric(
    contents: _Contents, degree: int
) -> tuple[Metric | Finsler | None, float | None]:
    """Return the metric of shape space, and the degree of its power, None for a metric
    that is no power; (None, None) for a file without a metric. degree: of splines."""
    power_degree = contents.attributes.get("power_degree")
    has_norm = "norm" in contents and power_degree is not None
    if "metric" not in contents and not has_norm:
        return None, None
    if power_degree is not None:
        if not is_real_number(power_degree) or not 0 < power_degree < 100:
            raise Refusal("has a power_degree that is not valid", instead=SOURCE)
        power_degree = float(power_degree)
    if "metric" in contents:
        return _quadratic_metric(contents, degree), power_degree
    return _norm(contents, degree), power_degree


def _quadratic_metric(contents: _Contents, degree: int) -> Metric:
    M = checked_numbers("metric", contents.field("metric", "joint", "other_joint"))
    joints = contents.joints
    rounding = 1e-9 * np.abs(M).max()
    if M.shape[:2] != (joints, joints) or not np.allclose(
        M, M.swapaxes(0, 1), rtol=0, atol=rounding
    ):
        raise Refusal(
            f"has a metric of shape {M.shape}; it must be ({joints}, {joints}, ...) "
            "and symmetric"
        )
    return Metric(contents.axes, M, degree, periods=contents.periods)


def _norm(contents: _Contents, degree: int) -> Finsler:
    """Return the norm of rates, as a series over their directions."""
    rows = checked_numbers("norm", contents.field("norm", "norm_coefficient"))
    if contents.joints != 2 or len(rows) % 2 == 0:
        raise Refusal(
            f"has a norm of shape {rows.shape}; it must be (an odd number, ...) of "
            "two joints"
        )
    residual = 0 * rows[0]
    if "norm_residual" in contents:
        residual = checked_numbers("norm_residual", contents.field("norm_residual"))
    return Finsler(contents.axes, rows, residual, degree, periods=contents.periods)


def _check_pairs(contents: _Contents, masked: np.ndarray) -> None:
    """Raise Refusal for a CCF of pairs of joints that fits neither grid nor pairs. Its
    values are not used: the CCF is computed anew from A."""
    pairs = np.array([*combinations(range(1, contents.joints + 1), 2)], float)
    _, stated = contents.variables.get("pair_joints", ((), pairs))
    if not np.array_equal(stated, pairs):
        raise Refusal(
            f"has pair_joints that differ from {pairs.astype(int).tolist()}",
            instead=SOURCE,
        )
    for name in ("ccf_pairs", "ccf_pairs_error"):
        if name not in contents:
            continue
        values = contents.field(name, "pair", "component")
        if values.shape[:2] != (len(pairs), 3):
            raise Refusal(
                f"has {name} of shape {values.shape}; it must be ({len(pairs)}, 3, "
                "...)",
                instead=SOURCE,
            )
        if not masked.any():
            checked_numbers(name, values)
