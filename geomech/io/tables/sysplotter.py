"""The struct `s` that sysplotter's `sys_calcsystem` saves: a system on a grid, with all that was computed of it.

Source: https://github.com/OSU-LRAM/GeometricSystemPlotter (MIT), ProgramFiles/sys_calcsystem.m and its functions. There

    s.grid.eval{k}                             alpha_k on the grid, as of ndgrid
    s.vecfield.eval.content.Avec{i, k}         A of xi = + A alphadot, the negative of A_num; rows x, y, theta
    s.vecfield.eval.content.Avec_optimized     the same in minimum-perturbation coordinates
    s.B_optimized.eval.Beta{i}                 pose of that frame in the first
    s.DA{i, pair}, s.DA_optimized{i, pair}     CCF, positive for counter-clockwise loops: dA - lb, so lb = -[A, A]
    s.metricfield.metric_eval.content.metric   M, on s.grid.metric_eval
    s.geometry                                 linklengths, length of the whole body, modes, baseframe

The derivatives in its CCF are differences of neighbours, of order 2, and one-sided at the edge; its minimum-perturbation
coordinates solve the same equations as `geomech.geometry.minimum_perturbation` in linear elements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geomech.geometry.connection import Connection
from geomech.geometry.curvature import ccf
from geomech.geometry.field import Field
from geomech.geometry.metric import Metric
from geomech.geometry.minimum_perturbation import minimum_perturbation
from geomech.io.tables.base import (
    MINIMUM_PERTURBATION,
    UNKNOWN_FRAME,
    Stored,
    checked_axis,
    numbers,
    rms,
)
from rft.core.refusal import Refusal

CALC = "save it by sys_calcsystem, in a file whose name ends in _calc.mat"
CONTENT = "vecfield.eval.content"
DRAG, INERTIA = "drag", "inertia"  # s.system_type
RESIDUAL = "geomech_fit_residual"  # a field that sysplotter has not: rms of xi - A alphadot, as of `Connection`
OURS = (
    MINIMUM_PERTURBATION,
    UNKNOWN_FRAME,
)  # names of frames in files of ours that sysplotter has not
FRAMES = {
    "com-mean": "mean",
    "tail": "link-1",
}  # our names of its base frames, of any number of links


@dataclass(frozen=True, eq=False)
class Computed:
    """What sysplotter computed of a connection (3, d, N_1, ...), in body lengths and rad; None where the file has it not.

    A_optimised: A in its minimum-perturbation coordinates. beta: (3, N_1, ...), pose of their frame in the first. ccf,
    ccf_optimised: (3, pairs, N_1, ...). metric: M (d, d, ...) on a grid of its own, ``metric_axes``.
    """

    A_optimised: np.ndarray | None = None
    beta: np.ndarray | None = None
    ccf: np.ndarray | None = None
    ccf_optimised: np.ndarray | None = None
    metric_axes: tuple[np.ndarray, ...] = ()
    metric: np.ndarray | None = None


def compared(stored: Stored) -> dict[str, float]:
    """Return how far what sysplotter computed is from ours of its A, in the middle half of the grid, over the largest value
    there is: by name, in words."""
    c, theirs = stored.connection, stored.computed
    ours = {"CCF of joints 1 and 2": (ccf(c).values, theirs.ccf)}
    frame = minimum_perturbation(c)
    ours["minimum-perturbation frame"] = frame.field.values, theirs.beta
    ours["CCF in that frame"] = (
        ccf(replace(c, A=frame.connection(c))).values,
        theirs.ccf_optimised,
    )
    inner = (..., *(slice(len(a) // 4, -(len(a) // 4) or None) for a in c.axes))
    found = {}
    for name, (values, other) in ours.items():
        if other is not None:
            other = other[:, 0] if other.ndim > values.ndim else other
            largest = (
                np.abs(values).reshape(3, -1).max(1).reshape(3, *[1] * len(c.axes))
            )
            found[name] = float(
                (np.abs(values - other) / np.where(largest > 1e-9, largest, np.inf))[
                    inner
                ].max()
            )
    return found


def parse(s: Mapping, sign: str, order: str, sha256: str) -> Stored:
    """Return the system of a struct s; Refusal, to follow the file's name, if it has none."""
    if sign not in ("", "+") or order not in ("", "ndgrid"):
        raise Refusal(
            "has a struct s, which says sign and order itself",
            instead="drop sign and order",
        )
    axes = _axes(s, "grid.eval")
    shape, d = tuple(map(len, axes)), len(axes)
    A = _cells(s, f"{CONTENT}.Avec", (3, d), shape)
    _check_negative(s, A)
    body, frame, length = _body(s)
    unit = np.array(
        [1.0, 1.0, 1.0] if length is None else [1 / length, 1 / length, 1.0]
    )
    scaled = lambda x: None if x is None else x * unit.reshape(3, *[1] * (x.ndim - 1))
    optional = lambda path, lead: (
        _cells(s, path, lead, shape) if _has(s, path) else None
    )
    pairs = d * (d - 1) // 2
    metric, degree, axes_of_metric = _metric(s, d, length)
    computed = Computed(
        scaled(optional(f"{CONTENT}.Avec_optimized", (3, d))), scaled(optional("B_optimized.eval.Beta", (3,))),
        scaled(optional("DA", (3, pairs))), scaled(optional("DA_optimized", (3, pairs))), axes_of_metric, metric,
    )  # fmt: skip
    size = {} if length is None else {"unit": "BL", "length": 1.0}
    spline = min(3, min(shape) - 1)
    A, residual = scaled(A), scaled(optional(RESIDUAL, (3,)))
    residual = np.full((3, *shape), np.nan) if residual is None else residual
    connection = Connection(
        axes, A, residual, rms(A, np.nan_to_num(residual)), spline, **size
    )
    return Stored(
        connection, frame=frame, sha256=sha256, shapes=tuple(f"alpha_{k + 1}" for k in range(d)), sized=length is not None,
        metric=None if metric is None else _on_grid(axes_of_metric, metric, axes, spline), power_degree=degree, body=body,
        computed=computed,
    )  # fmt: skip


