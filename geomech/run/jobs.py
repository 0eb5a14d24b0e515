"""Long computations: tasks by any executor, in order, each result stored under the digest of all that it follows from.

A task is a function of a module with an annotated return type, task(common, item) where many share something. Its result
is numbers, text, arrays and containers of these. A stopped request submits the same tasks again, in whatever order, and
computes those whose results are not stored. `runner()` is the runner of the request under way; `storing` gives it a file,
`geomech.run.workers.using` an executor.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import math
import pickle
import time
import typing
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future
from contextvars import ContextVar
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Protocol

from geomech.core.errors import Note
from geomech.core.work import working
from geomech.run.backend import BACKENDS, VERSION, at_most, fastest, preferred
from geomech.run.cost import TooLong, is_undecided
from geomech.run.digest import Undigestible, digest
from geomech.run.executors import undisturbed
from geomech.run.store import CHECKPOINT, Busy, Store
from geomech.run.tasks import Alone, Order, compute_here, opened, packed, perform
from rft.core.refusal import Refusal

WORTH = 3.0  # s of computing, below which other processes are not worth their start of a second each
TRIES = 3  # of a task whose process is ended from outside


class Executor(Protocol):
    """An executor of tasks, by way of a `concurrent.futures.Executor`. remote: shared with other commands. patience:
    seconds to wait for a result before `look` is called."""

    remote: bool
    patience: float | None

    def submit(self, task: Callable, *arguments) -> Future: ...

    def ahead(self) -> int:
        """Return how many tasks may be submitted before the oldest is back."""

    def look(self, future: Future) -> None:
        """Report why a result is late."""

    def failure(self, error: Exception) -> Exception:
        """Return the error to raise for one of the executor's own."""

    def close(self) -> None: ...


@dataclasses.dataclass(frozen=True)
class Runner:
    """An executor and a store. No result depends on them. context: all data that results depend on besides task,
    arguments and back end."""

    store: Store = dataclasses.field(default_factory=Store, compare=False)
    executor: Executor | None = dataclasses.field(default=None, compare=False)
    context: tuple = dataclasses.field(default=(), compare=False)

    def map(
        self, task: Callable, common: Any, items: Iterable, total: int,
        seconds: float | None = None, progress: Callable[[float], None] | None = None,
    ) -> Iterator:  # fmt: skip
        """Yield task(common, item) of every item, ``total`` in all, in their order.

        Tasks are computed in this process while the remaining ones are not worth the start of others. Each takes one
        thread and the back end of the request, so that the digits do not depend on the executor. seconds: of computing
        that all take, if known; else the first tasks are measured. progress: called with the fraction done."""
        queue, done = _Queue(self, task, common, total, seconds), 0
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
        task, common = (
            (function.func, function.args[0]) if is_task else (_applied, function)
        )
        return self.map(task, common, items, len(items))

    def call(self, task: Callable, *arguments) -> Any:
        """Return task(*arguments), computed if it is not stored."""
        key, kind = self._key(task, arguments), _kind(task)
        stored = self._stored(key, kind)
        if stored is None:
            stored = (task(*arguments),)
            self._store(key, stored[0], kind)
        return stored[0]

    def iterate(
        self, step: Callable, state: Any, count: int, of: tuple, row: Any = Any
    ) -> tuple[Any, list]:
        """Return the state after ``count`` times step(state) -> (state, row), and the rows.

        Every `CHECKPOINT` seconds the state is stored, and a stopped request resumes from there. of: all data that
        steps depend on besides the state, which consists of arrays and numbers. row: the type of a row."""
        rows: list = []
        while (remaining := count - len(rows)) > 0:
            key, kind = (
                self._key(Runner.iterate, (of, state, remaining)),
                tuple[Any, list[row]],
            )
            stored = self._stored(key, kind)
            if stored is None:
                piece, until = (
                    [],
                    math.inf if key is None else time.monotonic() + CHECKPOINT,
                )
                while not piece or (
                    len(piece) < remaining and time.monotonic() < until
                ):
                    state, one = step(state)
                    piece.append(one)
                self._store(key, (state, piece), kind)
            else:
                after, piece = stored[0]
                state = _like(state, after)
            rows += piece
        return state, rows

    def _key(self, *what: Any) -> bytes | None:
        """Return the key of what is computed; None where nothing is stored."""
        if self.store.lost:
            return None
        try:
            return digest(self.context, preferred(), *what)
        except Undigestible:
            return None

    def _stored(self, key: bytes | None, kind: Any) -> tuple | None:
        return None if key is None else self.store.get(key, kind)

    def _store(self, key: bytes | None, value: Any, kind: Any) -> None:
        if key is not None:
            self.store.put(key, value, kind)


