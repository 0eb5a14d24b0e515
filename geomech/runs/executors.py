"""Executors: processes of this machine, one per core, or the workers of a Dask
cluster."""

from __future__ import annotations

import contextlib
import logging
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future
from typing import Any, Protocol

from geomech.io.files import note
from geomech.runs.backend import BACKENDS, VERSION, fastest
from rft.core.refusal import Refusal, formatted, spell_arguments

PENDING_PER_WORKER = 4  # tasks that are submitted before the oldest is finished
LONGEST_END = 2.0  # s for a pool to notice that its processes were killed
PATIENCE = 0.2  # s for a pool to drop cancelled tasks
WAIT = 3.0  # s for the scheduler to answer, and for a first worker
# s after which workers of a cluster are counted again: they may come and go
COUNT_INTERVAL = 10.0
SIGNALS = [
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)
]
CONNECTION_ERRORS = (
    "CancelledError",
    "FutureCancelledError",
    "CommClosedError",
    "ClosedClientError",
)


class Executor(Protocol):
    """An executor of tasks, on top of a `concurrent.futures.Executor`.

    remote: shared with other commands. patience: seconds to wait for a result before
    `warn_if_stalled` is called; None: for ever."""

    remote: bool
    patience: float | None

    def submit(self, task: Callable, *arguments) -> Future: ...

    def max_pending(self) -> int:
        """Return how many tasks may be submitted before the oldest is finished."""

    def warn_if_stalled(self, future: Future) -> None:
        """Report the reason for which a result is late."""

    def failure(self, error: Exception) -> Exception:
        """Return the error to raise for one of the executor's own."""

    def close(self) -> None: ...


class Processes:
    """A pool of ``count`` processes, started by the first task. When one of them is
    ended from outside, all are started anew."""

    remote = False
    patience = None

    def __init__(self, count: int):
        self.count = count
        self.pool = None

    def submit(self, task: Callable, *arguments) -> Future:
        with defer_signals():
            for _ in range(2):
                with contextlib.suppress(BrokenExecutor):
                    return self._started_pool().submit(task, *arguments)
                self.pool = None
        raise BrokenExecutor("processes end as soon as they start")

    def _started_pool(self):
        if self.pool is None:
            # Here, as it loads what starts processes.
            from geomech.runs.spawn import pool

            self.pool = pool(self.count)
        return self.pool

    def max_pending(self) -> int:
        return PENDING_PER_WORKER * self.count

    def warn_if_stalled(self, future: Future) -> None:
        """Do nothing: the pool notices a process that is ended."""

    def failure(self, error: Exception) -> Exception:
        return error

    def close(self) -> None:
        """End all processes at once, even in the middle of a task."""
        pool = self.pool
        self.pool = None
        if pool is None:
            return
        with defer_signals():
            manager = pool._executor_manager_thread
            processes = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            if manager:
                _wait_until_dropped(manager)
            for process in processes:
                process.kill()
            if manager:
                manager.join(LONGEST_END)


def _wait_until_dropped(manager: threading.Thread) -> None:
    """Wait until the thread that manages a pool has dropped tasks that are cancelled,
    which would make it print a traceback."""
    end = time.monotonic() + PATIENCE
    while _has_cancelled(manager) and time.monotonic() < end:
        time.sleep(1e-3)


def _has_cancelled(manager: threading.Thread) -> bool:
    """Return whether the thread that manages a pool still holds tasks that are
    cancelled."""
    if not manager.is_alive():
        return False
    tasks = list(manager.pending_work_items.values())
    return any(task.future.cancelled() for task in tasks)


