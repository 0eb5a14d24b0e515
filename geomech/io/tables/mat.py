"""A connection as a MATLAB file in sysplotter's layout: alpha1, alpha2, Ax1, Ax2, Ay1, Ay2, Atheta1, Atheta2, each (N, M), and
M11, M12, M22, the metric of shape space, where it is known; or sysplotter's struct s (`geomech.io.tables.sysplotter`).

Source: https://github.com/OSU-LRAM/GeometricSystemPlotter, Granular_Local_Connection_Matrix.mat. Files that `write` wrote
say more, in the variables ABOUT, RESIDUAL and ERROR.
"""

from __future__ import annotations

import functools
import io
import json
import warnings
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.geometry.connection import Connection
from geomech.geometry.metric import Metric
from geomech.io.files import atomic_file
from geomech.io.tables import hdf5, matlab, sysplotter
from geomech.io.tables.base import (
    FORMATS,
    LARGEST_ANGLE,
    LAYOUTS,
    ORDERS,
    SIGNS,
    UNKNOWN_FRAME,
    Stored,
    checked_axis,
    checked_body,
    checked_error,
    checked_level,
    checked_names,
    detected_sign,
    masks,
    numbers,
    rms,
)
from geomech.io.tables.calc import write_struct
from geomech.io.tables.netcdf import UNITS, shape_name
from rft.core.refusal import Refusal

ANGLES = ("alpha1", "alpha2")
ENTRIES = tuple(f"A{row}{joint}" for row in ("x", "y", "theta") for joint in (1, 2))
METRIC = ("M11", "M12", "M22")
STRUCT = "s"
OPTIONAL = (
    "singular_shapes",
    "level",
    "body",
    "power_degree",
)  # attributes that ABOUT has where they are known
ABOUT, RESIDUAL, ERROR = "geomech_about", "geomech_fit_residual", "geomech_A_error"
SAVE = "save it in MATLAB by save(FILE, ..., '-v7')"


def write(
    path: str | Path,
    result: Result,
    sign: str = "+",
    order: str = "ndgrid",
    layout: str = LAYOUTS[0],
) -> None:
    """Write A, each entry (N, M), for xi = ``sign`` A alphadot; rows run over alpha1 as of ndgrid, or over alpha2 as of
    meshgrid.

    ABOUT is a JSON text of sign, frame, body length, unit and spline. The file has the fit residual (3, N, M), too, which
    includes the part of the velocity that is even in alphadot, where A has intervals their half widths (3, 2, N, M), and M
    where it is quadratic. It appears whole or not at all. layout: "struct" writes sysplotter's struct s (`write_struct`)
    instead."""
    if layout == LAYOUTS[1]:
        write_struct(path, result)
        return
    from scipy.io import savemat

    A, axes = result["A"], [result["alpha_1"], result["alpha_2"]]
    residual = result["fit_residual"].values
    if "even_part" in result:  # counts at half of all directions
        residual = np.sqrt(residual**2 + result["even_part"].values ** 2 / 2)
    known = np.isfinite(residual[:, ~np.isnan(A.values).any((0, 1))]).all()
    extra = {RESIDUAL: residual} if known else {}
    if A.error is not None:
        extra[ERROR] = A.error
    if "metric" in result:
        extra |= dict(zip(METRIC, result["metric"].values[np.triu_indices(2)]))
    factor = 1.0 if sign == "+" else -1.0
    shapes = dict(
        zip(ANGLES, np.meshgrid(*(axis.values for axis in axes), indexing="ij"))
    )
    entries = dict(zip(ENTRIES, factor * A.values.reshape(6, *A.values.shape[2:])))
    ordered = (lambda x: x) if order == "ndgrid" else (lambda x: x.swapaxes(-1, -2))
    arrays = {
        name: np.array(ordered(x)) for name, x in {**shapes, **entries, **extra}.items()
    }
    about = _written_about(result.attributes, [shape_name(axis) for axis in axes], sign)
    with atomic_file(path) as part:
        savemat(part, {**arrays, ABOUT: json.dumps(about)}, appendmat=False)


def _written_about(attributes: Mapping, names: list[str], sign: str) -> dict:
    """Return what ABOUT says. names: of the shape variables."""
    meaning = "alpha_k is the heading of link k+1 minus that of link k, link 1 the tail"
    if names != ["alpha_1", "alpha_2"]:
        meaning = f"alpha1 is {names[0]}, alpha2 {names[1]}"
    return {
        "sign": sign, "frame": attributes["frame"], "length": attributes["body_length"],
        "unit": UNITS[attributes["length_unit"]], "interpolation": attributes["interpolation"], "shapes": names,
        "conventions": f"xi = {sign} A alphadot; {meaning}",
        **{key: value for key, value in attributes.items() if key in OPTIONAL},
    }  # fmt: skip


