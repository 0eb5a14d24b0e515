"""The writer of sysplotter's struct `s`, which `geomech.io.tables.sysplotter` reads.

It writes what sysplotter's plot scripts read from a file of `sys_calcsystem`. Function
handles (s.A, s.metric, s.convert) and the instance s.conf_space are not written.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.io.tables.sysplotter import DRAG, INERTIA, RESIDUAL

ELLIPSES = 11  # points per axis, about, of the grid of metric ellipses
BASES = {  # its names of our frames, for any number of links
    "mean": "com-mean",
    "link-1": "tail",
}
TICKS = np.array([-1.0, 0.0, 1.0])


def write_struct(path: str | Path, result: Result) -> None:
    """Write s from the variables of `geomech.studies.maps.fields.struct_result`; the
    file appears whole or not at all."""
    from scipy.io import savemat

    axes = []
    for variable in result.variables:
        if variable.is_coordinate and variable.name.startswith("alpha_"):
            axes.append(variable.values)
    has_metric = "metric" in result
    is_of_drag = "power_degree" in result.attributes or not has_metric
    s: dict[str, Any] = {
        "geometry": _geometry(result.attributes),
        "physics": {"drag_coefficient": 1.0},
        "singularity": 0.0,
        "system_type": DRAG if is_of_drag else INERTIA,
        "costfunction": "pathlength metric",
        **_grids(axes, has_metric),
        **_connection(result),
        **_curvatures(result),
    }
    if has_metric:
        metric = result["metric"].values
        # The inverse of the change of units when `sysplotter` reads such a metric.
        factor = result.attributes["body_length"] ** 3 if is_of_drag else 1.0
        s["metricfield"] = _metric_fields(metric * factor, axes)
    residual = result["fit_residual"].values
    if np.isfinite(residual).all():
        s[RESIDUAL] = _cell(residual, 1)
    with atomic_file(path) as part:
        savemat(part, {"s": s}, appendmat=False)


def _connection(result: Result) -> dict:
    """Return s.vecfield and s.B_optimized: A, and its minimum-perturbation frame."""
    A = result["A"].values
    content = {
        "A_num": _cell(-A, 2),
        "Avec": _cell(A, 2),
        "Avec_optimized": _cell(result["A_optimised"].values, 2),
    }
    beta = _cell(result["frame_pose"].values, 1)
    return {
        "vecfield": {
            "eval": {"content": content, "type": "eval"},
            "display": {"content": content, "type": "vector"},
            "finite_element": {"content": content, "type": "finite_element"},
        },
        "B_optimized": {"eval": {"Beta": beta}, "disp": {"Beta": beta}},
    }


def _curvatures(result: Result) -> dict:
    """Return the CCF and its two parts, in both frames."""
    fields = {}
    for ending in ("", "_optimized"):
        ccf = result[f"ccf{ending}"].values
        exterior = result[f"exterior{ending}"].values
        parts = {"DA": ccf, "dA": exterior, "lb": exterior - ccf}
        for name, values in parts.items():
            fields[f"{name}{ending}"] = _cell(values[:, None], 2)
    return fields


def _metric_fields(metric: np.ndarray, axes: list[np.ndarray]) -> dict:
    """Return s.metricfield: the metric on the whole grid and on that of ellipses."""
    coarse = tuple(slice(None, None, step) for step in _ellipse_steps(axes))
    fields = {
        "metric_eval": metric,
        "metric_display": metric[(..., *coarse)],
    }
    return {
        name: {"content": {"metric": _cell(values, 2)}, "type": name}
        for name, values in fields.items()
    }


def _cell(values: np.ndarray, lead: int) -> np.ndarray:
    """Return arrays (..., N_1, ...) as a cell of the first one or two axes; one axis
    becomes a column."""
    shape = values.shape[:lead]
    cell = np.empty(shape, object)
    for index in np.ndindex(*shape):
        cell[index] = np.array(values[index])
    if lead == 1:
        return cell[:, None]
    return cell


def _ellipse_steps(axes: list[np.ndarray]) -> list[int]:
    """Return the steps along the axes of the grid of metric ellipses."""
    return [max(1, (len(axis) - 1) // (ELLIPSES - 1)) for axis in axes]


def _grids(axes: list[np.ndarray], has_metric: bool) -> dict:
    """Return s.grid and the fields that state its fineness: all fields but the metric
    ellipses are on one grid."""
    axes_by_name = dict.fromkeys(("vector", "scalar", "eval", "finite_element"), axes)
    if has_metric:
        axes_by_name["metric_eval"] = axes
        axes_by_name["metric_display"] = [
            axis[::step] for axis, step in zip(axes, _ellipse_steps(axes))
        ]
    grids = {}
    densities = {}
    for name, grid_axes in axes_by_name.items():
        grids[name] = _cell(np.array(np.meshgrid(*grid_axes, indexing="ij")), 1)
        densities[name] = np.array([float(len(axis)) for axis in grid_axes])
    ends = [(axis[0], axis[-1]) for axis in axes]
    return {
        "grid": grids,
        "density": densities,
        "grid_range": np.array(ends).ravel(),
        "tic_locs": {"x": TICKS, "y": TICKS},
    }


def _geometry(attributes: Mapping) -> dict:
    """Return s.geometry: what is known of body, length and frame."""
    body = json.loads(attributes.get("body") or "{}")
    links = len(body.get("lengths", ()))
    geometry = {
        "length": float(attributes["body_length"]),
        "baseframe": _base_frame(attributes["frame"], links),
    }
    # Modes that are given by a name are no matrix, which sysplotter needs.
    if links and not isinstance(body.get("modes"), str):
        geometry["type"] = "n-link chain"
        geometry["linklengths"] = np.array(body["lengths"])
        if body.get("modes") is not None:
            geometry["modes"] = np.array(body["modes"]).T
    return geometry


def _base_frame(frame: str, links: int) -> str | float:
    """Return sysplotter's name of a frame, or the number of its link. links: of the
    body, 0 where it is unknown."""
    if links and frame == f"link-{(links + 1) / 2:g}":
        return "center"
    if links and frame == f"link-{links}":
        return "head"
    if links and frame.startswith("link-") and frame not in BASES:
        return float(frame.removeprefix("link-"))
    return BASES.get(frame, frame)
