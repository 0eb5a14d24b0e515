"""A grid over parameters of a scene: its points, and the scene at each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from geomech.mathematics.systems.swimmer import Swimmer
from geomech.scenes.model import Scene
from geomech.scenes.read import from_tables
from geomech.scenes.swimming import with_medium
from rft.core.checks import real_array
from rft.core.refusal import Refusal

MAX_POINTS = 100_000_000
# Values of a parameter for each of which a scene is built as a test, in some 0.5 ms.
MAX_TESTED_VALUES = 200
MEDIUM = "medium."  # first letters of its parameters
MOST_KNOWN = 64  # scenes of a grid that are kept to read other media into
SECTIONS = (
    "medium",
    "body",
    "contact",
    "gait",
    "numerics",
    "system",
    "physical",
    "robot",
)


@dataclass(frozen=True)
class Grid:
    """Values of some parameters of a scene, and the tables of its file.

    inner: name of the parameter whose values make up a batch, "" for none: it varies
    fastest, and no scene is read for it. idle: parameters that change no row; all
    points have their first value."""

    scene: Any
    over: Mapping[str, list[float]]
    tables: Mapping[str, Any]
    inner: str = ""
    idle: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the parameters, the inner one last."""
        names = self._outer_names
        if self.inner in self.over:
            names.append(self.inner)
        return names

    @property
    def _outer_names(self) -> list[str]:
        return [name for name in self.over if name != self.inner]

    @property
    def values(self) -> dict[str, list[float]]:
        """Values by parameter, the inner one last."""
        return {name: self.over[name] for name in self.names}

    @property
    def inner_values(self) -> list[float] | None:
        """Values of the inner parameter; None if the grid has none."""
        return self.over.get(self.inner)

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(map(len, self.over.values()))

    @property
    def n_scenes(self) -> int:
        """Number of points that differ in more than their medium."""
        outer = zip(self._outer_names, self.points.sizes)
        return math.prod(size for name, size in outer if not _is_of_medium(name))

    @property
    def total(self) -> int:
        """Number of rows to compute."""
        return self.points.total * len(self.inner_values or [0])

    @cached_property
    def points(self) -> Points:
        """Points of the parameters other than the inner one."""
        axes = []
        for name in self._outer_names:
            values = self.over[name]
            axes.append(values[:1] if name in self.idle else values)
        return Points(axes)

    @cached_property
    def scene_factory(self) -> SceneFactory:
        """Function that builds the scene at a point."""
        return SceneFactory(dict(self.tables), self.scene, tuple(self.names))

    def corners(self) -> Iterator[tuple[float, ...]]:
        """Yield the points that are tested before a sweep starts: the corners, and the
        values of each parameter with the others at their first."""
        outer = [self.over[name] for name in self._outer_names]
        yield from itertools.product(*([values[0], values[-1]] for values in outer))
        for k, values in enumerate(outer):
            point = [other[0] for other in outer]
            for value in _tested_values(values):
                point[k] = value
                yield tuple(point)

    def arranged(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (`total`, width) as an array (N_1, ..., width) over the
        parameters in the order given."""
        names = self.names
        width = np.shape(rows)[-1]
        computed = [1 if name in self.idle else len(self.over[name]) for name in names]
        full = [len(self.over[name]) for name in names]
        on_grid = np.broadcast_to(np.reshape(rows, (*computed, -1)), (*full, width))
        order = [names.index(name) for name in self.over]
        return np.transpose(on_grid, (*order, len(names)))


def _tested_values(values: list[float]) -> list[float]:
    """Return the values of a parameter, or of many the least, the largest and some."""
    if len(values) <= MAX_TESTED_VALUES:
        return values
    step = -(-len(values) // MAX_TESTED_VALUES)
    return [min(values), max(values), *values[::step]]


def checked_grid_values(over: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return the values by parameter as lists; Refusal unless they form a grid."""
    if not (isinstance(over, Mapping) and all(isinstance(name, str) for name in over)):
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


@dataclass(frozen=True)
class SceneFactory:
    """Function from a point of a grid, values by ``names``, to the scene there.

    known: scenes that were read, under their values other than those of the medium. At
    a point that differs from one of them in its medium alone, only that is read."""

    tables: dict[str, Any]
    scene: Any
    names: tuple[str, ...]
    known: dict[tuple, Any] = field(default_factory=dict, compare=False, repr=False)

    def __reduce__(self) -> tuple:
        return SceneFactory, (self.tables, self.scene, self.names)

    def __call__(self, point: tuple[float, ...]) -> Any:
        medium = self.tables.get("medium", {})
        others = []
        for name, value in zip(self.names, point):
            if _is_of_medium(name):
                medium = _with_key(medium, name.removeprefix(MEDIUM), value)
            else:
                others.append(value)
        known = self.known.get(tuple(others))
        if known is not None:
            return with_medium(known, medium)

        tables = self.tables
        for name, value in zip(self.names, point):
            tables = with_parameter(tables, name, value)
        scene = from_tables(tables, self.scene.name, self.scene.text)
        if self._has_separate_medium(scene):
            if len(self.known) == MOST_KNOWN:
                self.known.clear()
            self.known[tuple(others)] = scene
        return scene

    def _has_separate_medium(self, scene: Any) -> bool:
        """Return whether the table [medium] describes no part of a scene but its
        medium."""
        has_swimmer = isinstance(scene, Scene) and type(scene.system) is Swimmer
        return has_swimmer and "medium" not in self.tables.get("system", {})


def _is_of_medium(name: str) -> bool:
    """Return whether a parameter is a key of [medium]."""
    return name.startswith(MEDIUM)


class Points:
    """Points of a grid, the last parameter varying fastest. None is stored, as there
    may be millions."""

    def __init__(self, axes: list[list[float]]):
        self.axes = axes
        self.sizes = tuple(map(len, axes))
        self.total = math.prod(self.sizes)

    def __getitem__(self, k: int) -> tuple[float, ...]:
        if not self.axes:
            return ()
        indices = np.unravel_index(k, self.sizes)
        return tuple(axis[i] for axis, i in zip(self.axes, indices))


def with_parameter(tables: dict, parameter: str, value: float) -> dict:
    """Return the tables of a scene with one parameter set.

    parameter: "section.key", "robot.table.key" for a table inside [robot],
    "effects.KIND.key" for an effect of the scene, or "effects.key" for all its effects
    that give that key."""
    section, *keys = parameter.split(".")
    if section == "effects" and len(keys) in (1, 2):
        return {**tables, "effects": _with_effect_key(tables, parameter, value)}

    if section in SECTIONS and len(keys) == 1:
        return {**tables, section: _with_key(tables.get(section, {}), keys[0], value)}

    if section == "robot" and len(keys) == 2:
        robot = tables.get("robot", {})
        within = robot.get(keys[0])
        if isinstance(within, dict):
            within = _with_key(within, keys[1], value)
            return {**tables, "robot": {**robot, keys[0]: within}}

    raise Refusal(
        "use a parameter such as gait.amplitude, medium.C or effects.end-caps.radius",
        where=f"``over`` {parameter}",
    )


def _with_key(section: Mapping, key: str, value: float) -> dict:
    """Return a section with one key set, and without the same key in another unit. A
    whole number stays one."""
    old = section.get(key)
    is_whole = isinstance(old, int) and not isinstance(old, bool)
    if is_whole and value == int(value):
        value = int(value)
    other = _key_in_other_unit(key)
    return {**{k: v for k, v in section.items() if k != other}, key: value}


def _with_effect_key(tables: Mapping, parameter: str, value: float) -> list[dict]:
    """Return the effects of a scene with a key set: of one kind, or of all that give
    it."""
    *kinds, key = parameter.split(".")[1:]
    effects = tables.get("effects", [])
    if kinds:
        are_meant = [effect.get("kind") == kinds[0] for effect in effects]
    else:
        spellings = {key, _key_in_other_unit(key)}
        are_meant = [bool(spellings & {*effect}) for effect in effects]

    if not any(are_meant):
        if kinds:
            raise Refusal(
                f"the scene has no effect {kinds[0]!r}",
                where=f"``over`` {parameter}",
                instead="add it as [[effects]]",
            )
        raise Refusal(
            f"no effect of the scene gives {key!r}",
            where=f"``over`` {parameter}",
            instead="use an effect of the scene, or add one",
        )
    return [
        _with_key(effect, key, value) if is_meant else effect
        for effect, is_meant in zip(effects, are_meant)
    ]


def _key_in_other_unit(key: str) -> str:
    """Return the name of the same key in degrees, or in rad."""
    if key.endswith("_deg"):
        return key.removesuffix("_deg")
    return f"{key}_deg"


def values_at_points(
    over: Mapping[str, list[float]], names: tuple[str, ...], value: float | None
) -> Any:
    """Return a number (N_1, ...) at the points of a sweep; None if it is unknown.

    names: sections that may have it, and last its key. It is that of the swept
    parameter with such a name, else ``value``."""
    key = names[-1]
    shape = [len(values) for values in over.values()]
    for axis, (parameter, values) in enumerate(over.items()):
        section = parameter.partition(".")[0]
        if section in names and parameter.rpartition(".")[2] == key:
            along = [1] * len(shape)
            along[axis] = -1
            return np.broadcast_to(np.reshape(values, along), shape).copy()
    if value is None:
        return None
    return np.full(shape, float(value))