@FORMATS.register(
    suffix=".mat",
    write=write,
    settings=("sign", "order", "layout"),
    joints=2,
    whole=False,
)
def parse(raw: bytes, sign: str, order: str, sha256: str) -> Stored:
    """Return the table in the bytes of a file; Refusal, to follow the file's name, if there is none."""
    found = variables(raw, (STRUCT, *ANGLES, *ENTRIES, *METRIC, ABOUT, RESIDUAL, ERROR))
    if isinstance(found.get(STRUCT), dict) and not {*ANGLES, *ENTRIES} <= {*found}:
        return sysplotter.parse(found[STRUCT], sign, order, sha256)
    _check(found)
    axes, order = _axes(found, order)
    about = _about(found)
    A = _entries(found, axes, order, about)
    if not A.any():
        raise Refusal("has a connection that is zero everywhere")
    residual, error = _residual(found, A, order, about), _error(found, A, order, about)
    degree = about.get("interpolation", 3)
    degree = degree if degree in (1, 2, 3, 4, 5) and min(map(len, axes)) > degree else 3
    sized = (
        about.get("unit") in ("BL", "m")
        and isinstance(about.get("length"), float)
        and 0 < about["length"] < 1e9
    )
    length, unit = (about["length"], about["unit"]) if sized else (1.0, "BL")
    size = {"unit": unit, "length": length} if sized else {}
    plain = Connection(
        axes, A, residual, rms(A, np.nan_to_num(residual)), degree, **size
    )
    assumptions = (
        ()
        if found[ANGLES[0]].ndim == 1 or order == "ndgrid"
        else ("its arrays run as meshgrid's",)
    )
    if not sign and about.get("sign") not in SIGNS:
        assumptions += (
            f"its sign is made out as {SIGNS[detected_sign(plain)]}; say sign = '+' or '-' if you know it",
        )
    sign = sign or (
        about["sign"] if about.get("sign") in SIGNS else detected_sign(plain)
    )
    frame = about["frame"] if isinstance(about.get("frame"), str) else UNKNOWN_FRAME
    connection = plain if sign == "+" else replace(plain, A=-A)
    shapes = checked_names(about.get("shapes"), ["alpha_1", "alpha_2"])
    optional = {
        "A_error": error, "level": checked_level(about), "sized": sized, "body": checked_body(about.get("body")),
        **_metric(found, axes, order, about, degree),
    }  # fmt: skip
    return Stored(
        connection,
        None,
        None,
        length,
        unit,
        frame,
        sign,
        order,
        assumptions,
        sha256,
        shapes,
        **optional,
    )


def variables(raw: bytes, names: Collection[str]) -> dict[str, Any]:
    """Return the variables of a file by name, those of some names at least, as `matlab.arrays`; Refusal if it is none of
    MATLAB's."""
    if raw[:4] == b"\x89HDF" or raw[:10] == b"MATLAB 7.3":
        return hdf5.arrays(raw, names)
    if raw[:3] == b"CDF":
        raise Refusal(
            "is no MATLAB file, but a NetCDF one", instead="end its name in .nc"
        )
    try:
        return (
            _read_version_4(raw, names)
            if raw[:4] and 0 in raw[:4]
            else matlab.arrays(raw)
        )
    except ValueError:
        raise Refusal(
            "is damaged, cut short, or no MATLAB file", instead=SAVE
        ) from None


def _check(variables: dict) -> None:
    """Raise Refusal unless the variables of the layout are there, as arrays of real numbers."""
    for name in (*ANGLES, *ENTRIES):
        if name not in variables:
            connection = f"a connection is {', '.join((*ANGLES, *ENTRIES))}, or sysplotter's struct s"
            raise Refusal(f"has no {name}", because=connection)
        if (
            not isinstance(variables[name], np.ndarray)
            or variables[name].dtype == object
        ):
            raise Refusal(f"has {name} that is no array of real numbers")


def _read_version_4(raw: bytes, names: Collection[str]) -> dict[str, np.ndarray]:
    """Return the variables of a file of version 4, which SciPy reads in Python; Refusal for a damaged one."""
    from scipy.io import loadmat

    try:  # what is damaged makes SciPy raise whatever comes first
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return loadmat(io.BytesIO(raw), variable_names=[*names])
    except Exception:
        raise Refusal("damaged") from None