def _has(s: Mapping, path: str) -> bool:
    value: Any = s
    for name in path.split("."):
        if not isinstance(value, Mapping) or value.get(name) is None:
            return False
        value = value[name]
    return True


def _get(s: Mapping, path: str) -> Any:
    """Return a field of the struct; Refusal if there is none."""
    if not _has(s, path):
        raise Refusal(f"has no s.{path}", instead=CALC)
    for name in path.split("."):
        s = s[name]
    return s


def _cells(
    s: Mapping, path: str, lead: tuple[int, ...], shape: tuple[int, ...]
) -> np.ndarray:
    """Return a cell (lead) of arrays of a shape as numbers (*lead, *shape)."""
    cell, count = _get(s, path), int(np.prod(lead))
    if not isinstance(cell, np.ndarray) or cell.dtype != object or cell.size != count:
        raise Refusal(
            f"has s.{path} that is no cell of {' x '.join(map(str, lead))} arrays",
            instead=CALC,
        )
    out = np.empty((count, *shape))
    for k, values in enumerate(cell.reshape(count)):
        place = (
            f"s.{path}{{{', '.join(str(i + 1) for i in np.unravel_index(k, lead))}}}"
        )
        values = _numbers(place, np.nan if values is None else values)
        if values.shape != shape:
            raise Refusal(
                f"has {place} of shape {values.shape} where its grid makes it {shape}",
                instead=CALC,
            )
        out[k] = values
    return out.reshape(*lead, *shape)


def _numbers(place: str, values: Any) -> np.ndarray:
    """Return `numbers`, with the place of the first that is not finite as MATLAB counts, from 1."""
    if (
        getattr(values, "dtype", np.dtype(object)).kind == "f"
        and not np.isfinite(values).all()
    ):
        index = ", ".join(str(k + 1) for k in np.argwhere(~np.isfinite(values))[0])
        raise Refusal(
            f"has {place} that is not finite (nan or inf) at ({index})",
            instead="mend it",
        )
    return numbers(place, values)


def _axes(s: Mapping, path: str) -> tuple[np.ndarray, ...]:
    """Return the axes of a grid; Refusal unless its arrays run as ndgrid's."""
    cell = _get(s, path)
    if not isinstance(cell, np.ndarray) or cell.dtype != object or cell.size < 2:
        raise Refusal(
            f"has s.{path} that is no cell of the grids of two angles or more",
            instead=CALC,
        )
    grids = [_numbers(f"s.{path}{{{k + 1}}}", x) for k, x in enumerate(cell.ravel())]
    if any(x.ndim != len(grids) or x.shape != grids[0].shape for x in grids):
        raise Refusal(
            f"has s.{path} of shapes {', '.join(str(x.shape) for x in grids)}",
            instead=CALC,
        )
    axes = []
    for k, x in enumerate(grids):
        axis = np.moveaxis(x, k, 0).reshape(x.shape[k], -1)
        if np.ptp(axis, axis=1).max() > 1e-9:
            raise Refusal(
                f"has s.{path}{{{k + 1}}} that does not change along dimension {k + 1} alone", because="as ndgrid's does",
                instead="permute its arrays, and all others, if they run as meshgrid's",
            )  # fmt: skip
        axes.append(checked_axis(f"s.{path}{{{k + 1}}}", axis[:, 0]))
    return tuple(axes)


