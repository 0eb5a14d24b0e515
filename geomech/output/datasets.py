"""Results as data sets of xarray, with the names, dimensions, units and attributes that their NetCDF files have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from geomech.geometry.connection import Connection
from geomech.geometry.field import Field
from geomech.output import sweeps
from geomech.output.netcdf import (
    COMPONENTS,
    Variable,
    angles_of,
    attributes,
    of_ccf,
    of_connection,
    shapes,
    units_of,
    variables,
)
from geomech.study.bench import Study
from geomech.study.results import Displacements, Swept
from geomech.systems.base import length_unit, shape_labels


def xarray() -> Any:
    """The package, or ImportError that says how to get it."""
    try:
        import xarray
    except ImportError:
        raise ImportError("to_xarray needs the package xarray: pip install xarray") from None
    return xarray


def dataset(found: Iterable[Variable], coordinates: Mapping, attrs: Mapping | None = None):
    """A Dataset of variables. coordinates: (values, attributes) by name of dimension."""
    xr, found = xarray(), list(found)
    told = lambda v: {name: text for name, text in (("units", v.units), ("long_name", v.long_name)) if text}
    used = {name for v in found for name in v.dimensions}
    return xr.Dataset(
        {v.name: (v.dimensions, np.array(v.values), told(v)) for v in found},
        {name: (name, *coordinates[name]) for name in coordinates if name in used},
        dict(attrs or {}),
    )


def of_shapes(axes: Sequence[np.ndarray], labels: Sequence[tuple[str, str]]) -> dict:
    """Coordinates of components, joints and shapes. labels: (name, unit) of each shape variable."""
    rows = {"component": (list(COMPONENTS), {}), "joint": (np.arange(1, len(axes) + 1, dtype="i4"), {})}
    told = {v.name: (v.values, {"units": v.units, "long_name": v.long_name}) for v in shapes(axes, labels)}
    return {**rows, **told}


def _called(axes, names: Sequence[str]) -> dict:
    """`of_shapes` of shape variables of these names, or of joint angles."""
    return of_shapes(axes, [(name, "rad") for name in names or angles_of(axes)])


def of_study(study: Study):
    """As the file of `geomech connection`: A, its fit residual, the CCF and what else that has."""
    coordinates = of_shapes(study.fitted.axes, shape_labels(study.scene.system))
    return dataset(variables(study), coordinates, attributes(study))


def connection(fitted: Connection, names: Sequence[str] = ()):
    """A, its fit residual and the rms of xi."""
    told = {"sign_of_A": "xi = + A alphadot", **_sized(fitted.unit, fitted.length)}
    return dataset(of_connection(fitted), _called(fitted.axes, names), told)


def _sized(unit: str, length: float | None) -> dict:
    """The body's length and its unit, as attributes; none where nothing says them."""
    return {} if length is None else {"body_length": float(length), "length_unit": units_of(unit)}


def field(values: Field, name: str, names: Sequence[str] = ()):
    """A DataArray; with rows x, y and theta it is a CCF, in its units."""
    lead = values.values.shape[: -values.joints]
    if lead == (3,):
        return dataset([of_ccf(values, name)], _called(values.axes, names))[name]
    dimensions = (*(f"dimension_{k}" for k in range(len(lead))), *angles_of(values.axes))
    return dataset([Variable(name, dimensions, values.values, "", "")], _called(values.axes, names))[name]


def displacements(table: Displacements):
    """displacement (tier, amplitude, component) and its errors (tier, amplitude); where there is a frequency speeds, and
    where the medium is uncertain what that does, alike."""
    names, system = table.tiers, table.scene.system
    unit = units_of(length_unit(system))
    each = lambda key: np.array([table.errors(key)[name] for name in names])
    poses = np.array([table[name] for name in names], float).reshape(len(names), len(table["amplitude"]), 3)
    over = ("tier", "amplitude")
    found = [
        Variable(
            "displacement", (*over, "component"), poses, f"{unit} (x, y), rad (theta)", "net displacement per cycle"
        ),
        Variable("estimate", over, each("estimate"), unit, "estimated error of the position"),
        Variable("estimate_heading", over, each("estimate_heading"), "rad", "estimated error of the heading"),
    ]
    found += [Variable(key, over, each(key), units, said) for key, units, said in _besides(unit) if key in table]
    amplitude = np.array(table["amplitude"], float), {"long_name": table.gait.amplitude_label}
    coordinates = {"tier": (names, {}), "amplitude": amplitude, "component": (list(COMPONENTS), {})}
    attrs = {"title": f"Net displacement per cycle of the scene {table.scene.name}", "frame": table.scene.frame}
    attrs |= _sized(length_unit(system), system.length)
    if "frequency" in table:
        attrs |= {"frequency": float(table["frequency"]), "frequency_unit": "Hz"}
    if "estimate_is" in table:
        attrs["estimate_is"] = table["estimate_is"]
    return dataset(found, coordinates, attrs)


def _besides(unit: str) -> list[tuple[str, str, str]]:
    """(key, units, what it is) of what tables of some scenes have besides."""
    return [
        ("speed", f"{unit} s-1", "net distance times frequency"),
        ("speed_body_lengths", "body length s-1", "net distance in body lengths times frequency"),
        ("turning_rate", "rad s-1", "heading times frequency"),
        ("medium_error", unit, "one standard deviation of the position by the medium's covariance"),
        ("medium_error_heading", "rad", "one standard deviation of the heading by the medium's covariance"),
    ]


def swept(results: Swept):
    """As the file that `sweeps.save` writes."""
    coordinates = {name: (values, {"long_name": parameter}) for name, parameter, values in sweeps.parameters(results)}
    coordinates["component"] = list(COMPONENTS), {}
    return dataset(sweeps.variables(results.scene, results), coordinates, sweeps.attributes(results.scene))
