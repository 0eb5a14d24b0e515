"""A connection as a MATLAB file in sysplotter's layout.

The file has arrays alpha1, alpha2, Ax1, Ax2, Ay1, Ay2, Atheta1, Atheta2, each (N, M),
and M11, M12, M22, the metric of shape space, where it is known; or sysplotter's struct
s (`geomech.io.tables.sysplotter`). A file of `write` has the variables ABOUT, RESIDUAL
and ERROR as well.

Source: https://github.com/OSU-LRAM/GeometricSystemPlotter,
Granular_Local_Connection_Matrix.mat.
"""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.io.tables import hdf5, matlab, sysplotter
from geomech.io.tables.base import (
    FORMATS,
    LARGEST_ANGLE,
    LAYOUTS,
    ORDERS,
    PERIOD,
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
    detected_sign,
    rms,
)
from geomech.io.tables.calc import write_struct
from geomech.io.tables.netcdf import UNITS, shape_name
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.metric import Metric
from rft.core.refusal import Refusal

ANGLES = ("alpha1", "alpha2")
ENTRIES = tuple(f"A{row}{joint}" for row in ("x", "y", "theta") for joint in (1, 2))
METRIC = ("M11", "M12", "M22")
STRUCT = "s"
# Attributes that ABOUT has where they are known.
OPTIONAL = ("singular_shapes", "level", "body", "power_degree")
ABOUT = "geomech_about"
RESIDUAL = "geomech_fit_residual"
ERROR = "geomech_A_error"
SAVE = "save it in MATLAB with save(FILE, ..., '-v7')"


def write(
    path: str | Path,
    result: Result,
    sign: str = "+",
    order: str = "ndgrid",
    layout: str = LAYOUTS[0],
) -> None:
    """Write A, each entry (N, M), for xi = ``sign`` A alphadot; the file appears whole
    or not at all.

    Beside A the file has the fit residual (3, N, M), which includes the part of the
    velocity that is even in alphadot, half widths (3, 2, N, M) of intervals of A and a
    quadratic metric M, where they are known. ABOUT is a JSON text with sign, frame,
    body length, unit and spline. order: rows run over alpha1 ("ndgrid") or over alpha2
    ("meshgrid"). layout: "struct" writes sysplotter's struct s (`write_struct`)
    instead."""
    if any(name.startswith(PERIOD) for name in result):
        raise Refusal(
            "a .mat file stores no periods of shape variables",
            instead="write a .nc file",
        )
    if layout == LAYOUTS[1]:
        write_struct(path, result)
        return
    from scipy.io import savemat

    A = result["A"]
    axes = [result["alpha_1"], result["alpha_2"]]
    grids = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
    factor = 1.0 if sign == "+" else -1.0
    entries = factor * A.values.reshape(6, *A.values.shape[2:])
    arrays = dict(zip(ANGLES, grids))
    arrays |= dict(zip(ENTRIES, entries))
    residual = _written_residual(result)
    if residual is not None:
        arrays[RESIDUAL] = residual
    if A.error is not None:
        arrays[ERROR] = A.error
    if "metric" in result:
        arrays |= dict(zip(METRIC, result["metric"].values[np.triu_indices(2)]))

    written = {name: np.array(_as_ndgrid(x, order)) for name, x in arrays.items()}
    names = [shape_name(axis) for axis in axes]
    written[ABOUT] = json.dumps(_written_about(result.attributes, names, sign))
    with atomic_file(path) as part:
        savemat(part, written, appendmat=False)


def _written_residual(result: Result) -> np.ndarray | None:
    """Return the rms (3, N, M) of what A leaves of the velocity; None where it is
    unknown at a shape at which A is known."""
    residual = result["fit_residual"].values
    if "even_part" in result:
        # The even part counts at half of all directions.
        residual = np.sqrt(residual**2 + result["even_part"].values ** 2 / 2)
    is_regular = ~np.isnan(result["A"].values).any((0, 1))
    return residual if np.isfinite(residual[:, is_regular]).all() else None


def _written_about(attributes: Mapping, names: list[str], sign: str) -> dict:
    """Return what ABOUT says. names: of the shape variables."""
    meaning = "alpha_k is the heading of link k+1 minus that of link k, link 1 the tail"
    if names != ["alpha_1", "alpha_2"]:
        meaning = f"alpha1 is {names[0]}, alpha2 {names[1]}"
    optional = {key: value for key, value in attributes.items() if key in OPTIONAL}
    return {
        "sign": sign,
        "frame": attributes["frame"],
        "length": attributes["body_length"],
        "unit": UNITS[attributes["length_unit"]],
        "interpolation": attributes["interpolation"],
        "shapes": names,
        "conventions": f"xi = {sign} A alphadot; {meaning}",
        **optional,
    }


