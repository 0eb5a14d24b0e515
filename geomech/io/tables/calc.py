"""The writer of sysplotter's struct `s`, which `geomech.io.tables.sysplotter` reads: what its plot scripts take of a file that
`sys_calcsystem` saved. Function handles (s.A, s.metric, s.convert) and the instance s.conf_space are not written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.io.tables.sysplotter import DRAG, INERTIA, RESIDUAL

SHOWN = 11  # points an axis, about, of the grid of metric ellipses
BASES = {
    "mean": "com-mean",
    "link-1": "tail",
}  # its names of our frames, of any number of links
TICKS = np.array([-1.0, 0.0, 1.0])


def write_struct(path: str | Path, result: Result) -> None:
    """Write s, of the variables of `geomech.studies.fields.struct_result`; it appears whole or not at all."""
    from scipy.io import savemat

    axes = [
        v.values
        for v in result.variables
        if v.is_coordinate and v.name.startswith("alpha_")
    ]
    pick = lambda name: result[name].values if name in result else None
    A, optimised, metric = pick("A"), pick("A_optimised"), pick("metric")
    content = {
        "A_num": _cell(-A, 2),
        "Avec": _cell(A, 2),
        "Avec_optimized": _cell(optimised, 2),
    }
    beta = _cell(pick("frame_pose"), 1)
    drag = "power_degree" in result.attributes or metric is None
    s: dict[str, Any] = {
        "geometry": _geometry(result.attributes), "physics": {"drag_coefficient": 1.0}, "singularity": 0.0,
        "system_type": DRAG if drag else INERTIA,
        "costfunction": "pathlength metric", **_grids(axes, metric is not None),
        "vecfield": {
            name: {"content": content, "type": kind}
            for name, kind in (("eval", "eval"), ("display", "vector"), ("finite_element", "finite_element"))
        },
        "B_optimized": {name: {"Beta": beta} for name in ("eval", "disp")},
    }  # fmt: skip
    for ending in ("", "_optimized"):
        ccf, exterior = pick(f"ccf{ending}"), pick(f"exterior{ending}")
        parts = {"DA": ccf, "dA": exterior, "lb": exterior - ccf}
        s |= {
            f"{name}{ending}": _cell(values[:, None], 2)
            for name, values in parts.items()
        }
    if metric is not None:
        shown = tuple(slice(None, None, step) for step in _steps(axes))
        scaled = metric * (result.attributes["body_length"] ** 3 if drag else 1.0)
        parts = {"metric_eval": scaled, "metric_display": scaled[(..., *shown)]}
        s["metricfield"] = {
            k: {"content": {"metric": _cell(x, 2)}, "type": k} for k, x in parts.items()
        }
    if np.isfinite(residual := result["fit_residual"].values).all():
        s[RESIDUAL] = _cell(residual, 1)
    with atomic_file(path) as part:
        savemat(part, {"s": s}, appendmat=False)


def _cell(values: np.ndarray, lead: int) -> np.ndarray:
    """Return arrays (..., N_1, ...) as a cell of the first one or two axes; a column of one."""
    shape = values.shape[:lead]
    cell = np.empty((*shape, 1)[:2], object)
    for index in np.ndindex(*shape):
        cell[(*index, 0)[:2]] = np.array(values[index])
    return cell


def _steps(axes: list[np.ndarray]) -> list[int]:
    """Return the steps along the axes of the grid of metric ellipses."""
    return [max(1, (len(axis) - 1) // (SHOWN - 1)) for axis in axes]


def _grids(axes: list[np.ndarray], metric: bool) -> dict:
    """Return s.grid and what says how fine it is: all fields are on one grid."""
    names = ["vector", "scalar", "eval", "finite_element", *["metric_eval"] * metric]
    grids = dict.fromkeys(names, axes) | (
        {"metric_display": [a[::k] for a, k in zip(axes, _steps(axes))]}
        if metric
        else {}
    )
    return {
        "grid": {
            name: _cell(np.array(np.meshgrid(*each, indexing="ij")), 1)
            for name, each in grids.items()
        },
        "density": {
            name: np.array([float(len(axis)) for axis in each])
            for name, each in grids.items()
        },
        "grid_range": np.array([end for axis in axes for end in (axis[0], axis[-1])]),
        "tic_locs": {"x": TICKS, "y": TICKS},
    }


def _geometry(attributes: Mapping) -> dict:
    """Return s.geometry: what is known of body, length and frame."""
    body = json.loads(attributes.get("body") or "{}")
    frame, links = attributes["frame"], len(body.get("lengths", ()))
    geometry = {
        "length": float(attributes["body_length"]),
        "baseframe": BASES.get(frame, frame),
    }
    if links and frame == f"link-{(links + 1) / 2:g}":
        geometry["baseframe"] = "center"
    elif links and frame == f"link-{links}":
        geometry["baseframe"] = "head"
    elif links and frame.startswith("link-") and frame not in BASES:
        geometry["baseframe"] = float(frame.removeprefix("link-"))
    if links and not isinstance(body.get("modes"), str):
        modes = (
            {} if body.get("modes") is None else {"modes": np.array(body["modes"]).T}
        )
        geometry |= {
            "type": "n-link chain",
            "linklengths": np.array(body["lengths"]),
            **modes,
        }
    return geometry
