"""The struct `s` that sysplotter's `sys_calcsystem` saves: a system on a grid, and what
sysplotter computed of it.

Source: https://github.com/OSU-LRAM/GeometricSystemPlotter (MIT),
ProgramFiles/sys_calcsystem.m and its functions. There

    s.grid.eval{k}                             alpha_k on the grid, as of ndgrid
    s.vecfield.eval.content.Avec{i, k}         A of xi = + A alphadot, the negative of
                                               A_num; rows x, y, theta
    s.vecfield.eval.content.Avec_optimized     A in minimum-perturbation coordinates
    s.B_optimized.eval.Beta{i}                 pose of that frame in the first
    s.DA{i, pair}, s.DA_optimized{i, pair}     CCF, positive for counter-clockwise
                                               loops: dA - lb, so lb = -[A, A]
    s.metricfield.metric_eval.content.metric   M, on s.grid.metric_eval
    s.geometry                                 linklengths, length of the whole body,
                                               modes, baseframe

The derivatives in its CCF are differences of neighbours, of order 2, and one-sided at
the edge. Its minimum-perturbation coordinates solve the same equations as
`geomech.mathematics.geometry.minimum_perturbation`, in linear elements.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geomech.io.tables.base import (
    MINIMUM_PERTURBATION,
    UNKNOWN_FRAME,
    Stored,
    checked_axis,
    checked_numbers,
    rms,
)
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.metric import Metric
from geomech.mathematics.geometry.minimum_perturbation import minimum_perturbation
from geomech.mathematics.geometry.representations.field import Field
from rft.core.refusal import Refusal

CALC = "save it with sys_calcsystem, in a file whose name ends in _calc.mat"
CONTENT = "vecfield.eval.content"
DRAG = "drag"  # a value of s.system_type
INERTIA = "inertia"  # another one
RESIDUAL = "geomech_fit_residual"  # a field of our own: rms of xi - A alphadot
OUR_FRAMES = (MINIMUM_PERTURBATION, UNKNOWN_FRAME)  # which sysplotter does not have
FRAMES = {  # our names of its base frames, for any number of links
    "com-mean": "mean",
    "tail": "link-1",
}


@dataclass(frozen=True, eq=False)
class Computed:
    """What sysplotter computed of a connection (3, d, N_1, ...), in body lengths and
    rad; None where the file does not have it.

    A_optimised: A in its minimum-perturbation coordinates. beta: (3, N_1, ...), pose of
    their frame in the first. ccf, ccf_optimised: (3, pairs, N_1, ...). metric: M (d, d,
    ...) on the grid ``metric_axes``.
    """

    A_optimised: np.ndarray | None = None
    beta: np.ndarray | None = None
    ccf: np.ndarray | None = None
    ccf_optimised: np.ndarray | None = None
    metric_axes: tuple[np.ndarray, ...] = ()
    metric: np.ndarray | None = None


def compared(stored: Stored) -> dict[str, float]:
    """Return the largest differences, by name, between values that sysplotter computed
    and ours from the same A, in the middle half of the grid. They are relative to the
    largest value of each component."""
    c = stored.connection
    theirs = stored.computed
    frame = minimum_perturbation(c)
    optimised = replace(c, A=frame.connection(c))
    pairs = {
        "CCF of joints 1 and 2": (ccf(c).values, theirs.ccf),
        "minimum-perturbation frame": (frame.field.values, theirs.beta),
        "CCF in that frame": (ccf(optimised).values, theirs.ccf_optimised),
    }
    middle = tuple(slice(len(a) // 4, -(len(a) // 4) or None) for a in c.axes)
    differences = {}
    for name, (values, other) in pairs.items():
        if other is None:
            continue
        if other.ndim > values.ndim:  # a CCF, of which the first pair is compared
            other = other[:, 0]
        largest = np.abs(values).reshape(3, -1).max(1)
        # A component that is zero everywhere counts as equal.
        scale = np.where(largest > 1e-9, largest, np.inf).reshape(3, *[1] * len(c.axes))
        relative = np.abs(values - other) / scale
        differences[name] = float(relative[(..., *middle)].max())
    return differences


def parse(s: Mapping, sign: str, order: str, sha256: str) -> Stored:
    """Return the system of a struct s. Refusal, whose words follow the file's name, if
    it has none."""
    if sign not in ("", "+") or order not in ("", "ndgrid"):
        raise Refusal(
            "has a struct s, which defines sign and order itself",
            instead="leave sign and order out",
        )
    axes = _axes(s, "grid.eval")
    shape = tuple(map(len, axes))
    d = len(axes)
    pairs = d * (d - 1) // 2
    A = _cells(s, f"{CONTENT}.Avec", (3, d), shape)
    _check_negative(s, A)
    body, frame, length = _body(s)

    # Lengths are divided by the body's, which becomes 1 BL; without one they stay.
    by_row = np.ones(3)
    if length is not None:
        by_row[:2] = 1 / length

    def in_lengths(values):
        return values * by_row.reshape(3, *[1] * (values.ndim - 1))

    def optional(path, lead):
        return in_lengths(_cells(s, path, lead, shape)) if _has(s, path) else None

    metric, power_degree, metric_axes = _metric(s, d, length)
    computed = Computed(
        A_optimised=optional(f"{CONTENT}.Avec_optimized", (3, d)),
        beta=optional("B_optimized.eval.Beta", (3,)),
        ccf=optional("DA", (3, pairs)),
        ccf_optimised=optional("DA_optimized", (3, pairs)),
        metric_axes=metric_axes,
        metric=metric,
    )
    A = in_lengths(A)
    residual = optional(RESIDUAL, (3,))
    if residual is None:
        residual = np.full((3, *shape), np.nan)
    degree = min(3, min(shape) - 1)
    size = {} if length is None else {"unit": "BL", "length": 1.0}
    speed = rms(A, np.nan_to_num(residual))
    connection = Connection(axes, A, residual, speed, degree, **size)
    metric_on_grid = None
    if metric is not None:
        metric_on_grid = _on_grid(metric_axes, metric, axes, degree)
    return Stored(
        connection,
        frame=frame,
        sha256=sha256,
        shapes=tuple(f"alpha_{k + 1}" for k in range(d)),
        metric=metric_on_grid,
        power_degree=power_degree,
        sized=length is not None,
        body=body,
        computed=computed,
    )


# Fields of the struct.


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
    cell = _get(s, path)
    count = int(np.prod(lead))
    if not isinstance(cell, np.ndarray) or cell.dtype != object or cell.size != count:
        raise Refusal(
            f"has s.{path} that is not a cell of {' x '.join(map(str, lead))} arrays",
            instead=CALC,
        )
    out = np.empty((count, *shape))
    for k, values in enumerate(cell.reshape(count)):
        index = _matlab_index(np.unravel_index(k, lead))
        place = f"s.{path}{{{index}}}"
        values = _checked_numbers(place, np.nan if values is None else values)
        if values.shape != shape:
            raise Refusal(
                f"has {place} of shape {values.shape} where its grid requires {shape}",
                instead=CALC,
            )
        out[k] = values
    return out.reshape(*lead, *shape)


def _matlab_index(index: Iterable[int]) -> str:
    """Return an index as MATLAB counts, from 1."""
    return ", ".join(str(k + 1) for k in index)


def _checked_numbers(place: str, values: Any) -> np.ndarray:
    """Return `checked_numbers`; a Refusal of one that is not finite has its place as
    MATLAB counts."""
    kind = getattr(values, "dtype", np.dtype(object)).kind
    if kind == "f" and not np.isfinite(values).all():
        index = _matlab_index(np.argwhere(~np.isfinite(values))[0])
        raise Refusal(
            f"has {place} that is not finite (nan or inf) at ({index})",
            instead="correct the file",
        )
    return checked_numbers(place, values)


def _number(s: Mapping, path: str) -> float | None:
    """Return a positive number of the struct, None where it has none."""
    if not _has(s, path):
        return None
    value = np.asarray(_get(s, path))
    if value.size != 1 or value.dtype.kind not in "iuf":
        return None
    number = float(value.reshape(()))
    return number if 0 < number < 1e9 else None


def _axes(s: Mapping, path: str) -> tuple[np.ndarray, ...]:
    """Return the axes of a grid, rad; Refusal unless its arrays run as ndgrid's."""
    cell = _get(s, path)
    if not isinstance(cell, np.ndarray) or cell.dtype != object or cell.size < 2:
        raise Refusal(
            f"has s.{path} that is not a cell of grids of two or more angles",
            instead=CALC,
        )
    grids = [
        _checked_numbers(f"s.{path}{{{k + 1}}}", x) for k, x in enumerate(cell.ravel())
    ]
    if any(x.ndim != len(grids) or x.shape != grids[0].shape for x in grids):
        shapes = ", ".join(str(x.shape) for x in grids)
        raise Refusal(f"has s.{path} of different shapes, {shapes}", instead=CALC)
    axes = []
    for k, x in enumerate(grids):
        place = f"s.{path}{{{k + 1}}}"
        axis = np.moveaxis(x, k, 0).reshape(x.shape[k], -1)
        if np.ptp(axis, axis=1).max() > 1e-9:
            raise Refusal(
                f"has {place} that varies along other dimensions than dimension "
                f"{k + 1}",
                because="only that dimension may vary, as with ndgrid",
                instead=(
                    "permute its arrays and all others if they are ordered as by "
                    "meshgrid"
                ),
            )
        axes.append(checked_axis(place, axis[:, 0]))
    return tuple(axes)


