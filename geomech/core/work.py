"""The place where tasks are computed: this process, or the runner of a request.

The runner is set from above (`geomech.runs.runner`) and may store and distribute
tasks."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from typing import Any, Protocol, TypeVar

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")
# As the builtin `map`, of one sequence.
Map = Callable[[Callable[[Any], Any], Sequence[Any]], Iterable[Any]]


class Worker(Protocol):
    """An object that computes tasks."""

    def each(
        self, function: Callable[[Item], Outcome], items: Sequence[Item]
    ) -> Iterable[Outcome]: ...

    def iterate(
        self, step: Callable, state: Any, count: int, context: tuple, row: Any
    ) -> tuple[Any, list]: ...


class _Serial:
    """A worker that computes tasks in this process, one after the other."""

    def each(
        self, function: Callable[[Item], Outcome], items: Sequence[Item]
    ) -> Iterable[Outcome]:
        return map(function, items)

    def iterate(
        self, step: Callable, state: Any, count: int, context: tuple, row: Any
    ) -> tuple[Any, list]:
        rows = []
        for _ in range(count):
            state, last_row = step(state)
            rows.append(last_row)
        return state, rows


# The default has no state, so that sharing it does no harm.
_worker: ContextVar[Worker] = ContextVar("worker", default=_Serial())  # noqa: B039


def each(
    function: Callable[[Item], Outcome], items: Sequence[Item]
) -> Iterable[Outcome]:
    """Return function(item) of every item, in their order, as the builtin `map` does.

    A `functools.partial` of a module's function and one argument is a task; the
    argument is shared by all items."""
    return _worker.get().each(function, items)


def iterate(
    step: Callable, state: Any, count: int, context: tuple, row: Any = Any
) -> tuple[Any, list]:
    """Return the state after ``count`` times step(state) -> (state, row), and the rows.

    context: everything besides the state on which steps depend. state: arrays and
    numbers. row: the type of a row."""
    return _worker.get().iterate(step, state, count, context, row)


@contextlib.contextmanager
def working(worker: Worker) -> Iterator[None]:
    """Let ``worker`` compute in the body of the statement."""
    token = _worker.set(worker)
    try:
        yield
    finally:
        _worker.reset(token)
