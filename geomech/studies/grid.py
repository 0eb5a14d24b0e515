"""A grid over parameters of a scene: its points, and the scene at each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from geomech.scenes.read import from_tables
from rft.core.checks import real_array
from rft.core.refusal import Refusal

MAX_POINTS = 100_000_000  # points
MAX_TESTED_VALUES = (
    200  # values of a parameter for which a scene is built as a test, some 0.5 ms each
)


@dataclass(frozen=True)
class Grid:
    """Values of some parameters of a scene, and the tables of its file.

    inner: the parameter, or "", whose values make up a batch: it varies fastest, and no scene is read for it. idle:
    parameters that change no row; all points have their first value."""

    scene: Any
    over: Mapping[str, list[float]]
    tables: Mapping[str, Any]
    inner: str = ""
    idle: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the parameters, the inner one last."""
        return [k for k in self.over if k != self.inner] + [
            k for k in self.over if k == self.inner
        ]

    @property
    def values(self) -> dict[str, list[float]]:
        return {name: self.over[name] for name in self.names}

    @property
    def inner_values(self) -> list[float] | None:
        """Values of the inner parameter, if it is one of the grid's."""
        return self.over.get(self.inner)

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(map(len, self.over.values()))

    @property
    def total(self) -> int:
        """Number of rows to compute."""
        return self.points.total * len(self.inner_values or [0])

    @cached_property
    def points(self) -> Points:
        """Points of the parameters other than the inner one."""
        outer = [name for name in self.names if name != self.inner]
        return Points(
            [
                self.over[name][:1] if name in self.idle else self.over[name]
                for name in outer
            ]
        )

    @cached_property
    def scene_factory(self) -> SceneFactory:
        return SceneFactory(dict(self.tables), self.scene, tuple(self.names))

    def corners(self) -> Iterator[tuple[float, ...]]:
        """Yield the corners, and the values of each parameter with the others at their
        first: all, or of more than `MAX_TESTED_VALUES` some, with the least and the
        largest."""
        outer = [self.over[name] for name in self.names if name != self.inner]
        yield from itertools.product(*([v[0], v[-1]] for v in outer))
        for k, values in enumerate(outer):
            tested = (
                values
                if len(values) <= MAX_TESTED_VALUES
                else [
                    min(values),
                    max(values),
                    *values[:: -(-len(values) // MAX_TESTED_VALUES)],
                ]
            )
            yield from (
                (*(v[0] for v in outer[:k]), x, *(v[0] for v in outer[k + 1 :]))
                for x in tested
            )

    def arranged(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (`total`, width) as an array (N_1, ..., width) over the parameters in the order given."""
        names = self.names
        computed = [1 if name in self.idle else len(self.over[name]) for name in names]
        full = [len(self.over[name]) for name in names]
        flat = np.broadcast_to(
            np.reshape(rows, (*computed, -1)), (*full, np.shape(rows)[-1])
        )
        return np.transpose(flat, (*(names.index(k) for k in self.over), len(names)))


def checked_grid_values(over: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return the values by parameter; Refusal unless they form a grid."""
    if not (isinstance(over, Mapping) and all(isinstance(k, str) for k in over)):
        raise Refusal(
            "over must be values by parameter, such as {'gait.amplitude': [0.5, 1.0]}",
            value=over,
        )
    values = {name: _checked_list(name, x) for name, x in over.items()}
    total = math.prod(map(len, values.values())) if values else 0
    if not 0 < total <= MAX_POINTS:
        raise Refusal(f"``over`` must span 1 to {MAX_POINTS:,} points, got {total:,}")
    return values


def _checked_list(name: str, values: Any) -> list[float]:
    array = real_array(name, values)
    if array.ndim != 1 or not np.isfinite(array).all():
        raise Refusal(
            "values must be a list of finite numbers",
            value=values,
            where=f"``over`` {name}",
        )
    return array.tolist()


class SceneFactory(NamedTuple):
    """The scene at a point of a grid."""

    tables: dict[str, Any]
    scene: Any
    names: tuple[str, ...]

    def __call__(self, point: tuple[float, ...]) -> Any:
        tables = self.tables
        for name, value in zip(self.names, point):
            tables = with_parameter(tables, name, value)
        return from_tables(tables, self.scene.name, self.scene.text)


class Points:
    """Points of a grid, the last parameter varying fastest. None is stored, as there may be millions."""

    def __init__(self, axes: list[list[float]]):
        self.axes, self.sizes = axes, tuple(map(len, axes))
        self.total = math.prod(self.sizes)

    def __getitem__(self, k: int) -> tuple[float, ...]:
        return (
            tuple(
                axis[i] for axis, i in zip(self.axes, np.unravel_index(k, self.sizes))
            )
            if self.axes
            else ()
        )


def with_parameter(tables: dict, parameter: str, value: float) -> dict:
    """Return the tables with one parameter set: "section.key", "effects.KIND.key" for an effect that is on, or
    "effects.key" for all effects that give that key."""
    parts = parameter.split(".")
    within = (
        tables.get("robot", {}).get(parts[1])
        if len(parts) == 3 and parts[0] == "robot"
        else None
    )
    if isinstance(within, dict):  # a table inside a table
        inner = with_parameter({"robot": within}, f"robot.{parts[2]}", value)
        return {**tables, "robot": {**tables["robot"], parts[1]: inner["robot"]}}
    if len(parts) == 2 and parts[0] in (
        "medium",
        "body",
        "gait",
        "numerics",
        "system",
        "physical",
        "robot",
    ):
        old = tables.get(parts[0], {}).get(parts[1])
        tables = {
            **tables,
            parts[0]: {
                k: v
                for k, v in tables.get(parts[0], {}).items()
                if k != _key_in_other_unit(parts[1])
            },
        }
        value = (
            int(value)
            if isinstance(old, int)
            and not isinstance(old, bool)
            and value == int(value)
            else value
        )
        return {**tables, parts[0]: {**tables.get(parts[0], {}), parts[1]: value}}
    if len(parts) == 2 and parts[0] == "effects":
        effects = tables.get("effects", [])
        if any(parts[1] in e for e in effects):
            return {
                **tables,
                "effects": [
                    {**e, parts[1]: value} if parts[1] in e else e for e in effects
                ],
            }
        raise Refusal(
            f"no effect of the scene gives {parts[1]!r}",
            where=f"``over`` {parameter}",
            instead="name the effect, or add it",
        )
    if len(parts) == 3 and parts[0] == "effects":
        effects = tables.get("effects", [])
        if any(e.get("kind") == parts[1] for e in effects):
            return {
                **tables,
                "effects": [
                    {**e, parts[2]: value} if e["kind"] == parts[1] else e
                    for e in effects
                ],
            }
        raise Refusal(
            f"the scene has no effect {parts[1]!r}",
            where=f"``over`` {parameter}",
            instead="add it as [[effects]]",
        )
    raise Refusal(
        "name a parameter such as gait.amplitude, medium.C or effects.end-caps.radius",
        where=f"``over`` {parameter}",
    )


def _key_in_other_unit(key: str) -> str:
    """Return the name of the same key in degrees, or in rad."""
    return key.removesuffix("_deg") if key.endswith("_deg") else f"{key}_deg"


def values_at_points(over: Mapping[str, list[float]], names: tuple[str, ...], value):
    """Return a number (N_1, ...) at the points of a sweep: the swept parameter with one of these names, else ``value``,
    or None."""
    for axis, (name, values) in enumerate(over.items()):
        if name.partition(".")[0] in names and name.rpartition(".")[2] == names[-1]:
            along = np.reshape(
                values, [-1 if k == axis else 1 for k in range(len(over))]
            )
            return np.broadcast_to(along, [len(v) for v in over.values()]).copy()
    return (
        None
        if value is None
        else np.full([len(v) for v in over.values()], float(value))
    )