def _check_negative(s: Mapping, A: np.ndarray) -> None:
    """Raise Refusal where Avec is not the negative of A_num, if the file has A_num
    without a denominator A_den."""
    path = f"{CONTENT}.A_num"
    if not _has(s, path) or _has(s, f"{CONTENT}.A_den"):
        return
    numerator = _cells(s, path, A.shape[:2], A.shape[2:])
    is_bad = np.abs(numerator + A) > 1e-9 * np.abs(A).max()
    if is_bad.any():
        i, k, *index = np.argwhere(is_bad)[0]
        raise Refusal(
            f"is damaged: s.{CONTENT}.Avec{{{_matlab_index((i, k))}}} is not the "
            f"negative of A_num at ({_matlab_index(index)})",
            instead=CALC,
        )


def _body(s: Mapping) -> tuple[dict | None, str, float | None]:
    """Return the chain as `Stored.body` has it, the name of its frame, and its length
    in the file's unit; chain and length are None where the file does not state them."""
    if not _has(s, "geometry"):
        return None, UNKNOWN_FRAME, None
    base: Any = "center"
    if _has(s, "geometry.baseframe"):
        base = _get(s, "geometry.baseframe")
    length = _number(s, "geometry.length")
    if not _has(s, "geometry.linklengths"):
        return None, _frame_in_words(base), length
    lengths = checked_numbers(
        "s.geometry.linklengths", _get(s, "geometry.linklengths")
    ).ravel()
    length = length or float(lengths.sum())
    modes = np.zeros(0)
    if _has(s, "geometry.modes"):
        modes = checked_numbers("s.geometry.modes", _get(s, "geometry.modes"))
    frame = _frame(base, lengths.size)
    if not frame:
        return None, _frame_in_words(base), length
    body = {"lengths": lengths.tolist(), "frame": frame}
    if modes.size:
        body["modes"] = modes.T.tolist()
    return body, frame, length