@FORMATS.register(
    suffix=".mat",
    write=write,
    settings=("sign", "order", "layout"),
    joints=2,
    whole=False,
)
def parse(raw: bytes, sign: str, order: str, sha256: str) -> Stored:
    """Return the table in the bytes of a file. Refusal, whose words follow the file's
    name, if there is none."""
    names = (STRUCT, *ANGLES, *ENTRIES, *METRIC, ABOUT, RESIDUAL, ERROR)
    contents = variables(raw, names)
    has_arrays = {*ANGLES, *ENTRIES} <= {*contents}
    if isinstance(contents.get(STRUCT), dict) and not has_arrays:
        return sysplotter.parse(contents[STRUCT], sign, order, sha256)
    _check_layout(contents)
    axes, order = _axes(contents, order)
    about = _about(contents)
    A = _entries(contents, axes, order, about)
    if not A.any():
        raise Refusal("has a connection that is zero everywhere")
    residual = _residual(contents, A, order, about)
    error = _error(contents, A, order, about)
    degree = _degree(about, axes)
    length, unit, sized = _length(about)
    size = {"unit": unit, "length": length} if sized else {}
    speed = rms(A, np.nan_to_num(residual))
    connection = Connection(axes, A, residual, speed, degree, **size)

    assumptions: tuple[str, ...] = ()
    if contents[ANGLES[0]].ndim > 1 and order == "meshgrid":
        assumptions += ("its arrays are ordered as by meshgrid",)
    if not sign and about.get("sign") in SIGNS:
        sign = about["sign"]
    if not sign:
        sign = detected_sign(connection)
        assumptions += (
            f"its sign was inferred as {SIGNS[sign]}; add sign = '+' or '-' if you "
            "know it",
        )
    if sign == "-":
        connection = replace(connection, A=-A)
    frame = about.get("frame")
    metric, power_degree = _metric(contents, axes, order, about, degree)
    return Stored(
        connection,
        length=length,
        unit=unit,
        frame=frame if isinstance(frame, str) else UNKNOWN_FRAME,
        sign=sign,
        order=order,
        assumptions=assumptions,
        sha256=sha256,
        shapes=checked_names(about.get("shapes"), ["alpha_1", "alpha_2"]),
        metric=metric,
        power_degree=power_degree,
        A_error=error,
        level=checked_level(about),
        sized=sized,
        body=checked_body(about.get("body")),
    )


def variables(raw: bytes, names: Collection[str]) -> dict[str, Any]:
    """Return the variables of a file by name, with the values of `matlab.arrays`: at
    least those that have one of ``names``. Refusal for a file that is no MATLAB file,
    or damaged."""
    if raw[:4] == b"\x89HDF" or raw[:10] == b"MATLAB 7.3":
        return hdf5.arrays(raw, names)
    if raw[:3] == b"CDF":
        raise Refusal(
            "is a NetCDF file, not a MATLAB file",
            instead="change the ending of its name to .nc",
        )
    try:
        if raw[:4] and 0 in raw[:4]:
            return _read_version_4(raw, names)
        return matlab.arrays(raw)
    except ValueError:
        raise Refusal(
            "is damaged, incomplete, or not a MATLAB file", instead=SAVE
        ) from None


def _check_layout(contents: dict) -> None:
    """Raise Refusal unless the variables of the layout are there, as arrays of real
    numbers."""
    for name in (*ANGLES, *ENTRIES):
        if name not in contents:
            layout = ", ".join((*ANGLES, *ENTRIES))
            raise Refusal(
                f"has no {name}",
                because=(
                    f"a file with a connection has {layout}, or the struct s of "
                    "sysplotter"
                ),
            )
        values = contents[name]
        if not isinstance(values, np.ndarray) or values.dtype == object:
            raise Refusal(f"has {name} that is not an array of real numbers")


def _read_version_4(raw: bytes, names: Collection[str]) -> dict[str, np.ndarray]:
    """Return the variables of a file of version 4, by SciPy's reader, which is in
    Python; Refusal for a damaged one."""
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return loadmat(io.BytesIO(raw), variable_names=[*names])
    except Exception:  # SciPy raises errors of all kinds for a damaged file
        raise Refusal("damaged") from None


def _axes(contents: dict, order: str) -> tuple[tuple[np.ndarray, np.ndarray], str]:
    """Return the angles of both axes, rad, and the order in which arrays run over
    them."""
    first, second = (checked_numbers(name, contents[name]) for name in ANGLES)
    if first.ndim == second.ndim == 2 and min(*first.shape, *second.shape) == 1:
        if not order:
            raise Refusal(
                "has alpha1 and alpha2 as rows, which do not determine the order "
                "of the arrays",
                instead="add order = 'ndgrid' or 'meshgrid'",
            )
        return _checked_axes(contents, first.ravel(), second.ravel()), order
    if first.ndim != 2 or first.shape != second.shape:
        raise Refusal(
            f"has alpha1 {first.shape} and alpha2 {second.shape}, which do not "
            "form a grid"
        )
    for name in ORDERS:
        a = _as_ndgrid(first, name)
        b = _as_ndgrid(second, name)
        if max(np.ptp(a, axis=1).max(), np.ptp(b, axis=0).max()) <= 1e-9:
            if order not in ("", name):
                raise Refusal(
                    f"has arrays in the order of {name}", instead="remove order"
                )
            return _checked_axes(contents, a[:, 0], b[0]), name
    raise Refusal(
        "has alpha1 and alpha2 that do not form a grid",
        because="one must change along rows only, the other along columns",
    )


