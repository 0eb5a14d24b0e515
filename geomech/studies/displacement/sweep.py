"""Sweeps: a question over a grid of the scene's own parameters, in batches of points
that are stored one after the other."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.runs.cost import Cost
from geomech.runs.runner import digest_context, runner, store_results
from geomech.scenes.read import inputs
from geomech.studies.grid import Grid, checked_grid_values
from rft.core.refusal import Refusal


class BatchedQuestion(Protocol):
    """A question about many scenes at once, as sweeps have.

    It builds the scenes and solves a batch of them. The sweep has the grid, the order
    and the runner."""

    def grid(self, scene: Any, over: Mapping[str, list[float]]) -> Grid:
        """Return the grid of these parameters; Refusal if a point of it makes no
        scene."""

    def cost(self, grid: Grid) -> Cost:
        """Return the cost of all points."""

    def batch_size(self, scene: Any) -> int:
        """Return the number of rows of such scenes in a batch."""

    def rows(self, scenes: list, inner_values: list[float] | None) -> np.ndarray:
        """Return the numbers (N, width) of every scene, for each value of the inner
        parameter or the scene's own."""

    def variables(
        self, grid: Grid, rows: np.ndarray, dims: tuple[str, ...]
    ) -> tuple[list[Variable], dict]:
        """Return the answer from rows (N_1, ..., width) as variables, and attributes of
        the whole sweep."""


def batched_question(scene: Any) -> BatchedQuestion:
    """Return the question of sweeps over a scene: the displacement of a gait, or the
    speed of a robot."""
    # Loaded only where needed: robots take as long to load as everything else.
    if hasattr(scene, "robot"):
        return import_module("geomech.studies.terradynamics.walking").Walks()
    return import_module("geomech.studies.displacement.cycles").Cycles()


@dataclass(frozen=True)
class Plan:
    """A question over a grid of parameters of a scene."""

    scene: Any
    over: Mapping[str, Sequence[float]]

    @cached_property
    def question(self) -> BatchedQuestion:
        return batched_question(self.scene)

    @cached_property
    def grid(self) -> Grid:
        """The grid; Refusal if a point of it makes no scene."""
        return self.question.grid(self.scene, checked_grid_values(self.over))

    @cached_property
    def cost(self) -> Cost:
        return self.question.cost(self.grid)

    def result(self, progress: Callable, seconds: float | None = None) -> Result:
        """Return the answer, with the parameters as leading dimensions.

        progress: called with the fraction done. seconds: of computing, if known, so
        that other processes start sooner."""
        rows = self._rows(progress, seconds)
        axes = _axes(self.grid.over)
        dims = tuple(axis.name for axis in axes)
        arranged = self.grid.arranged(rows)
        variables, facts = self.question.variables(self.grid, arranged, dims)
        # A length that is swept is an axis already.
        others = [variable for variable in variables if variable.name not in dims]
        return Result("sweep", (*axes, *others), facts)

    def _rows(self, progress: Callable, seconds: float | None) -> np.ndarray:
        """Return the rows of all points, from batches that the runner computes."""
        grid = self.grid
        n_batches = -(-grid.total // self.question.batch_size(self.scene))
        common = (self.question, grid.scene_factory)
        arguments = batches(self.question, grid)
        parts = []
        completed = 0
        for part in runner().map(compute_batch, common, arguments, n_batches, seconds):
            parts.append(part)
            completed += len(part)
            progress(completed / grid.total)
        return np.concatenate(parts)


def _axes(over: Mapping[str, list[float]]) -> list[Variable]:
    """Return the values of the parameters as coordinates, such as gait_amplitude."""
    axes = []
    for parameter, values in over.items():
        name = axis_name(parameter)
        axes.append(Variable(name, (name,), np.array(values, float), "", parameter))
    return axes


def axis_name(parameter: str) -> str:
    """Return the name of a parameter's coordinate."""
    return parameter.replace(".", "_").replace("-", "_")


def batches(question: BatchedQuestion, grid: Grid) -> Iterator[tuple]:
    """Yield the batches in order: (scenes, or their points, values of the inner
    parameter)."""
    points = grid.points
    inner_values = grid.inner_values
    n_inner = len(inner_values or [0])
    completed = 0
    while completed < grid.total:
        k, j = divmod(completed, n_inner)  # inner values vary fastest
        batch_size = question.batch_size(grid.scene_factory(points[k]))
        stop = k + 1
        if j == 0:
            stop = min(k + max(1, batch_size // n_inner), points.total)
        values = None
        if inner_values:
            values = inner_values[j : j + batch_size]

        batch = [points[i] for i in range(k, stop)]
        if grid.scene.files:  # workers may lack the files, so they receive scenes
            batch = [grid.scene_factory(point) for point in batch]
        yield batch, values
        completed += len(batch) * len(values or [0])


def compute_batch(common: tuple, part: tuple) -> np.ndarray:
    """Return the rows of a batch from `batches`. common: the question and the factory
    of scenes."""
    question, scene_factory = common
    batch, inner_values = part
    scenes = [scene_factory(x) if isinstance(x, tuple) else x for x in batch]
    return np.array(question.rows(scenes, inner_values), float)


def sweep(
    scene: Any,
    over: Mapping[str, Sequence[float]],
    partial: Path | None = None,
    progress: Callable | None = None,
) -> Result:
    """Return the displacement of a scene's gait by the direct tier, or the speed of its
    robot, over a grid of parameters.

    Points that differ only in the gait or in batched fields of effects
    (`batched_question` in rft/effects), and robots, are solved in batches. partial: a
    file that stores finished batches, so that the same sweep resumes; the caller
    removes it after saving the results. Executors: see `geomech.runs.workers`. Refusal
    if a point of the grid makes no scene."""
    plan = Plan(scene, over)
    _ = plan.grid  # refused before anything is stored
    with store_batches(partial, scene):
        return plan.result(progress or ignore_progress)


def ignore_progress(_: float) -> None:
    """Take no notice of progress."""


def store_batches(
    partial: Path | None, scene: Any
) -> contextlib.AbstractContextManager:
    """Store finished batches in a file, if one is given; it stays until the caller
    removes it."""
    if partial is None:
        return contextlib.nullcontext()
    if not (isinstance(partial, (str, Path)) and str(partial)):
        raise Refusal("partial must be the path of a file", value=partial)
    path = Path(partial)
    return store_results(path, digest_context(inputs(scene)), path, keep=True)