@contextlib.contextmanager
def defer_signals() -> Iterator[None]:
    """Hold signals back in the body of the statement. One that is raised inside of
    `concurrent.futures` may leave its locks held."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    received: list[int] = []

    def remember(number: int, frame: Any) -> None:
        received.append(number)

    handlers = {}
    for number in SIGNALS:
        handler = signal.getsignal(number)
        if callable(handler):
            handlers[number] = handler
    try:
        for number in handlers:
            signal.signal(number, remember)
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if received:
            signal.raise_signal(received[0])


class Cluster:
    """The workers of one Dask scheduler. Dask gives the tasks of a lost worker to
    others."""

    remote = True

    def __init__(self, address: str):
        self.address = address
        self.place = f"``scheduler`` {address}"
        self.client = self._connect(_import_distributed())
        self.n_threads = 0
        self.counted_at = -COUNT_INTERVAL
        self.has_warned = False
        try:
            self.back_end = self._common_back_end()
        except BaseException:
            self.close()
            raise
        self.submit = self.client.get_executor(pure=False).submit

    @property
    def patience(self) -> float:
        return COUNT_INTERVAL

    def _connect(self, distributed):
        """Return the client; Refusal if nothing answers, or something that is no
        scheduler."""
        # Errors are one line here.
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        answer: Future = Future()
        threading.Thread(
            target=self._open_client, args=(distributed, answer), daemon=True
        ).start()
        try:
            return answer.result(2 * WAIT)
        except OSError:
            why = "nothing answers there"
        except Exception as error:
            why = formatted(str(error), 120)
        raise Refusal(
            why,
            where=self.place,
            instead="give the address of a Dask scheduler that runs ('dask "
            "scheduler'), such as tcp://127.0.0.1:8786, or leave it out",
        )

    def _open_client(self, distributed, answer: Future) -> None:
        try:
            with warnings.catch_warnings():
                # They are of different versions: those that matter are refused.
                warnings.simplefilter("ignore")
                # The client of another kind of server prints an error when it is
                # deleted.
                distributed.comm.resolve_address(self.address)
                client = distributed.Client(
                    self.address, timeout=WAIT, set_as_default=False
                )
            answer.set_result(client)
        except Exception as error:
            answer.set_exception(error)

    def _common_back_end(self) -> str:
        """Return the back end that all workers have; Refusal unless there are some, all
        with this code."""
        end = time.monotonic() + WAIT
        while not self._count_threads():
            if time.monotonic() > end:
                raise Refusal(
                    "it has no workers",
                    where=self.place,
                    instead=f"start workers ('dask worker {self.address}')",
                )
            time.sleep(0.05)
        try:
            workers = self.client.run(_version_and_back_end)
        except Exception as error:
            raise Refusal(
                f"its workers cannot load geomech ({formatted(str(error), 120)})",
                where=self.place,
                instead="install geomech there",
            ) from None
        back_ends = []
        for worker, (version, back_end) in workers.items():
            if version != VERSION:
                raise Refusal(
                    f"the worker {worker} has {version}, this command {VERSION}",
                    where=self.place,
                    instead="install the same version there",
                )
            back_ends.append(back_end)
        return min(back_ends, key=BACKENDS.index)

    def _count_threads(self) -> int:
        """Return the number of threads of all workers."""
        is_old = time.monotonic() > self.counted_at + COUNT_INTERVAL
        if is_old or not self.n_threads:
            try:
                self.n_threads = sum(self.client.nthreads().values())
            except Exception as error:
                raise self.failure(error) from error
            self.counted_at = time.monotonic()
        return self.n_threads

    def max_pending(self) -> int:
        return max(2, PENDING_PER_WORKER * self._count_threads())

    def warn_if_stalled(self, future: Future) -> None:
        """Note, once, that all workers are gone; others may come."""
        if future.done() or self.has_warned or self._count_threads():
            return
        note(
            f"{spell_arguments(self.place)}: no workers are left; waiting for new "
            f"ones ('dask worker {self.address}')"
        )
        self.has_warned = True

    def failure(self, error: Exception) -> Exception:
        name = type(error).__name__
        if name == "KilledWorker":
            meaning = (
                "workers were ended repeatedly during the same task: out of memory?"
            )
        elif name in CONNECTION_ERRORS:
            meaning = "the scheduler or the connection to it was lost"
        else:
            meaning = f"{name}: {formatted(str(error), 120)}"
        return RuntimeError(f"{spell_arguments(self.place)}: {meaning}")

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self.client.close(timeout=WAIT)


def _import_distributed():
    try:
        import distributed
    except ImportError as error:
        raise Refusal(
            f"``scheduler`` needs the package distributed ({error})",
            instead="pip install 'geomech[distributed]'",
        ) from None
    return distributed


def _version_and_back_end() -> tuple[str, str]:
    """Return version and back end of a worker."""
    return VERSION, fastest()