def _applied(function: Callable, item: Any) -> Any:
    return function(item)


@functools.cache
def _kind(task: Callable) -> Any:
    """Return the declared type of a task's result."""
    return typing.get_type_hints(task).get("return", Any)


def _like(example: Any, tree: Any) -> Any:
    """Return nested lists as tuples and records like those of an example."""
    if isinstance(example, tuple):
        parts = [_like(*pair) for pair in zip(example, tree, strict=True)]
        return type(example)(*parts) if hasattr(example, "_fields") else tuple(parts)
    return tree


class _Queue:
    """The tasks of one `Runner.map`, in their order: stored, computed here, or submitted to an executor."""

    def __init__(
        self,
        runner: Runner,
        task: Callable,
        common: Any,
        total: int,
        seconds: float | None,
    ):
        self.runner, self.task, self.common, self.total = runner, task, common, total
        self.executor, self.back_end, self.kind = (
            runner.executor,
            preferred(),
            _kind(task),
        )
        self.common_key = runner._key(task, common)
        self.each, self.took, self.begun = seconds and seconds / total, [], 0
        self.order: Order | None = None
        self.warned: set = set()
        self.waiting: deque[tuple[bytes | None, tuple | _Part]] = deque()

    def results(self, items: Iterable) -> Iterator:
        for item in items:
            self.waiting.append(self._begin(item))
            while self.waiting and self._is_due():
                yield self._finish()
        while self.waiting:
            yield self._finish()

    def close(self) -> None:
        with undisturbed():
            for _, result in self.waiting:
                if isinstance(result, _Part):
                    result.future.cancel()

    def _begin(self, item: Any) -> tuple[bytes | None, tuple | _Part]:
        self.begun += 1
        key = self.common_key and self.runner._key(self.common_key, item)
        result = self.runner._stored(key, self.kind)
        if result is not None:
            return None, result
        if self._is_shared():
            return key, _Part(self.executor, self.order, pickle.dumps(item))
        start = time.perf_counter()
        with unaided():
            result = compute_here(
                self.task, self.common, item, self.back_end, self.total > 1
            )
        self.took.append(time.perf_counter() - start)
        self.runner._store(key, result, self.kind)
        return None, (result,)

    def _is_due(self) -> bool:
        result = self.waiting[0][1]
        return (
            not isinstance(result, _Part)
            or result.is_ready()
            or len(self.waiting) >= self.executor.ahead()
        )

    def _finish(self) -> Any:
        key, result = self.waiting.popleft()
        if isinstance(result, _Part):
            try:
                result = (opened(result.result(), self.warned),)
            except BaseException:
                result.future.cancel()
                raise
            self.runner._store(key, result[0], self.kind)
        return result[0]

    def _is_shared(self) -> bool:
        """Return whether the executor is to compute the next task; once it does, it computes all that follow. It starts
        only when the request has been decided to go on."""
        if is_undecided():
            return False
        if self.executor is None or self.order is not None:
            return self.order is not None
        if not (self.executor.remote or self._is_worth_it(self.total - self.begun + 1)):
            return False
        try:
            self.order = packed(self.task, self.common, self.back_end)
        except Alone as error:
            cure = "put it in a module"
            if self.executor.remote:
                raise Refusal(
                    "a cluster cannot know what is to be computed",
                    because=str(error),
                    instead=cure,
                ) from None
            if error.worth_saying:
                warnings.warn(
                    f"computed by one process, others cannot know it: {error}: {cure}",
                    Note,
                    stacklevel=6,
                )
            self.executor = None
        return self.order is not None

    def _is_worth_it(self, remaining: int) -> bool:
        """Return whether the remaining tasks take longer than the start of other processes."""
        if self.total == 1:
            return False
        if self.each is not None and self.each * remaining >= WORTH:
            return True
        if len(self.took) < 2 or remaining < 2:
            return False
        each = sum(self.took[1:]) / (
            len(self.took) - 1
        )  # the first one also loads what is needed
        each = (
            max(each, sum(self.took) / len(self.took))
            if sum(self.took) > WORTH
            else each
        )
        return each * remaining > WORTH


