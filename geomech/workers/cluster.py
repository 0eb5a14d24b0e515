"""A Dask cluster, by the address of its scheduler."""

from __future__ import annotations

import contextlib
import logging
import pickle
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future

from geomech.errors import SceneError, short
from geomech.files import note
from geomech.workers.processes import in_order
from geomech.workers.solving import VERSION, at_hand
from geomech.workers.task import Order, opened, perform

WAIT = 3.0  # s for the scheduler to answer, and for a first worker
AHEAD = 4  # parts for each thread of the workers, that are given out before the oldest is back
SEEN = 10.0  # s after which workers are counted again: they may come and go


class Cluster:
    """The workers of one scheduler; one that is lost gets its parts to others, by Dask."""

    remote = True

    def __init__(self, address: str):
        self.address, self.place = address, f"--scheduler {address}"
        self.client = self._connected(_distributed())
        self.seen, self.threads, self.waited = -SEEN, 0, False
        try:
            self._check()
        except BaseException:
            self.close()
            raise

    def _connected(self, distributed):
        """The client; SceneError if nothing answers, or something else does that says nothing."""
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what is wrong is said in a line
        asked: Future = Future()
        threading.Thread(target=self._ask, args=(distributed, asked), daemon=True).start()
        try:
            return asked.result(2 * WAIT)
        except Exception as error:
            why = "nothing answers there" if isinstance(error, OSError) else short(str(error), 120)
            raise SceneError(
                f"{self.place}: {why}: give the address of a Dask scheduler, such as tcp://127.0.0.1:8786, that runs "
                "('dask scheduler'), or leave it out"
            ) from None

    def _ask(self, distributed, asked: Future) -> None:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of versions that differ: `_check` tells of what matters
                distributed.comm.resolve_address(self.address)  # a client of what is none complains when it is gone
                asked.set_result(distributed.Client(self.address, timeout=WAIT, set_as_default=False))
        except Exception as error:
            asked.set_exception(error)

    def _check(self) -> None:
        """SceneError unless there are workers, all with this code."""
        until = time.monotonic() + WAIT
        while not self.count():
            if time.monotonic() > until:
                raise SceneError(f"{self.place}: it has no workers: start some ('dask worker {self.address}')")
            time.sleep(0.05)
        try:
            found = self.client.run(_probe)
        except Exception as error:
            raise SceneError(
                f"{self.place}: its workers cannot load geomech ({short(str(error), 120)}): install it there"
            ) from None
        for worker, (version, _) in found.items():
            if version != VERSION:
                raise SceneError(f"{self.place}: the worker {worker} has {version}, this command {VERSION}: {SAME}")
        self.backends = {at_hand for _, at_hand in found.values()}

    def count(self) -> int:
        """Threads of all workers."""
        if time.monotonic() > self.seen + SEEN or not self.threads:
            self.threads, self.seen = sum(self._lost(self.client.nthreads).values()), time.monotonic()
        return self.threads

    def wait(self) -> None:
        """Tell, once, that all workers are gone; others may come."""
        if not self.waited:
            note(f"{self.place}: no workers are left: waiting for others ('dask worker {self.address}')")
        self.waited = True

    def has(self) -> str:
        return "numba" if self.backends == {"numba"} else "numpy"

    def each(self, order: Order, items: Iterable) -> Iterator:
        told: set = set()
        submit = lambda item: _Part(
            self, self._lost(self.client.submit, perform, order, pickle.dumps(item), pure=False)
        )
        with contextlib.closing(in_order(submit, items, lambda: max(2, AHEAD * self.count()))) as outcomes:
            for outcome in outcomes:
                yield opened(outcome, told)

    def _lost(self, f: Callable, *args, **options):
        """f(...), or RuntimeError that says what an error of Dask's own means."""
        try:
            return f(*args, **options)
        except TimeoutError:
            raise
        except Exception as error:
            raise RuntimeError(f"{self.place}: {_meaning(error)}") from error

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self.client.close(timeout=WAIT)


SAME = "install the same there"


class _Part:
    """One that is under way: a future that says so when nobody is left to do it."""

    def __init__(self, crew: Cluster, future):
        self.crew, self.future = crew, future

    def cancel(self) -> None:
        with contextlib.suppress(Exception):  # the connection may be gone
            self.future.cancel()

    def result(self) -> bytes:
        while True:
            try:
                return self.crew._lost(self.future.result, timeout=SEEN)
            except TimeoutError:
                if not self.future.done() and not self.crew.count():
                    self.crew.wait()


def _distributed():
    try:
        import distributed
    except ImportError as error:
        raise SceneError(
            f"--scheduler takes the package distributed ({error}): pip install 'geomech[distributed]'"
        ) from None
    return distributed


def _probe() -> tuple[str, str]:
    """(version, back end) of a worker."""
    return VERSION, at_hand()


def _meaning(error: Exception) -> str:
    """What an error of Dask's own means."""
    name = type(error).__name__
    if name == "KilledWorker":
        return "workers were ended again and again at the same part: out of memory?"
    if name in ("CancelledError", "FutureCancelledError", "CommClosedError", "ClosedClientError"):
        return "the scheduler, or the connection to it, was lost"
    return f"{name}: {short(str(error), 120)}"
