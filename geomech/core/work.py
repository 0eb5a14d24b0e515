"""Where tasks are computed: in this process, or by the runner of a request, which is set from above
(`geomech.run.runner`) and may store and distribute them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from typing import Any, Protocol, TypeVar

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")
Map = Callable[
    [Callable[[Any], Any], Sequence[Any]], Iterable[Any]
]  # as the builtin `map`, of one sequence


class Worker(Protocol):
    """An object that computes tasks."""

    def each(
        self, function: Callable[[Item], Outcome], items: Sequence[Item]
    ) -> Iterable[Outcome]: ...

    def iterate(
        self, step: Callable, state: Any, count: int, context: tuple, row: Any
    ) -> tuple[Any, list]: ...


class _Serial:
    def each(
        self, function: Callable[[Item], Outcome], items: Sequence[Item]
    ) -> Iterable[Outcome]:
        return map(function, items)

    def iterate(
        self, step: Callable, state: Any, count: int, context: tuple, row: Any
    ) -> tuple[Any, list]:
        rows = []
        for _ in range(count):
            state, one = step(state)
            rows.append(one)
        return state, rows


_worker: ContextVar[Worker] = ContextVar("worker", default=_Serial())  # noqa: B039  it has no state


def each(
    function: Callable[[Item], Outcome], items: Sequence[Item]
) -> Iterable[Outcome]:
    """Return function(item) of every item, in their order, as the builtin `map` does.

    `functools.partial` of a module's function and one argument is a task with what all items share."""
    return _worker.get().each(function, items)


def iterate(
    step: Callable, state: Any, count: int, context: tuple, row: Any = Any
) -> tuple[Any, list]:
    """Return the state after ``count`` times step(state) -> (state, row), and the rows.

    context: everything besides the state on which steps depend; the state consists of arrays and numbers. row: the type
    of a row."""
    return _worker.get().iterate(step, state, count, context, row)


@contextlib.contextmanager
def working(worker: Worker) -> Iterator[None]:
    """Let ``worker`` compute in the body of the statement."""
    token = _worker.set(worker)
    try:
        yield
    finally:
        _worker.reset(token)