def _axes(variables: dict, order: str) -> tuple[tuple[np.ndarray, np.ndarray], str]:
    """Return the angles of both axes, and the order in which arrays run over them."""
    angles = functools.partial(
        checked_axis, largest=LARGEST_ANGLE if ABOUT in variables else 2 * np.pi
    )
    first, second = (numbers(name, variables[name]) for name in ANGLES)
    if first.ndim == second.ndim == 2 and min(*first.shape, *second.shape) == 1:
        if not order:
            raise Refusal(
                "has alpha1 and alpha2 as rows, which leave the order open",
                instead="say order = 'ndgrid' or 'meshgrid'",
            )
        return (
            angles("alpha1", first.ravel()),
            angles("alpha2", second.ravel()),
        ), order
    if first.ndim != 2 or first.shape != second.shape:
        raise Refusal(
            f"has alpha1 {first.shape} and alpha2 {second.shape}, which span no grid"
        )
    for name, (a, b) in zip(ORDERS, ((first, second), (first.T, second.T))):
        if max(np.ptp(a, axis=1).max(), np.ptp(b, axis=0).max()) <= 1e-9:
            if order not in ("", name):
                raise Refusal(f"has arrays that run as {name}'s", instead="drop order")
            return (angles("alpha1", a[:, 0]), angles("alpha2", b[0])), name
    raise Refusal(
        "has alpha1 and alpha2 that span no grid",
        because="one must change along rows alone, the other along columns",
    )


def _about(variables: dict) -> dict:
    """Return the attributes of a file that geomech wrote; {} if they make no sense."""
    try:
        attributes = json.loads(str(variables.get(ABOUT, "")))
    except (ValueError, RecursionError):
        return {}
    return attributes if isinstance(attributes, dict) else {}


def _entries(variables: dict, axes, order: str, about: dict) -> np.ndarray:
    """Return A (3, 2, N, M); nan in all entries at singular shapes, if the file declares any."""
    arrays, expected = (
        {},
        tuple(len(a) for a in (axes if order == "ndgrid" else axes[::-1])),
    )
    for name in ENTRIES:
        values = (
            variables[name]
            if variables[name].dtype.kind == "f"
            else numbers(name, variables[name])
        )
        if values.shape != expected:
            raise Refusal(
                f"has {name} of shape {values.shape} where alpha1 and alpha2 make it {expected}"
            )
        arrays[name] = _as_ndgrid(values, order).astype(float)
    masked = np.isnan([*arrays.values()]).any(0)
    for name, values in arrays.items():
        masks(name, values, masked, about)
    return np.array([*arrays.values()]).reshape(3, 2, *masked.shape)


def _as_ndgrid(values: np.ndarray, order: str) -> np.ndarray:
    """Return values (..., N, M) from arrays in the given order."""
    return values if order == "ndgrid" else values.swapaxes(-1, -2)


def _residual(variables: dict, A: np.ndarray, order: str, about: dict) -> np.ndarray:
    """Return the rms residual of the fit (3, N, M), nan where the file has none."""
    values = variables.get(RESIDUAL)
    if not isinstance(values, np.ndarray) or _as_ndgrid(values, order).shape != (
        3,
        *A.shape[2:],
    ):
        return np.full((3, *A.shape[2:]), np.nan)
    values = _as_ndgrid(values, order)
    masks(RESIDUAL, values, np.isnan(A).any((0, 1)), about)
    return values.astype(float)


def _error(
    variables: dict, A: np.ndarray, order: str, about: dict
) -> np.ndarray | None:
    """Return half widths of intervals of A (3, 2, N, M), None where the file has none."""
    values = variables.get(ERROR)
    return (
        checked_error(ERROR, _as_ndgrid(values, order), A, about)
        if isinstance(values, np.ndarray)
        else None
    )


def _metric(variables: dict, axes, order: str, about: dict, degree: int) -> dict:
    """Return metric and power_degree as arguments of `Stored`; {} of a file without M11, M12 and M22.

    Without ABOUT nothing says that M is a power of drag: it is then a metric of its own."""
    if not {*METRIC} <= {*variables}:
        return {}
    given = {name: _as_ndgrid(numbers(name, variables[name]), order) for name in METRIC}
    shape = tuple(map(len, axes))
    for name, values in given.items():
        if values.shape != shape:
            raise Refusal(
                f"has {name} of shape {values.shape} where alpha1 and alpha2 make it {shape}"
            )
    a, b, c = given.values()
    indefinite = (a <= 0) | (c <= 0) | (a * c <= b * b)
    if indefinite.any():
        place = ", ".join(map(str, np.argwhere(indefinite)[0]))
        raise Refusal(
            f"has M11, M12 and M22 that are no metric at index ({place})",
            because="it must be positive definite",
        )
    power = about.get("power_degree")
    power = power if isinstance(power, float) and 0 < power < 100 else None
    return {
        "metric": Metric(axes, np.array([[a, b], [b, c]]), degree),
        "power_degree": power,
    }