def _frame_in_words(base: Any) -> str:
    """Return the name of a base frame that is no frame of a chain of ours."""
    if not isinstance(base, str):
        return UNKNOWN_FRAME
    if base in OUR_FRAMES:
        return base
    return f"{base} of sysplotter"


def _frame(base: Any, links: int) -> str:
    """Return our name of a base frame of a chain, by its name or the number of a link;
    "" where we have none."""
    if isinstance(base, str):
        if base in ("center", "centered") and links % 2:
            return f"link-{(links + 1) // 2}"
        if base == "head":
            return f"link-{links}"
        return FRAMES.get(base, "")
    number = np.asarray(base)
    if number.size != 1 or number.dtype.kind not in "iuf":
        return ""
    if number.item() not in range(1, links + 1):
        return ""
    return f"link-{int(number.item())}"


def _metric(
    s: Mapping, joints: int, length: float | None
) -> tuple[np.ndarray | None, float | None, tuple[np.ndarray, ...]]:
    """Return M (d, d, ...), the degree of its power, and the axes of its grid; None,
    None and () for a file without M.

    M of drag is returned in our units: the drag of the whole body along itself, times
    lengths of the body. M of inertia has no power."""
    path = "metricfield.metric_eval.content.metric"
    if not _has(s, path):
        return None, None, ()
    axes = _axes(s, "grid.metric_eval")
    M = _cells(s, path, (joints, joints), tuple(map(len, axes)))
    asymmetry = np.abs(M - M.swapaxes(0, 1))
    is_bad = asymmetry > 1e-9 * np.abs(M).max()
    if is_bad.any():
        i, k, *index = np.argwhere(is_bad)[0]
        raise Refusal(
            f"has s.{path} that is not symmetric: {{{_matlab_index((i, k))}}} at "
            f"({_matlab_index(index)})",
            instead="correct the file",
        )
    if _has(s, "system_type") and _get(s, "system_type") == INERTIA:
        return M, None, axes
    drag = _number(s, "physics.drag_coefficient") or 1.0
    size = length or 1.0
    return M / (drag * size**3), 2.0, axes


def _on_grid(axes: tuple, M: np.ndarray, grid: tuple, degree: int) -> Metric:
    """Return a metric, known on ``axes``, on the grid of the connection; Refusal if its
    axes do not cover that grid."""
    if all(len(a) == len(b) and np.array_equal(a, b) for a, b in zip(axes, grid)):
        return Metric(grid, M, degree)
    for a, b in zip(axes, grid):
        rounding = 1e-9 * np.ptp(a)
        if b[0] < a[0] - rounding or b[-1] > a[-1] + rounding:
            raise Refusal(
                "has s.grid.metric_eval that does not cover s.grid.eval", instead=CALC
            )
    shapes = np.stack(np.meshgrid(*grid, indexing="ij"), -1)
    inside = np.clip(shapes, [a[0] for a in axes], [a[-1] for a in axes])
    values = Field(axes, M, min(3, min(map(len, axes)) - 1))(inside)
    return Metric(grid, np.moveaxis(values, (-2, -1), (0, 1)), degree)
