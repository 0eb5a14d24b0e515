"""Any question to a scene over a grid of the scene's own parameters: points side by side in batches, stored as it goes."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from geomech.core.face import Extensible
from geomech.core.summary import span
from geomech.core.variables import Result, Variable
from geomech.run.cost import Cost
from geomech.run.jobs import context_of, runner, storing
from geomech.scene.read import inputs
from geomech.study.grid import Grid, listed
from geomech.study.question import Allow, Progress, Question
from rft.refusal import Refusal, printable


class Swept(Extensible, dict):
    """The result of a sweep as a table that users index: {"over": {parameter: values}, name: array (N_1, ...)}."""

    def __init__(self, result: Result):
        self.result, self.scene = result, result.subject
        over = {v.label: v.values.tolist() for v in result.variables if v.is_coordinate}
        super().__init__({"over": over, **batched(self.scene).table(result)})

    def __repr__(self) -> str:
        over = " x ".join(f"{name} ({len(v)}: {span(v)})" for name, v in self["over"].items())
        return f"Swept({printable(self.scene.name)} over {over}; {batched(self.scene).summary(self)})"


def as_stored(result: Result) -> Result:
    """Return the result of a sweep as its file has it."""
    return batched(result.subject).as_stored(result)


class Batched(Protocol):
    """A question to many scenes at once: what a sweep is made of.

    It knows its scenes and says how they are put side by side; the sweep knows the grid, the order and who computes."""

    def grid(self, scene: Any, over: Mapping[str, list[float]]) -> Grid:
        """Return the grid of these parameters; Refusal if a point of it makes no scene."""

    def cost(self, grid: Grid) -> Cost:
        """Return what all points take."""

    def together(self, scene: Any) -> int:
        """Return how many rows of scenes like this one make a batch."""

    def rows(self, scenes: list, beside: list[float] | None) -> np.ndarray:
        """Return the numbers (N, width) of every scene, for each value of the inner parameter or its own one."""

    def variables(self, grid: Grid, rows: np.ndarray, dims: tuple[str, ...]) -> tuple[list[Variable], dict]:
        """Return the answer by rows (N_1, ..., width) as variables, and attributes that hold of all."""

    def as_stored(self, result: Result) -> Result:
        """Return the result of a sweep as its file has it."""

    def table(self, result: Result) -> dict:
        """Return the result of a sweep as arrays by name."""

    def summary(self, table: Mapping) -> str:
        """Return the ranges of a table in words."""


def batched(scene: Any) -> Batched:
    """Return what a sweep asks of a scene: how far a gait goes, or how fast a robot walks."""
    kind, module = ("Walks", "walking") if hasattr(scene, "robot") else ("Cycles", "cycles")
    return getattr(import_module(f"geomech.study.{module}"), kind)()  # robots take as long to load as all else


@dataclass(frozen=True)
class Sweep(Question):
    """A question over a grid: its result is that of the question with the parameters as leading dimensions.

    seconds: of computing that it takes, if known: others then begin sooner."""

    scene: Any
    over: Mapping[str, list[float]]
    seconds: float | None = field(default=None, compare=False)

    @cached_property
    def asked(self) -> Batched:
        return batched(self.scene)

    @cached_property
    def grid(self) -> Grid:
        return self.asked.grid(self.scene, listed(self.over))

    @cached_property
    def _cost(self) -> Cost:
        return self.asked.cost(self.grid)

    def check(self) -> None:
        _ = self.grid  # every point makes a scene

    def cost(self) -> Cost:
        return self._cost

    def answer(self, progress: Progress, allow: Allow) -> Result:
        grid, done, found = self.grid, 0, []
        seconds = self.seconds if "_cost" not in vars(self) else self._cost.seconds
        parts = -(-grid.total // self.asked.together(self.scene))
        for rows in runner().map(answered, (self.asked, grid.at), batches(self.asked, grid), parts, seconds):
            found.append(rows)
            done += len(rows)
            progress(done / grid.total)
        names = {name: name.replace(".", "_").replace("-", "_") for name in grid.over}
        axes = [Variable(names[p], (names[p],), np.array(v, float), "", p) for p, v in grid.over.items()]
        rows = grid.arranged(np.concatenate(found))
        variables, attributes = self.asked.variables(grid, rows, tuple(names.values()))
        return Result("sweep", (*axes, *variables), attributes, self.scene)


def batches(asked: Batched, grid: Grid) -> Iterator[tuple]:
    """Yield what is solved together, in order: (scenes, or their points, values of the inner parameter)."""
    points, beside = grid.points, grid.beside
    count, done = len(beside or [0]), 0
    while done < grid.total:
        k, j = divmod(done, count)  # points, of which the inner values run fastest
        most = asked.together(grid.at(points[k]))
        here = range(k, min(k + max(1, most // count), points.total) if j == 0 else k + 1)
        some = beside[j : j + most] if beside else None
        batch = [points[i] for i in here]
        # Files need not be where it is computed.
        yield [grid.at(p) for p in batch] if grid.scene.files else batch, some
        done += len(here) * len(some or [0])


def answered(common: tuple, part: tuple) -> np.ndarray:
    """Return the rows of a batch."""
    (asked, at), (batch, beside) = common, part
    scenes = [at(p) if isinstance(p, tuple) else p for p in batch]
    return np.array(asked.rows(scenes, beside), float)


def sweep(
    scene: Any,
    over: Mapping[str, list[float]],
    partial: Path | None = None,
    progress: Callable | None = None,
) -> Swept:
    """Return the displacement of a scene's gait by the direct tier, or the speed of its robot, over a grid of parameters: a
    table {"over": {parameter: values}, ...} of arrays (N_1, ...) with their "units".

    Points that differ in the gait or in what effects let differ within a batch (`batched` in rft/effects), and robots, go
    through the solver together. partial: a file in which what is done is stored, so that the same sweep resumes; it is the
    caller's to remove, once the results are saved. Who computes: `geomech.run.workers`. Refusal if a point of the grid
    makes no scene."""
    question = Sweep(scene, over)
    question.check()
    with _stored_in(partial, scene):
        return Swept(question.answer(progress or (lambda done: None), lambda cost: None))


def _stored_in(partial: Path | None, scene: Any) -> contextlib.AbstractContextManager:
    """Store what is done in a file, if one is given; it stays until the caller removes it."""
    if partial is None:
        return contextlib.nullcontext()
    if not (isinstance(partial, (str, Path)) and str(partial)):
        raise Refusal("partial must be the path of a file", value=partial)
    return storing(Path(partial), context_of(inputs(scene)), Path(partial), keep=True)