def _check_negative(s: Mapping, A: np.ndarray) -> None:
    """Raise Refusal where Avec is not the negative of A_num, if that is there without a denominator."""
    if not _has(s, f"{CONTENT}.A_num") or _has(s, f"{CONTENT}.A_den"):
        return
    bad = (
        np.abs(_cells(s, f"{CONTENT}.A_num", A.shape[:2], A.shape[2:]) + A)
        > 1e-9 * np.abs(A).max()
    )
    if bad.any():
        i, k, *index = np.argwhere(bad)[0] + 1
        raise Refusal(
            f"is damaged: s.{CONTENT}.Avec{{{i}, {k}}} is not the negative of A_num at ({', '.join(map(str, index))})",
            instead=CALC,
        )


def _number(s: Mapping, path: str) -> float | None:
    """Return a positive number of the struct, None where it has none."""
    if not _has(s, path):
        return None
    value = np.asarray(_get(s, path))
    if value.size != 1 or value.dtype.kind not in "iuf":
        return None
    number = float(value.reshape(()))
    return number if 0 < number < 1e9 else None


def _body(s: Mapping) -> tuple[dict | None, str, float | None]:
    """Return the chain as `Stored.body` has it, the name of its frame, and its length in the file's unit; None where the file
    does not say them."""
    if not _has(s, "geometry"):
        return None, UNKNOWN_FRAME, None
    base = _get(s, "geometry.baseframe") if _has(s, "geometry.baseframe") else "center"
    named = (
        UNKNOWN_FRAME
        if not isinstance(base, str)
        else base
        if base in OURS
        else f"{base} of sysplotter"
    )
    length = _number(s, "geometry.length")
    if not _has(s, "geometry.linklengths"):
        return None, named, length
    lengths = numbers("s.geometry.linklengths", _get(s, "geometry.linklengths")).ravel()
    frame, modes = _frame(base, lengths.size), np.zeros(0)
    if _has(s, "geometry.modes"):
        modes = numbers("s.geometry.modes", _get(s, "geometry.modes"))
    body = {"lengths": lengths.tolist(), "frame": frame} | (
        {"modes": modes.T.tolist()} if modes.size else {}
    )
    return body if frame else None, frame or named, length or float(lengths.sum())


def _frame(base: Any, links: int) -> str:
    """Return our name of a base frame; its own where we have none."""
    if not isinstance(base, str):
        number = np.asarray(base)
        numbered = (
            number.size == 1
            and number.dtype.kind in "iuf"
            and number.item() in range(1, links + 1)
        )
        return f"link-{int(number.item())}" if numbered else ""
    if base in ("center", "centered") and links % 2:
        return f"link-{(links + 1) // 2}"
    return f"link-{links}" if base == "head" else FRAMES.get(base, "")


def _metric(
    s: Mapping, joints: int, length: float | None
) -> tuple[np.ndarray | None, float | None, tuple[np.ndarray, ...]]:
    """Return M on the file's own grid, the degree of its power, and the axes; of drag in our units: that of the whole body
    along itself times lengths of the body."""
    path = "metricfield.metric_eval.content.metric"
    if not _has(s, path):
        return None, None, ()
    axes = _axes(s, "grid.metric_eval")
    M = _cells(s, path, (joints, joints), tuple(map(len, axes)))
    if not np.allclose(M, M.swapaxes(0, 1), rtol=0, atol=1e-9 * np.abs(M).max()):
        i, k, *index = (
            np.argwhere(np.abs(M - M.swapaxes(0, 1)) > 1e-9 * np.abs(M).max())[0] + 1
        )
        raise Refusal(
            f"has s.{path} that is not symmetric: {{{i}, {k}}} at ({', '.join(map(str, index))})",
            instead="mend it",
        )
    if _has(s, "system_type") and _get(s, "system_type") == INERTIA:
        return M, None, axes
    drag, size = _number(s, "physics.drag_coefficient") or 1.0, length or 1.0
    return M / (drag * size**3), 2.0, axes


def _on_grid(axes: tuple, M: np.ndarray, grid: tuple, degree: int) -> Metric:
    """Return a metric on the grid of the connection, from its own; Refusal if that does not cover it."""
    if all(len(a) == len(b) and np.array_equal(a, b) for a, b in zip(axes, grid)):
        return Metric(grid, M, degree)
    shapes = np.stack(np.meshgrid(*grid, indexing="ij"), -1)
    slack = [1e-9 * np.ptp(a) for a in axes]
    if any(b[0] < a[0] - e or b[-1] > a[-1] + e for a, b, e in zip(axes, grid, slack)):
        raise Refusal(
            "has s.grid.metric_eval that does not cover s.grid.eval", instead=CALC
        )
    inside = np.clip(shapes, [a[0] for a in axes], [a[-1] for a in axes])
    values = Field(axes, M, min(3, min(map(len, axes)) - 1))(inside)
    return Metric(grid, np.moveaxis(values, (-2, -1), (0, 1)), degree)
