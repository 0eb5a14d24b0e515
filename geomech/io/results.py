"""Results as NetCDF files (classic format, which every NetCDF library opens) and as data sets of xarray.

Both are functions of a list of variables, and give the same names, dimensions, units and attributes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.io.files import atomic_file, write_text

UNITS = {"BL": "body length"}  # of lengths, as files name them
ENDINGS = "_error", "_spread"  # of the names under which files have errors and spreads


def unit_name(unit: str) -> str:
    """Return a unit of lengths as it is written in files."""
    return UNITS.get(unit, unit)


def file_variables(result: Result) -> Iterator[Variable]:
    """Yield the variables of a file: errors and spreads follow their values as NAME_error and NAME_spread."""
    for v in result.variables:
        yield replace(v, error=None, spread=None)
        labels = (
            v.error_label or f"estimated error of {v.name}",
            f"standard deviation of {v.name}",
        )
        for values, ending, label in zip((v.error, v.spread), ENDINGS, labels):
            if values is not None:
                yield Variable(v.name + ending, v.dims, values, v.unit, label)


def write_netcdf(path: str | Path, result: Result) -> None:
    """Write a result; the file appears whole or not at all."""
    from scipy.io import netcdf_file

    with atomic_file(path) as part, netcdf_file(part, "w", version=2) as file:
        for key, value in result.attributes.items():
            value = "; ".join(value) if isinstance(value, tuple) else value
            if isinstance(value, str) and not value:
                continue
            # SciPy keeps but seven digits of a float of Python's
            number = np.float64(value) if isinstance(value, float) else value
            setattr(file, key, _encoded(value) if isinstance(value, str) else number)
        for v in file_variables(result):
            for dim, size in zip(v.dims, v.values.shape):
                if dim not in file.dimensions:
                    file.createDimension(dim, size)
            _write(file, v)


def _write(file: Any, v: Variable) -> None:
    if v.is_text:
        width = v.values.dtype.itemsize // 4
        file.createDimension(f"{v.name}_length", width)
        variable = file.createVariable(v.name, "c", (*v.dims, f"{v.name}_length"))
        variable[:] = np.array(
            [list(word.ljust(width, "\0")) for word in v.values.tolist()], "S1"
        )
        variable._Encoding = "ascii"
    else:
        variable = file.createVariable(
            v.name, "i4" if v.values.dtype.kind == "i" else "f8", v.dims
        )
        variable[...] = v.values
    for key, text in _described(v).items():
        setattr(variable, key, _encoded(text))


def _described(v: Variable) -> dict[str, str]:
    return {
        key: text for key, text in (("units", v.unit), ("long_name", v.label)) if text
    }


def _encoded(text: str) -> bytes:
    """Return text in UTF-8; bytes of file names that are no text are escaped."""
    return text.encode("utf-8", "backslashreplace")


def write_csv(path: str | Path, result: Result) -> None:
    """Write the variables over the first one's dimension as columns under their names, with all digits; the file appears
    whole or not at all."""
    columns = [v for v in result.variables if v.dims == result.variables[0].dims]
    rows = np.stack([v.values for v in columns], -1).tolist()
    lines = [
        ",".join(v.name for v in columns),
        *(",".join(map(repr, row)) for row in rows),
    ]
    write_text(path, "\n".join(lines) + "\n")


def xarray() -> Any:
    """Return the package; ImportError that says how to install it."""
    try:
        import xarray
    except ImportError:
        raise ImportError(
            "to_xarray needs the package xarray: pip install xarray"
        ) from None
    return xarray


def to_xarray(result: Result) -> Any:
    """Return a Dataset. Its coordinates are those whose dimension some variable has."""
    variables = list(file_variables(result))
    arrays = {v.name: (v.dims, np.array(v.values), _described(v)) for v in variables}
    used = {dim for v in variables if not v.is_coordinate for dim in v.dims}
    axes = {v.name for v in variables if v.is_coordinate}
    return xarray().Dataset(
        {name: x for name, x in arrays.items() if name not in axes},
        {name: x for name, x in arrays.items() if name in axes & used},
        dict(result.attributes),
    )
