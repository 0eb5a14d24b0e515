"""Results as files and as plain data: NetCDF (classic format, which every NetCDF
library opens), JSON, CSV, MAT, and data sets of xarray.

All have the names of the variables; errors and spreads are NAME_error and NAME_spread
in all of them. `geomech.results.files` knows which kind has which of these formats.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.io.files import atomic_file, write_text

ENDINGS = {"_error": "error", "_spread": "spread"}
KIND = "kind"
FORMAT = "geomech_format"
VERSION = 1
ORDER = "order_of_variables"  # SciPy writes variables in an order of its own
ROWS_TOGETHER = 10_000  # of a CSV file, that are in memory as text at a time
LARGEST_INTEGER = 2**31 - 1  # of a NetCDF file of the classic format


def flat(result: Result) -> Iterator[Variable]:
    """Yield the variables of a file: errors and spreads follow their values."""
    for variable in result.variables:
        yield replace(variable, error=None, spread=None)
        for ending, name in ENDINGS.items():
            values = getattr(variable, name)
            if values is not None:
                yield Variable(
                    variable.name + ending,
                    variable.dims,
                    values,
                    variable.unit,
                    companion_label(variable, name),
                )


def companion_label(variable: Variable, name: str) -> str:
    """Return the label of the error or the spread of a variable in a file."""
    if name == "spread":
        return f"standard deviation of {variable.name}"
    return variable.error_label or f"estimated error of {variable.name}"


def join_companions(
    kind: str, variables: Iterable[Variable], attributes: dict[str, Any]
) -> Result:
    """Return the result of the variables of a file: errors and spreads become members
    of the variables to which they belong."""
    by_name = {v.name: v for v in variables}
    variables_with_errors = []
    for name, variable in by_name.items():
        if companion_owner(name, by_name) is not None:
            continue
        more: dict[str, Any] = {}
        for ending, field in ENDINGS.items():
            if companion_owner(name + ending, by_name) == name:
                more[field] = by_name[name + ending].values
        variable = replace(variable, **more)
        if "error" in more:
            label = by_name[f"{name}_error"].label
            if label != companion_label(variable, "error"):
                variable = replace(variable, error_label=label)
        variables_with_errors.append(variable)
    return Result(kind, tuple(variables_with_errors), attributes)


def companion_owner(name: str, by_name: dict[str, Variable]) -> str | None:
    """Return the name of the variable, over the same dimensions, of which this one is
    the error or the spread."""
    for ending in ENDINGS:
        owner = by_name.get(name.removesuffix(ending))
        companion = by_name.get(name)
        if owner is None or companion is None or owner is companion:
            continue
        if owner.dims == companion.dims:
            return owner.name
    return None


def variable_attributes(variable: Variable) -> dict[str, str]:
    """Return the attributes of a variable in a file."""
    named = {
        "units": variable.units,
        "long_name": variable.label,
        "zero": variable.zero,
    }
    return {key: text for key, text in named.items() if text}


def variable_of(
    name: str, dims: tuple[str, ...], values: np.ndarray, attributes: dict[str, str]
) -> Variable:
    """Return the variable of a file from its attributes (`variable_attributes`)."""
    units = attributes.get("units", "")
    unit: Any = units
    # A list of units has one for each entry along the first dimension.
    parts = tuple(units.split(", "))
    if len(parts) > 1 and "(" not in units and dims and len(parts) == values.shape[0]:
        unit = parts
    return Variable(
        name,
        dims,
        values,
        unit,
        attributes.get("long_name", ""),
        zero=attributes.get("zero", ""),
    )


def file_attributes(result: Result) -> dict[str, Any]:
    """Return the attributes of a file."""
    return {KIND: result.kind, FORMAT: VERSION, **result.attributes}


def kind_and_attributes(attributes: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the kind and the attributes of a result from those of a file."""
    others = {
        key: value for key, value in attributes.items() if key not in (KIND, FORMAT)
    }
    return str(attributes.get(KIND, "")), others


# Plain data, JSON and xarray