def _checked_axes(
    contents: dict, first: np.ndarray, second: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    # In a file of another program angles beyond a full turn are likely in degrees.
    largest = LARGEST_ANGLE if ABOUT in contents else 2 * np.pi
    return (
        checked_axis("alpha1", first, largest),
        checked_axis("alpha2", second, largest),
    )


def _as_ndgrid(values: np.ndarray, order: str) -> np.ndarray:
    """Return values (..., N, M) from arrays in the given order, or the other way round,
    which is the same."""
    return values if order == "ndgrid" else values.swapaxes(-1, -2)


def _about(contents: dict) -> dict:
    """Return the attributes of a file that geomech wrote; {} if they make no sense."""
    try:
        attributes = json.loads(str(contents.get(ABOUT, "")))
    except (ValueError, RecursionError):
        return {}
    return attributes if isinstance(attributes, dict) else {}


def _degree(about: dict, axes: tuple[np.ndarray, np.ndarray]) -> int:
    """Return the degree of the spline through the table."""
    degree = about.get("interpolation", 3)
    if degree in (1, 2, 3, 4, 5) and min(map(len, axes)) > degree:
        return degree
    return 3


def _length(about: dict) -> tuple[float, str, bool]:
    """Return the body length, its unit, and whether the file states them; else 1 BL."""
    length = about.get("length")
    unit = about.get("unit")
    if unit in ("BL", "m") and isinstance(length, float) and 0 < length < 1e9:
        return length, unit, True
    return 1.0, "BL", False


def _entries(
    contents: dict, axes: tuple[np.ndarray, np.ndarray], order: str, about: dict
) -> np.ndarray:
    """Return A (3, 2, N, M); nan in all entries at singular shapes, if the file
    declares any."""
    expected = tuple(map(len, axes))
    if order == "meshgrid":
        expected = expected[::-1]
    arrays = []
    for name in ENTRIES:
        values = contents[name]
        if values.dtype.kind != "f":
            values = checked_numbers(name, values)
        if values.shape != expected:
            raise Refusal(
                f"has {name} of shape {values.shape} where alpha1 and alpha2 require "
                f"{expected}"
            )
        arrays.append(_as_ndgrid(values, order).astype(float))
    masked = np.isnan(arrays).any(0)
    for name, values in zip(ENTRIES, arrays):
        check_mask(name, values, masked, about)
    return np.array(arrays).reshape(3, 2, *masked.shape)


def _residual(contents: dict, A: np.ndarray, order: str, about: dict) -> np.ndarray:
    """Return the rms residual of the fit (3, N, M), nan where the file has none."""
    shape = (3, *A.shape[2:])
    values = contents.get(RESIDUAL)
    if isinstance(values, np.ndarray):
        values = _as_ndgrid(values, order)
        if values.shape == shape:
            check_mask(RESIDUAL, values, np.isnan(A).any((0, 1)), about)
            return values.astype(float)
    return np.full(shape, np.nan)


def _error(contents: dict, A: np.ndarray, order: str, about: dict) -> np.ndarray | None:
    """Return half widths of intervals of A (3, 2, N, M), None where the file has
    none."""
    values = contents.get(ERROR)
    if not isinstance(values, np.ndarray):
        return None
    return checked_error(ERROR, _as_ndgrid(values, order), A, about)


def _metric(
    contents: dict,
    axes: tuple[np.ndarray, np.ndarray],
    order: str,
    about: dict,
    degree: int,
) -> tuple[Metric | None, float | None]:
    """Return the metric and the degree of its power; (None, None) for a file without
    M11, M12 and M22. Without ABOUT nothing says that M is a power of drag: the degree
    is then None. degree: of splines."""
    if not {*METRIC} <= {*contents}:
        return None, None
    entries = []
    for name in METRIC:
        entries.append(_as_ndgrid(checked_numbers(name, contents[name]), order))
    shape = tuple(map(len, axes))
    for name, values in zip(METRIC, entries):
        if values.shape != shape:
            raise Refusal(
                f"has {name} of shape {values.shape} where alpha1 and alpha2 require "
                f"{shape}"
            )
    a, b, c = entries
    indefinite = (a <= 0) | (c <= 0) | (a * c <= b * b)
    if indefinite.any():
        place = ", ".join(map(str, np.argwhere(indefinite)[0]))
        raise Refusal(
            f"has M11, M12 and M22 that do not form a metric at index ({place})",
            because="the matrix must be positive definite",
        )
    power = about.get("power_degree")
    power = power if isinstance(power, float) and 0 < power < 100 else None
    return Metric(axes, np.array([[a, b], [b, c]]), degree), power
