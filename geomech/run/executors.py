"""Executors: processes of this machine, one per core, or the workers of a Dask cluster."""

from __future__ import annotations

import contextlib
import logging
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future

from geomech.io.files import note
from geomech.run.backend import BACKENDS, VERSION, fastest
from rft.core.refusal import Refusal, formatted, spell_arguments

AHEAD = 4  # tasks for each worker that are submitted before the oldest is back
LONGEST_END = 2.0  # s for a pool to notice that its processes were killed
PATIENCE = 0.2  # s for a pool to drop cancelled tasks
WAIT = 3.0  # s for the scheduler to answer, and for a first worker
SEEN = (
    10.0  # s after which workers of a cluster are counted again: they may come and go
)
SIGNALS = [
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP")
    if hasattr(signal, name)
]


class Processes:
    """A pool of so many processes, started by the first task; when one is ended from outside all are started anew."""

    remote, patience = False, None

    def __init__(self, count: int):
        self.count, self.pool = count, None

    def submit(self, task: Callable, *arguments) -> Future:
        with undisturbed():
            for _ in range(2):
                with contextlib.suppress(BrokenExecutor):
                    return self._at_work().submit(task, *arguments)
                self.pool = None
        raise BrokenExecutor("processes end as soon as they are started")

    def _at_work(self):
        if self.pool is None:
            from geomech.run.spawn import pool

            self.pool = pool(self.count)
        return self.pool

    def ahead(self) -> int:
        return AHEAD * self.count

    def look(self, future: Future) -> None:
        """Do nothing: the pool notices a process that is ended."""

    def failure(self, error: Exception) -> Exception:
        return error

    def close(self) -> None:
        """End all at once, in the middle of a task, too."""
        pool, self.pool = self.pool, None
        if pool is None:
            return
        with undisturbed():
            manager, processes = (
                pool._executor_manager_thread,
                list((pool._processes or {}).values()),
            )
            pool.shutdown(wait=False, cancel_futures=True)
            until = time.monotonic() + PATIENCE
            while (
                manager and _has_cancelled(manager) and time.monotonic() < until
            ):  # cancelled tasks would make it print a traceback
                time.sleep(1e-3)
            for process in processes:
                process.kill()
            if manager:
                manager.join(LONGEST_END)


def _has_cancelled(manager: threading.Thread) -> bool:
    """Return whether the thread that manages a pool still holds tasks that are cancelled."""
    tasks = manager.is_alive() and list(manager.pending_work_items.values())
    return any(task.future.cancelled() for task in tasks or ())


@contextlib.contextmanager
def undisturbed() -> Iterator[None]:
    """Hold signals back in the body of the statement: one that is raised inside of `concurrent.futures` may leave its locks
    held."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {n: signal.getsignal(n) for n in SIGNALS}
    before = {n: handler for n, handler in before.items() if callable(handler)}
    try:
        for n in before:
            signal.signal(n, lambda number, frame: came.append(number))
        yield
    finally:
        for n, handler in before.items():
            signal.signal(n, handler)
        for n in came[:1]:
            signal.raise_signal(n)


class Cluster:
    """The workers of one Dask scheduler. Dask gives the tasks of a lost worker to others."""

    remote = True

    def __init__(self, address: str):
        self.address, self.place = address, f"``scheduler`` {address}"
        self.client = self._connected(_distributed())
        self.seen, self.threads, self.waited = -SEEN, 0, False
        try:
            self.back_end = self._checked()
        except BaseException:
            self.close()
            raise
        self.submit = self.client.get_executor(pure=False).submit

    @property
    def patience(self) -> float:
        return SEEN

    def _connected(self, distributed):
        """Return the client; Refusal if nothing answers, or something else does that says nothing."""
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(
                logging.CRITICAL
            )  # errors are one line here
        answer: Future = Future()
        threading.Thread(
            target=self._connect, args=(distributed, answer), daemon=True
        ).start()
        try:
            return answer.result(2 * WAIT)
        except Exception as error:
            why = (
                "nothing answers there"
                if isinstance(error, OSError)
                else formatted(str(error), 120)
            )
            raise Refusal(
                why,
                where=self.place,
                instead="give the address of a Dask scheduler, such as tcp://127.0.0.1:8786, that runs ('dask "
                "scheduler'), or leave it out",
            ) from None

    def _connect(self, distributed, answer: Future) -> None:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter(
                    "ignore"
                )  # on different versions: `_checked` refuses those that matter
                distributed.comm.resolve_address(
                    self.address
                )  # a client of another server prints an error when it is deleted
                answer.set_result(
                    distributed.Client(self.address, timeout=WAIT, set_as_default=False)
                )
        except Exception as error:
            answer.set_exception(error)

    def _checked(self) -> str:
        """Return the back end that all workers have; Refusal unless there are some, all with this code."""
        until = time.monotonic() + WAIT
        while not self._count():
            if time.monotonic() > until:
                raise Refusal(
                    "it has no workers",
                    where=self.place,
                    instead=f"start some ('dask worker {self.address}')",
                )
            time.sleep(0.05)
        try:
            workers = self.client.run(_probe)
        except Exception as error:
            raise Refusal(
                f"its workers cannot load geomech ({formatted(str(error), 120)})",
                where=self.place,
                instead="install it there",
            ) from None
        for worker, (version, _) in workers.items():
            if version != VERSION:
                raise Refusal(
                    f"the worker {worker} has {version}, this command {VERSION}",
                    where=self.place,
                    instead="install the same there",
                )
        return min((back_end for _, back_end in workers.values()), key=BACKENDS.index)

    def _count(self) -> int:
        """Return the number of threads of all workers."""
        if time.monotonic() > self.seen + SEEN or not self.threads:
            try:
                self.threads, self.seen = (
                    sum(self.client.nthreads().values()),
                    time.monotonic(),
                )
            except Exception as error:
                raise self.failure(error) from error
        return self.threads

    def ahead(self) -> int:
        return max(2, AHEAD * self._count())

    def look(self, future: Future) -> None:
        """Note, once, that all workers are gone; others may come."""
        if not future.done() and not self._count() and not self.waited:
            note(
                f"{spell_arguments(self.place)}: no workers are left: waiting for others ('dask worker {self.address}')"
            )
            self.waited = True

    def failure(self, error: Exception) -> Exception:
        name = type(error).__name__
        if name == "KilledWorker":
            meaning = (
                "workers were ended again and again at the same part: out of memory?"
            )
        elif name in (
            "CancelledError",
            "FutureCancelledError",
            "CommClosedError",
            "ClosedClientError",
        ):
            meaning = "the scheduler, or the connection to it, was lost"
        else:
            meaning = f"{name}: {formatted(str(error), 120)}"
        return RuntimeError(f"{spell_arguments(self.place)}: {meaning}")

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self.client.close(timeout=WAIT)


def _distributed():
    try:
        import distributed
    except ImportError as error:
        raise Refusal(
            f"``scheduler`` takes the package distributed ({error})",
            instead="pip install 'geomech[distributed]'",
        ) from None
    return distributed


def _probe() -> tuple[str, str]:
    """Return version and back end of a worker."""
    return VERSION, fastest()