def to_dict(result: Result) -> dict[str, Any]:
    """Return plain data in the layout of `xarray.Dataset.from_dict`; nan is None."""
    parts: dict[str, dict] = {"coords": {}, "data_vars": {}}
    for variable in flat(result):
        part = parts["coords" if variable.is_coordinate else "data_vars"]
        part[variable.name] = {
            "dims": list(variable.dims),
            "attrs": variable_attributes(variable),
            "data": plain_values(variable.values),
        }
    order = [variable.name for variable in flat(result)]
    return {
        "attrs": file_attributes(result),
        "dims": result.sizes,
        **parts,
        "order": order,
    }


def plain_values(values: np.ndarray) -> Any:
    """Return values as nested lists, with None for those that are not finite."""
    if values.dtype.kind != "f":
        return values.tolist()
    return np.where(np.isfinite(values), values, None).tolist()


def from_dict(data: dict[str, Any]) -> Result:
    """Return the result of `to_dict`."""
    variables = []
    parts = {**data["coords"], **data["data_vars"]}
    for name in data.get("order", parts):
        part = parts[name]
        values = np.array(part["data"])
        if values.dtype == object:
            values = values.astype(float)
        variables.append(variable_of(name, tuple(part["dims"]), values, part["attrs"]))
    kind, attributes = kind_and_attributes(data["attrs"])
    return join_companions(kind, variables, attributes)


def to_xarray(result: Result) -> Any:
    """Return a Dataset; ImportError that says how to install xarray."""
    try:
        import xarray
    except ImportError:
        raise ImportError(
            "to_xarray needs the package xarray: pip install xarray"
        ) from None
    coordinates, variables = {}, {}
    for variable in flat(result):
        array = (
            variable.dims,
            np.array(variable.values),
            variable_attributes(variable),
        )
        if variable.is_coordinate:
            coordinates[variable.name] = array
        else:
            variables[variable.name] = array
    return xarray.Dataset(variables, coordinates, file_attributes(result))


# Files


def write_netcdf(path: str | Path, result: Result) -> None:
    from scipy.io import netcdf_file

    with atomic_file(path) as part, netcdf_file(part, "w", version=2) as file:
        order = " ".join(variable.name for variable in flat(result))
        for key, value in {**file_attributes(result), ORDER: order}.items():
            if value != "":
                setattr(file, key, encoded(value))
        for variable in flat(result):
            for dim, size in zip(variable.dims, variable.values.shape):
                if dim not in file.dimensions:
                    file.createDimension(dim, size)
            write_variable(file, variable)


def write_variable(file: Any, variable: Variable) -> None:
    """Write a variable of an open NetCDF file. Text becomes an array of bytes with one
    more dimension."""
    dims = variable.dims
    values = variable.values
    code = "f8"
    if variable.is_text:
        values = letters(values)
        code = "c"
        dims = (*dims, f"{variable.name}_length")
        file.createDimension(dims[-1], values.shape[-1])
    elif fits_integers(values):
        code = "i4"
    stored = file.createVariable(variable.name, code, dims)
    stored[...] = values
    if variable.is_text:
        stored._Encoding = "utf-8"  # xarray reads text, not bytes
    for key, text in variable_attributes(variable).items():
        setattr(stored, key, encoded(text))


def fits_integers(values: np.ndarray) -> bool:
    """Return whether values are whole numbers that the classic format can hold."""
    if values.dtype.kind not in "biu":
        return False
    return bool((np.abs(values) <= LARGEST_INTEGER).all())


def encoded(value: Any) -> Any:
    """Return an attribute as NetCDF has it. Text is in UTF-8; bytes of file names that
    are no text are escaped."""
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace")
    if isinstance(value, int):
        return np.int32(value)
    # SciPy would write a Python float with seven digits.
    return np.float64(value)


def letters(values: np.ndarray) -> np.ndarray:
    """Return text as an array of bytes with one dimension more."""
    encoded = np.char.encode(np.atleast_1d(values), "utf-8")
    width = max(1, encoded.dtype.itemsize)
    letters = np.ascontiguousarray(encoded, f"S{width}").view("S1")
    return letters.reshape(*values.shape, width)


def read_netcdf(path: str | Path) -> tuple[list[Variable], dict[str, Any]]:
    """Return the variables of a file, errors and spreads among them, and its
    attributes."""
    from scipy.io import netcdf_file

    with netcdf_file(path, "r", mmap=False) as file:
        attributes = {key: decoded(value) for key, value in file._attributes.items()}
        order = attributes.pop(ORDER, " ".join(file.variables)).split()
        variables = [read_variable(name, file.variables[name]) for name in order]
    return variables, attributes


