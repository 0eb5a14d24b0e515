"""Sweeps: a question over a grid of the scene's own parameters, in batches of points that are stored one after the
other."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from geomech.core.summary import span
from geomech.core.variables import Result, Variable
from geomech.run.cost import Cost
from geomech.run.jobs import context_of, runner, storing
from geomech.scenes.read import inputs
from geomech.studies.grid import Grid, listed
from geomech.studies.question import Allow, Progress, Question
from rft.refusal import Refusal, printable


class Swept(dict):
    """Result of a sweep as a table that users index: {"over": {parameter: values}, name: array (N_1, ...)}."""

    def __init__(self, result: Result):
        self.result, self.scene = result, result.subject
        over = {v.label: v.values.tolist() for v in result.variables if v.is_coordinate}
        super().__init__({"over": over, **batched(self.scene).table(result)})

    def __repr__(self) -> str:
        over = " x ".join(
            f"{name} ({len(v)}: {span(v)})" for name, v in self["over"].items()
        )
        return f"Swept({printable(self.scene.name)} over {over}; {batched(self.scene).summary(self)})"


def as_stored(result: Result) -> Result:
    """Return the result of a sweep as data for a file."""
    return batched(result.subject).as_stored(result)


class Batched(Protocol):
    """A question about many scenes at once: the subject of a sweep.

    It knows its scenes and how to batch them; the sweep knows the grid, the order and the runner."""

    def grid(self, scene: Any, over: Mapping[str, list[float]]) -> Grid:
        """Return the grid of these parameters; Refusal if a point of it makes no scene."""

    def cost(self, grid: Grid) -> Cost:
        """Return the cost of all points."""

    def together(self, scene: Any) -> int:
        """Return the number of rows of such scenes in a batch."""

    def rows(self, scenes: list, inner_values: list[float] | None) -> np.ndarray:
        """Return the numbers (N, width) of every scene, for each value of the inner parameter or the scene's own."""

    def variables(
        self, grid: Grid, rows: np.ndarray, dims: tuple[str, ...]
    ) -> tuple[list[Variable], dict]:
        """Return the answer from rows (N_1, ..., width) as variables, and attributes of the whole sweep."""

    def as_stored(self, result: Result) -> Result:
        """Return the result of a sweep as data for a file."""

    def table(self, result: Result) -> dict:
        """Return the result of a sweep as arrays by name."""

    def summary(self, table: Mapping) -> str:
        """Return the ranges of a table in words."""


def batched(scene: Any) -> Batched:
    """Return the question of sweeps over a scene: the displacement of a gait, or the speed of a robot."""
    kind, module = (
        ("Walks", "walking") if hasattr(scene, "robot") else ("Cycles", "cycles")
    )
    return getattr(
        import_module(f"geomech.studies.{module}"), kind
    )()  # loaded only where needed: robots take as long to load as all else


@dataclass(frozen=True)
class Sweep(Question):
    """A question over a grid. Its result has the parameters as leading dimensions. seconds: of computing, if known, so
    that other processes start sooner."""

    scene: Any
    over: Mapping[str, Sequence[float]]
    seconds: float | None = field(default=None, compare=False)

    @cached_property
    def question(self) -> Batched:
        return batched(self.scene)

    @cached_property
    def grid(self) -> Grid:
        return self.question.grid(self.scene, listed(self.over))

    @cached_property
    def _cost(self) -> Cost:
        return self.question.cost(self.grid)

    def check(self) -> None:
        _ = self.grid  # refuses points that make no scene

    def cost(self) -> Cost:
        return self._cost

    def answer(self, progress: Progress, allow: Allow) -> Result:
        grid, completed, parts_ = self.grid, 0, []
        seconds = self.seconds if "_cost" not in vars(self) else self._cost.seconds
        parts = -(-grid.total // self.question.together(self.scene))
        for rows in runner().map(
            answered,
            (self.question, grid.at),
            batches(self.question, grid),
            parts,
            seconds,
        ):
            parts_.append(rows)
            completed += len(rows)
            progress(completed / grid.total)
        names = {name: name.replace(".", "_").replace("-", "_") for name in grid.over}
        axes = [
            Variable(names[p], (names[p],), np.array(v, float), "", p)
            for p, v in grid.over.items()
        ]
        rows = grid.arranged(np.concatenate(parts_))
        variables, attributes = self.question.variables(
            grid, rows, tuple(names.values())
        )
        return Result("sweep", (*axes, *variables), attributes, self.scene)


def batches(question: Batched, grid: Grid) -> Iterator[tuple]:
    """Yield the batches in order: (scenes, or their points, values of the inner parameter)."""
    points, inner_values = grid.points, grid.inner_values
    count, completed = len(inner_values or [0]), 0
    while completed < grid.total:
        k, j = divmod(completed, count)  # inner values vary fastest
        most = question.together(grid.at(points[k]))
        indices = range(
            k, min(k + max(1, most // count), points.total) if j == 0 else k + 1
        )
        values = inner_values[j : j + most] if inner_values else None
        batch = [points[i] for i in indices]
        # Workers may lack the files, so they receive scenes.
        yield [grid.at(p) for p in batch] if grid.scene.files else batch, values
        completed += len(indices) * len(values or [0])


def answered(common: tuple, part: tuple) -> np.ndarray:
    """Return the rows of a batch."""
    (question, at), (batch, inner_values) = common, part
    scenes = [at(p) if isinstance(p, tuple) else p for p in batch]
    return np.array(question.rows(scenes, inner_values), float)


def sweep(
    scene: Any,
    over: Mapping[str, Sequence[float]],
    partial: Path | None = None,
    progress: Callable | None = None,
) -> Swept:
    """Return the displacement of a scene's gait by the direct tier, or the speed of its robot, over a grid of
    parameters: a table {"over": {parameter: values}, ...} of arrays (N_1, ...) with their "units".

    Points that differ only in the gait or in batched fields of effects (`batched` in rft/effects), and robots, are
    solved in batches. partial: a file that stores finished batches, so that the same sweep resumes; the caller removes
    it after saving the results. Executors: see `geomech.run.workers`. Refusal if a point of the grid makes no scene."""
    question = Sweep(scene, over)
    question.check()
    with _stored_in(partial, scene):
        return Swept(
            question.answer(progress or (lambda done: None), lambda cost: None)
        )


def _stored_in(partial: Path | None, scene: Any) -> contextlib.AbstractContextManager:
    """Store finished batches in a file, if one is given; it stays until the caller removes it."""
    if partial is None:
        return contextlib.nullcontext()
    if not (isinstance(partial, (str, Path)) and str(partial)):
        raise Refusal("partial must be the path of a file", value=partial)
    return storing(Path(partial), context_of(inputs(scene)), Path(partial), keep=True)