class _Part:
    """A task at an executor. Its result is taken from a queue whose lock no signal can leave held, unlike that of
    `Future.result`."""

    def __init__(self, executor: Executor, order: Order, item: bytes):
        self.executor, self.order, self.item = executor, order, item
        self._submit()

    def _submit(self) -> None:
        self.back: SimpleQueue = SimpleQueue()
        with undisturbed():
            self.future = self.executor.submit(perform, self.order, self.item)
            self.future.add_done_callback(self.back.put)

    def is_ready(self) -> bool:
        return not self.back.empty()

    def result(self) -> bytes:
        """Return the outcome; RuntimeError if the executor fails."""
        for _ in range(TRIES):
            while True:
                try:
                    future = self.back.get(timeout=self.executor.patience)
                    break
                except Empty:
                    self.executor.look(self.future)
            try:
                with undisturbed():
                    return future.result()
            except BrokenExecutor:  # a process was ended: perhaps by another task
                self._submit()
            except Exception as error:
                raise self.executor.failure(error) from error
        raise RuntimeError(
            f"a worker process was ended {TRIES} times at the same part: out of memory? Take fewer workers"
        )


_runner: ContextVar[Runner | None] = ContextVar("runner", default=None)
_ALONE = Runner()


def runner() -> Runner:
    """Return the runner of the request under way."""
    return _runner.get() or _ALONE


@contextlib.contextmanager
def running(new: Runner) -> Iterator[Runner]:
    """Let ``new`` be `runner` in the body of the statement."""
    token = _runner.set(new)
    try:
        with working(new):
            yield new
    finally:
        _runner.reset(token)


def unaided() -> contextlib.AbstractContextManager[Runner]:
    """Compute all tasks in this process, without storing, in the body of the statement: it is a task, or no part of a
    request."""
    return running(_ALONE)


def context_of(files: Iterable[Path]) -> tuple:
    """Return all data that results depend on besides tasks and arguments: plug-ins, and files."""
    from geomech.scenes.kinds import code

    return code(), [
        hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
        if path.is_file()
    ]


@contextlib.contextmanager
def storing(
    path: Path | None,
    context: tuple = (),
    output: Path | None = None,
    keep: bool = False,
) -> Iterator[Runner]:
    """Store results of tasks in ``path`` in the body of the statement; None: nowhere. At its end the file is removed,
    unless ``keep``.

    context: all data that results depend on besides the tasks, such as files and plug-ins. output: of which one
    computation at a time is allowed: Refusal while another runs. A resumed request uses no back end that it did not
    have at first. An interrupt or a signal notes what is stored; so does an error after the first write, an earlier one
    removes the file, and `TooLong` always does."""
    try:
        store = Store(path, output is not None, BACKENDS.index(fastest()))
    except Busy:
        raise Refusal(
            f"another computation to {output} is under way",
            instead="wait for it, stop it, or choose another output with -o",
        ) from None
    with at_most(BACKENDS[min(store.mark, len(BACKENDS) - 1)]):
        try:
            with running(
                dataclasses.replace(runner(), store=store, context=(VERSION, *context))
            ) as new:
                yield new
        except TooLong:
            store.close(done=True)
            raise
        except BaseException as error:
            if not isinstance(error, Exception) or store.written:
                store.commit()
            if store.written:
                error.add_note(
                    f"{store.written} results so far are kept in {path}: the same command goes on from there"
                )
            store.close(done=not store.written)
            raise
        store.close(done=not keep)