def read_variable(name: str, stored: Any) -> Variable:
    values = stored.data
    dims = stored.dimensions
    if stored.typecode() == "c":
        words = np.ascontiguousarray(values).view(f"S{values.shape[-1]}")
        values = np.char.decode(words, "utf-8").reshape(values.shape[:-1])
        dims = dims[:-1]
    elif values.dtype.byteorder == ">":
        values = values.astype(values.dtype.newbyteorder("="))
    attributes = {key: decoded(value) for key, value in stored._attributes.items()}
    return variable_of(name, tuple(dims), values, attributes)


def decoded(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode()
    return np.asarray(value).item()


def write_json(path: Path, result: Result) -> None:
    write_text(path, json.dumps(to_dict(result)) + "\n")


def read_json(path: Path) -> Result:
    return from_dict(json.loads(path.read_text(encoding="utf-8")))


def columns(result: Result, dims: Sequence[str]) -> dict[str, np.ndarray]:
    """Return the variables over ``dims`` as columns by name, after the columns of their
    coordinates."""
    dims = tuple(dims)
    shape = [result.sizes[dim] for dim in dims]
    indices = np.indices(shape).reshape(len(dims), -1)
    values_by_name = {}
    for dim, index in zip(dims, indices):
        values_by_name[dim] = index
        if dim in result:
            values_by_name[dim] = result[dim].values[index]
    for variable in flat(result):
        if variable.dims == dims and not variable.is_coordinate:
            values_by_name[variable.name] = variable.values.ravel()
    return values_by_name


def write_csv(path: Path, result: Result, dims: Sequence[str]) -> None:
    """Write the variables over ``dims`` as columns, with all digits."""
    values_by_name = columns(result, dims)
    count = max(map(len, values_by_name.values()), default=0)
    with (
        atomic_file(path) as part,
        part.open(
            "w", encoding="utf-8", errors="backslashreplace", newline="\n"
        ) as file,
    ):
        file.write(",".join(values_by_name) + "\n")
        for start in range(0, count, ROWS_TOGETHER):
            batch = slice(start, start + ROWS_TOGETHER)
            lists = [values[batch].tolist() for values in values_by_name.values()]
            for row in zip(*lists):
                file.write(",".join(map(cell, row)) + "\n")


def cell(value: Any) -> str:
    return value if isinstance(value, str) else repr(value)


def read_csv(path: Path) -> Result:
    """Return the columns of a table over its rows. A CSV file has neither units nor
    coordinates."""
    table = np.genfromtxt(
        path, delimiter=",", names=True, dtype=None, encoding="utf-8", ndmin=1
    )
    variables = [Variable(name, ("row",), table[name]) for name in table.dtype.names]
    return join_companions("", variables, {})


def write_mat(path: Path, result: Result) -> None:
    """Write variables under their names, and the attributes, dimensions and shapes in a
    struct ``geomech``."""
    from scipy.io import savemat

    arrays = {}
    descriptions = {}
    for variable in flat(result):
        arrays[variable.name] = variable.values
        descriptions[variable.name] = {
            "dims": " ".join(variable.dims),
            "shape": variable.values.shape,
            **variable_attributes(variable),
        }
    texts = {
        "about": json.dumps(file_attributes(result)),
        "variables": json.dumps(descriptions),
    }
    with atomic_file(path) as part:
        savemat(part, {**arrays, "geomech": texts}, long_field_names=True)


def read_mat(path: Path) -> Result:
    from scipy.io import loadmat

    # As text: of a path that is missing SciPy says that it is none.
    file = loadmat(str(path), appendmat=False, simplify_cells=True)
    descriptions = json.loads(str(file["geomech"]["variables"]))
    variables = []
    for name, description in descriptions.items():
        dims = tuple(description["dims"].split())
        values = np.asarray(file[name])
        if values.dtype.kind == "U":
            values = np.char.rstrip(values)
        # MATLAB has no dimensions of length 1 at the end, and SciPy drops all of them.
        shape = description.get("shape", values.shape or (1,) * len(dims))
        variables.append(variable_of(name, dims, values.reshape(shape), description))
    kind, attributes = kind_and_attributes(json.loads(str(file["geomech"]["about"])))
    return join_companions(kind, variables, attributes)
