"""Variables over shape space as the objects that pictures take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.io.tables.base import PERIOD
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.periods import Periods, checked_periods
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.stretch import Stretch


@dataclass(frozen=True, eq=False)
class Slice:
    """A plane of shape space as a result has it
    (`geomech.mathematics.geometry.representations.plane.Plane`)."""

    pair: tuple[int, int]
    at: tuple[float, ...]
    ccf: Field | None = None
    error: Field | None = None
    connection: Connection | None = None

    @property
    def fixed(self) -> list[int]:
        """The joints that do not move, counted from 1."""
        return [k for k in range(1, len(self.at) + 1) if k not in self.pair]


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed curve in shape space as a result has it, to be drawn.

    points: (N, joints), rad. label: for a legend. line, colour: its style."""

    points: np.ndarray
    label: str
    line: str = "-"
    colour: str = "black"

    def shape(self, t: np.ndarray) -> np.ndarray:
        """Return shapes (T, joints) at phases t (T,), rad, on straight lines between
        the points."""
        closed = np.concatenate([self.points, self.points[:1]])
        phases = np.linspace(0.0, 2 * np.pi, len(closed))
        columns = [np.interp(t, phases, column) for column in closed.T]
        return np.stack(columns, -1)


def _columns(result: Result, names: Sequence[str]) -> np.ndarray:
    """Return variables (N,) as the columns of an array."""
    return np.stack([result[name].values for name in names], -1)


def loops_of(result: Result, gait: Any) -> list:
    """Return what is drawn of a gait: the gait itself, or, where joints give way, the
    loop that the shape makes and, dashed, the command."""
    names = [name for name in result if name.startswith("loop_alpha")]
    names = names or [name for name in result if name.startswith("command_alpha")]
    if not names:
        return [gait]
    if names[0].startswith("loop"):
        points = _columns(result, names)
        commands = [name.replace("loop_", "loop_command_") for name in names]
        command = _columns(result, commands)
    else:
        is_first = result["phase"].values < 2 * np.pi - 1e-9
        command = _columns(result, names)[is_first]
        own = [name.removeprefix("command_") for name in names]
        points = _columns(result, own)[is_first]
    return [Loop(points, "shape"), Loop(command, "command", "--", "0.35")]


def length_unit(variable: Variable) -> str:
    """Return the unit of lengths in the unit of a variable over components."""
    return variable.unit[0].partition("/")[0]


def axes_of(result: Result, dims: Sequence[str]) -> tuple[np.ndarray, ...]:
    return tuple(result[dim].values for dim in dims)


def periods_of(result: Result, dims: Sequence[str]) -> Periods:
    """Return the periods of axes, () where none has one."""
    periods = []
    for dim in dims:
        name = f"{PERIOD}{dim}"
        periods.append(float(result[name]) if name in result else None)
    return checked_periods(tuple(periods), len(periods))


def degree_of(result: Result) -> int:
    """Return the degree of the splines through the fields of a result."""
    return int(result.attributes["interpolation"])


def field_of(result: Result, name: str) -> tuple[Field, Field | None]:
    """Return a variable over components and shape space as a field, and its error."""
    variable = result[name]
    axes = axes_of(result, variable.dims[1:])
    degree = degree_of(result)
    unit = length_unit(variable)
    periods = periods_of(result, variable.dims[1:])

    def field(values: np.ndarray) -> Field:
        return Field(axes, values, degree, unit=unit, periods=periods)

    error = None
    if variable.error is not None:
        error = field(variable.error)
    return field(variable.values), error


def connection_of(result: Result, name: str = "A") -> Connection:
    """Return a variable over components, joints and shape space as a connection; its
    residual is nan."""
    variable = result[name]
    axes = axes_of(result, variable.dims[2:])
    unknown = np.full_like(variable.values[:, 0], np.nan)
    degree = degree_of(result)
    unit = length_unit(variable)
    periods = periods_of(result, variable.dims[2:])
    return Connection(
        axes, variable.values, unknown, unknown, degree, unit=unit, periods=periods
    )


def metric_of(result: Result) -> Metric | Finsler:
    """Return the metric of a result."""
    degree = degree_of(result)
    if "metric" in result:
        metric = result["metric"]
        axes = axes_of(result, metric.dims[2:])
        periods = periods_of(result, metric.dims[2:])
        return Metric(axes, metric.values, degree, periods=periods)
    norm = result["norm"]
    axes = axes_of(result, norm.dims[1:])
    residual = result["norm_residual"].values
    periods = periods_of(result, norm.dims[1:])
    return Finsler(axes, norm.values, residual, degree, periods=periods)


def slices_of(result: Result, name: str) -> list[Slice]:
    """Return the planes of variables such as ccf_1_3, or A_1_3 for connections."""
    found = []
    for ending, pair in pairs_of(result, name):
        at = tuple(result[f"slice{ending}"].values.tolist())
        parts: dict[str, Any] = {}
        if name == "A":
            parts["connection"] = connection_of(result, f"A{ending}")
        else:
            parts["ccf"], parts["error"] = field_of(result, f"{name}{ending}")
        found.append(Slice(pair, at, **parts))
    return found


def pairs_of(result: Result, name: str) -> list[tuple[str, tuple[int, int]]]:
    """Return the endings of names such as ccf_1_3, and their joints, counted
    from 1."""
    found = []
    for other in result:
        if not other.startswith(name):
            continue
        ending = other.removeprefix(name)
        numbers = ending.split("_")[1:]
        if len(numbers) == 2 and all(map(str.isdigit, numbers)):
            i, j = map(int, numbers)
            found.append((ending, (i, j)))
    return found


def stretch_of(result: Result) -> Stretch:
    """Return the stretched shape space of a result
    (`geomech.studies.maps.fields.stretch_variables`)."""
    shape = result["stretched_shape"]
    degree = int(result["stretch_interpolation"].values)
    return Stretch(
        Field(axes_of(result, shape.dims[1:]), shape.values, degree),
        result["stretch_distortion"].values,
        float(result["stretch_rms"]),
        float(result["stretch_largest"]),
        float(result["stretch_folded"]),
    )
