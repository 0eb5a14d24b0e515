"""The tasks of one request in their order: stored, computed here, or at an executor."""

from __future__ import annotations

import pickle
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple

from geomech.runs.backend import preferred
from geomech.runs.cost import is_undecided
from geomech.runs.executors import Executor, defer_signals
from geomech.runs.tasks import (
    NotPicklable,
    TaskPayload,
    pack,
    perform,
    result_type,
    unpack_outcome,
)
from rft.core.notes import warn
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.runs.runner import Runner

# s of computing below which other processes are not worth their start of a second each
WORTH_PROCESSES = 3.0
MAX_TRIES = 3  # of a task whose process is ended from outside


class Waiting(NamedTuple):
    """A task whose result is not yet returned. key: under which its result is to be
    stored; None where it is stored or cannot be. result: (value,), or the task at the
    executor."""

    key: bytes | None
    result: tuple | PendingTask


class TaskQueue:
    """The tasks of one `Runner.map`, in their order.

    seconds: of computing that all take, if known."""

    def __init__(
        self,
        runner: Runner,
        task: Callable,
        common: Any,
        total: int,
        seconds: float | None,
    ):
        self.runner = runner
        self.task = task
        self.common = common
        self.total = total
        self.seconds_each = seconds and seconds / total

        self.executor = runner.executor
        self.back_end = preferred()
        self.kind = result_type(task)
        self.common_key = runner.key(task, common)

        self.n_begun = 0
        self.times: list[float] = []  # s, of the tasks that were computed here
        self.payload: TaskPayload | None = None
        self.warned: set = set()
        self.waiting: deque[Waiting] = deque()

    def results(self, items: Iterable) -> Iterator:
        for item in items:
            self.waiting.append(self._begin(item))
            while self.waiting and self._is_due():
                yield self._finish()
        while self.waiting:
            yield self._finish()

    def close(self) -> None:
        with defer_signals():
            for task in self.waiting:
                if isinstance(task.result, PendingTask):
                    task.result.future.cancel()

    def _begin(self, item: Any) -> Waiting:
        self.n_begun += 1
        key = self.common_key and self.runner.key(self.common_key, item)
        stored = self.runner.stored(key, self.kind)
        if stored is not None:
            return Waiting(None, stored)
        if self._is_shared():
            task = PendingTask(self.executor, self.payload, pickle.dumps(item))
            return Waiting(key, task)
        value = self._compute_here(item)
        self.runner.keep(key, value, self.kind)
        return Waiting(None, (value,))

    def _compute_here(self, item: Any) -> Any:
        start = time.perf_counter()
        is_one_of_many = self.total > 1
        value = self.runner.compute_inline(
            self.task, self.common, item, self.back_end, is_one_of_many
        )
        self.times.append(time.perf_counter() - start)
        return value

    def _is_due(self) -> bool:
        """Return whether the oldest result is there, or must be waited for."""
        result = self.waiting[0].result
        if not isinstance(result, PendingTask) or result.is_ready():
            return True
        return len(self.waiting) >= self.executor.max_pending()

    def _finish(self) -> Any:
        """Return the oldest result."""
        key, result = self.waiting.popleft()
        if not isinstance(result, PendingTask):
            return result[0]
        try:
            value = unpack_outcome(result.result(), self.warned)
        except BaseException:
            result.future.cancel()
            raise
        self.runner.keep(key, value, self.kind)
        return value

    def _is_shared(self) -> bool:
        """Return whether the executor is to compute the next task. Once it does, it
        computes all that follow. It starts only when the request has been decided to go
        on."""
        if is_undecided():
            return False
        if self.executor is None or self.payload is not None:
            return self.payload is not None
        remaining = self.total - self.n_begun + 1
        if not (self.executor.remote or self._is_worth_processes(remaining)):
            return False
        try:
            self.payload = pack(self.task, self.common, self.back_end)
        except NotPicklable as error:
            self._go_on_alone(error)
        return self.payload is not None

    def _go_on_alone(self, error: NotPicklable) -> None:
        """Compute all tasks here, with a note; Refusal where a cluster was asked
        for."""
        cure = "put it in a module"
        if self.executor.remote:
            raise Refusal(
                "a cluster does not know what to compute",
                because=str(error),
                instead=cure,
            ) from None
        if error.is_told:
            warn(
                "computed by one process, because others do not know it: "
                f"{error}: {cure}"
            )
        self.executor = None

    def _is_worth_processes(self, remaining: int) -> bool:
        """Return whether the remaining tasks take longer than the start of other
        processes."""
        if self.total == 1:
            return False
        if (
            self.seconds_each is not None
            and self.seconds_each * remaining >= WORTH_PROCESSES
        ):
            return True
        if len(self.times) < 2 or remaining < 2:
            return False
        # The first task also loads what is needed.
        seconds = sum(self.times[1:]) / (len(self.times) - 1)
        if sum(self.times) > WORTH_PROCESSES:
            seconds = max(seconds, sum(self.times) / len(self.times))
        return seconds * remaining > WORTH_PROCESSES


class PendingTask:
    """A task at an executor.

    Its result is taken from a queue whose lock no signal can leave held, unlike that of
    `Future.result`."""

    def __init__(self, executor: Executor, payload: TaskPayload, item: bytes):
        self.executor = executor
        self.payload = payload
        self.item = item
        self._submit()

    def _submit(self) -> None:
        self.finished: SimpleQueue = SimpleQueue()
        with defer_signals():
            self.future = self.executor.submit(perform, self.payload, self.item)
            self.future.add_done_callback(self.finished.put)

    def is_ready(self) -> bool:
        return not self.finished.empty()

    def result(self) -> bytes:
        """Return the outcome; RuntimeError if the executor fails."""
        for _ in range(MAX_TRIES):
            future = self._wait()
            try:
                with defer_signals():
                    return future.result()
            except BrokenExecutor:  # a process was ended: perhaps by another task
                self._submit()
            except Exception as error:
                raise self.executor.failure(error) from error
        raise RuntimeError(
            f"a worker process was ended {MAX_TRIES} times during the same task: out "
            "of memory? Use fewer workers"
        )

    def _wait(self) -> Any:
        """Return the future once it is done."""
        while True:
            try:
                return self.finished.get(timeout=self.executor.patience)
            except Empty:
                self.executor.warn_if_stalled(self.future)
