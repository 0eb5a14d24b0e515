"""Long computations: tasks that any executor computes and that are stored by content.

A task is a function of a module with an annotated return type, task(common, item) where
many tasks share something. Its result consists of numbers, text, arrays and containers
of these. Each result is stored under the digest of everything that it follows from. A
request that was stopped submits the same tasks again, in whatever order, and computes
those whose results are not stored.

`runner()` is the runner of the request under way; `store_results` gives it a file, and
`geomech.runs.workers.using` an executor.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from geomech.core.work import working
from geomech.runs.backend import BACKENDS, VERSION, at_most, fastest, preferred
from geomech.runs.cost import TooLong
from geomech.runs.digest import Undigestible, digest
from geomech.runs.executors import Executor
from geomech.runs.pending import TaskQueue
from geomech.runs.store import CHECKPOINT, Busy, Store
from geomech.runs.tasks import compute, result_type
from geomech.scenes.kinds import code
from rft.core.refusal import Refusal


@dataclasses.dataclass(frozen=True)
class Runner:
    """An executor and a store. No result depends on them.

    context: all data that results depend on besides task, arguments and back end."""

    store: Store = dataclasses.field(default_factory=Store, compare=False)
    executor: Executor | None = dataclasses.field(default=None, compare=False)
    context: tuple = dataclasses.field(default=(), compare=False)

    def map(
        self,
        task: Callable,
        common: Any,
        items: Iterable,
        total: int,
        seconds: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Iterator:
        """Yield task(common, item) of every item, ``total`` in all, in their order.

        Tasks are computed in this process as long as the remaining ones are not worth
        the start of other processes. Each takes one thread and the back end of the
        request, so that the digits do not depend on the executor.

        seconds: of computing that all tasks take, if known; else the first tasks are
        measured. progress: called with the fraction done."""
        queue = TaskQueue(self, task, common, total, seconds)
        done = 0
        with contextlib.closing(queue):
            for result in queue.results(items):
                done += 1
                if progress:
                    progress(done / max(done, total))
                yield result

    def each(self, function: Callable, items: Sequence) -> Iterator:
        """Yield function(item) of every item; see `geomech.core.work.each`."""
        is_task = (
            isinstance(function, functools.partial)
            and len(function.args) == 1
            and not function.keywords
        )
        if is_task:
            return self.map(function.func, function.args[0], items, len(items))
        return self.map(_apply, function, items, len(items))

    def call(self, task: Callable, *arguments) -> Any:
        """Return task(*arguments), computed if it is not stored."""
        key = self.key(task, arguments)
        kind = result_type(task)
        stored = self.stored(key, kind)
        if stored is not None:
            return stored[0]

        value = task(*arguments)
        self.keep(key, value, kind)
        return value

    def iterate(
        self, step: Callable, state: Any, count: int, of: tuple, row: Any = Any
    ) -> tuple[Any, list]:
        """Return the state after ``count`` times step(state) -> (state, row), and the
        rows.

        Every `CHECKPOINT` seconds the state is stored, and a stopped request resumes
        from there. of: all data that steps depend on besides the state, which consists
        of arrays and numbers. row: the type of a row."""
        kind = tuple[Any, list[row]]
        rows: list = []
        while len(rows) < count:
            remaining = count - len(rows)
            key = self.key(Runner.iterate, (of, state, remaining))
            stored = self.stored(key, kind)
            if stored is not None:
                after, chunk = stored[0]
                state = _with_types_of(state, after)
            else:
                duration = math.inf if key is None else CHECKPOINT
                state, chunk = _steps(step, state, remaining, duration)
                self.keep(key, (state, chunk), kind)
            rows += chunk
        return state, rows

    def compute_inline(
        self, task: Callable, common: Any, item: Any, back_end: str, one_of_many: bool
    ) -> Any:
        """Return task(common, item), computed in this process; see
        `geomech.runs.tasks.compute`."""
        with inline_runner():
            return compute(task, common, item, back_end, one_of_many)

    def key(self, *data: Any) -> bytes | None:
        """Return the key of a result that follows from these data; None where nothing
        is stored."""
        if self.store.lost:
            return None
        try:
            return digest(self.context, preferred(), *data)
        except Undigestible:
            return None

    def stored(self, key: bytes | None, kind: Any) -> tuple | None:
        """Return (result,), or None where it is not stored."""
        if key is None:
            return None
        return self.store.get(key, kind)

    def keep(self, key: bytes | None, value: Any, kind: Any) -> None:
        """Store a result, if it has a key."""
        if key is not None:
            self.store.put(key, value, kind)


def _steps(step: Callable, state: Any, count: int, duration: float) -> tuple[Any, list]:
    """Return the state and the rows after at most ``count`` steps, at least one, that
    begin within ``duration`` s."""
    end = time.monotonic() + duration
    rows: list = []
    while True:
        state, row = step(state)
        rows.append(row)
        if len(rows) == count or time.monotonic() >= end:
            return state, rows


def _apply(function: Callable, item: Any) -> Any:
    return function(item)


def _with_types_of(example: Any, tree: Any) -> Any:
    """Return nested lists as the tuples and named tuples of an example."""
    if not isinstance(example, tuple):
        return tree
    parts = [_with_types_of(*pair) for pair in zip(example, tree, strict=True)]
    if hasattr(example, "_fields"):
        return type(example)(*parts)
    return tuple(parts)


_runner: ContextVar[Runner | None] = ContextVar("runner", default=None)
_INLINE = Runner()


def runner() -> Runner:
    """Return the runner of the request under way."""
    return _runner.get() or _INLINE


@contextlib.contextmanager
def use_runner(new: Runner) -> Iterator[Runner]:
    """Let `runner` return ``new`` in the body of the statement."""
    token = _runner.set(new)
    try:
        with working(new):
            yield new
    finally:
        _runner.reset(token)


def inline_runner() -> contextlib.AbstractContextManager[Runner]:
    """Compute all tasks in this process, without storing, in the body of the statement,
    which is itself a task, or no part of a request."""
    return use_runner(_INLINE)


def digest_context(files: Iterable[Path]) -> tuple:
    """Return all data that results depend on besides tasks and arguments: plug-ins, and
    the content of files."""
    contents = []
    for path in files:
        if path.is_file():
            contents.append(hashlib.sha256(path.read_bytes()).hexdigest())
    return code(), contents


@contextlib.contextmanager
def store_results(
    path: Path | None,
    context: tuple = (),
    output: Path | None = None,
    keep: bool = False,
) -> Iterator[Runner]:
    """Store results of tasks in ``path`` in the body of the statement; None: nowhere.
    At its end the file is removed, unless ``keep``.

    context: all data that results depend on besides the tasks, such as files and
    plug-ins. output: of which one computation at a time is allowed: Refusal while
    another runs. A resumed request uses no back end that it did not have at first.

    An interrupt or a signal notes what is stored. So does an error after the first
    write; an earlier error removes the file, and `TooLong` always does."""
    try:
        store = Store(path, output is not None, BACKENDS.index(fastest()))
    except Busy:
        raise Refusal(
            f"another computation with the output {output} is running",
            instead="wait for it, stop it, or choose another output with -o",
        ) from None
    back_end = BACKENDS[min(store.mark, len(BACKENDS) - 1)]
    new = dataclasses.replace(runner(), store=store, context=(VERSION, *context))
    with at_most(back_end):
        try:
            with use_runner(new):
                yield new
        except TooLong:
            store.close(done=True)
            raise
        except BaseException as error:
            _close_after(error, store)
            raise
        store.close(done=not keep)


def _close_after(error: BaseException, store: Store) -> None:
    """Close the store of a request that ended by an error or a signal."""
    if not isinstance(error, Exception) or store.written:
        store.commit()
    if store.written:
        error.add_note(
            f"{store.written} results are stored in {store.path}: repeat the command "
            "to continue from there"
        )
    store.close(done=not store.written)
