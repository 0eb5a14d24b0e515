"""The best point of a sweep: between the points of its grid, by finer grids around the
best one so far."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.studies.displacement.sweep import Plan, axis_name
from rft.core.refusal import Refusal

ROUNDS = 4  # of finer grids
# Points of a finer grid along a parameter, its ends and its middle among them: of one
# parameter, and of each of more.
ALONE = 7
TOGETHER = 5


def n_points(over: Mapping[str, Sequence[float]]) -> int:
    """Return the number of points of all finer grids."""
    count = ALONE if len(over) == 1 else TOGETHER
    return ROUNDS * count ** len(over)


class Best(NamedTuple):
    """The point with the largest value of a variable.

    values: of the parameters. value, error: of the variable there. low, high: by
    parameter, between which no computed value is less than the best by more than both
    of their errors. at_edge: parameters whose best value is the first or the last of
    the sweep."""

    values: dict[str, float]
    value: float
    error: float
    low: dict[str, float]
    high: dict[str, float]
    at_edge: tuple[str, ...]


def check_best(scene: Any, over: Mapping[str, Sequence[float]], name: str) -> None:
    """Refuse a variable that the sweep has not, and a grid without a point to either
    side of another."""
    has_robot = hasattr(scene, "robot")
    known = ["speed"] if has_robot else ["net_distance", "speed"]
    if name not in known:
        raise Refusal(f"``best`` must be {' or '.join(known)}", value=name)
    is_timed = any(parameter.endswith(".frequency") for parameter in over)
    if name == "speed" and not has_robot and not is_timed and scene.frequency is None:
        raise Refusal(
            "the sweep has no speed", instead="give the gait a frequency for a speed"
        )
    for parameter, values in over.items():
        if len(values) < 3:
            raise Refusal(
                f"``best`` needs three or more values of {parameter}",
                value=len(values),
            )


def find_best(
    scene: Any,
    over: Mapping[str, Sequence[float]],
    coarse: Result,
    name: str,
    progress: Callable,
) -> Best:
    """Return the best point of a sweep.

    over: values by parameter, sorted. coarse: the sweep over these. name: of the
    variable. progress: called with the fraction done."""
    grid = {key: np.sort(np.asarray(values, float)) for key, values in over.items()}
    points, values, errors = _table(coarse, over, name)
    edges = {key: (x[0], x[-1]) for key, x in grid.items()}
    count = ALONE if len(grid) == 1 else TOGETHER
    for k in range(ROUNDS):
        best = points[np.nanargmax(values)]
        finer = {}
        for j, (key, axis) in enumerate(grid.items()):
            place = int(np.argmin(np.abs(axis - best[j])))
            low = axis[max(place - 1, 0)]
            high = axis[min(place + 1, len(axis) - 1)]
            finer[key] = np.linspace(low, high, count)
        grid = finer
        lists = {key: axis.tolist() for key, axis in grid.items()}
        found = Plan(scene, lists).result(_ignored)
        more = _table(found, lists, name)
        points = np.concatenate([points, more[0]])
        values = np.concatenate([values, more[1]])
        errors = np.concatenate([errors, more[2]])
        progress((k + 1) / ROUNDS)
    return _best(list(grid), points, values, errors, edges)


def _ignored(fraction: float) -> None:
    """Take no notice of the progress of one of the grids."""


def _table(
    result: Result, over: Mapping[str, Sequence[float]], name: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points (M, d), values and errors (M,) of a sweep."""
    axes = [np.asarray(values, float) for values in over.values()]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))
    variable = result[name]
    return points, variable.values.ravel(), np.asarray(variable.error).ravel()


def _best(
    names: list[str],
    points: np.ndarray,
    values: np.ndarray,
    errors: np.ndarray,
    edges: dict[str, tuple[float, float]],
) -> Best:
    """Return the best of all points that were computed."""
    k = int(np.nanargmax(values))
    is_as_good = values + errors >= values[k] - errors[k]
    low = {}
    high = {}
    at_edge = []
    for j, name in enumerate(names):
        # Along a parameter alone, the others at their best values.
        others = np.delete(points, j, axis=1)
        aligned = (others == np.delete(points[k], j)).all(1)
        along = np.sort(points[aligned, j])
        good = set(points[aligned & is_as_good, j].tolist())
        place = int(np.searchsorted(along, points[k, j]))
        left = place
        while left > 0 and along[left] in good:
            left -= 1
        right = place
        while right < len(along) - 1 and along[right] in good:
            right += 1
        low[name] = float(along[left])
        high[name] = float(along[right])
        if points[k, j] in edges[name]:
            at_edge.append(name)
    chosen = dict(zip(names, map(float, points[k])))
    return Best(chosen, float(values[k]), float(errors[k]), low, high, tuple(at_edge))


def best_variables(best: Best, result: Result, name: str) -> list[Variable]:
    """Return the best point as variables: the parameters with half of their interval,
    and the value there with its error."""
    found = []
    for parameter, value in best.values.items():
        low, high = best.low[parameter], best.high[parameter]
        label = (
            f"{parameter} with the largest {name}, known from {low:.4g} to {high:.4g}"
        )
        if parameter in best.at_edge:
            label = f"{label}, at an end of the values given"
        error = max(high - value, value - low)
        found.append(
            Variable(f"best_{axis_name(parameter)}", (), value, "", label, error)
        )
    variable = result[name]
    found.append(
        Variable(
            f"best_{name}",
            (),
            best.value,
            variable.unit,
            f"largest {name} between the points of the sweep",
            best.error,
        )
    )
    return found
