"""Memory and threads of the solver: freed memory that is not returned, and samples
shared between threads."""

from __future__ import annotations

import _thread
import contextlib
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from queue import SimpleQueue

import numpy as np

NEVER = threading.Event()
POLL_INTERVAL = 1e-3  # s, between looks whether threads that were stopped have ended
LARGE_BLOCK = 2**24  # bytes; glibc adapts to blocks of up to 32 MB


def keep_freed_memory() -> None:
    """Make glibc keep freed memory, by freeing a large block once.

    Until then it returns freed memory to the system, page by page; afterwards it keeps
    up to twice that much for the next temporaries. This halves the solver's time on
    Linux and does nothing elsewhere."""
    np.empty(LARGE_BLOCK, np.uint8)


def cores() -> int:
    """Return the number of cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


_one: ContextVar[bool] = ContextVar("one thread", default=False)


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let the solver take one thread in the body of the statement, where other
    processes use the other cores."""
    token = _one.set(True)
    try:
        yield
    finally:
        _one.reset(token)


def thread_count(allowed: int | None, useful: int) -> int:
    """Return the number of threads to take: at most ``useful``, and at most
    ``allowed``, by default one a core."""
    if useful < 2 or _one.get():
        return 1
    return max(1, min(allowed or cores(), useful))


def split(samples: np.ndarray, count: int) -> list[np.ndarray]:
    """Return ``count`` shares of the samples."""
    if count < 2:
        return [samples]
    return np.array_split(samples, count)


def run_shares(function: Callable, shares: list) -> None:
    """Call function(share, stop) for all shares, each in a thread of its own; NumPy and
    compiled code release the interpreter.

    An exception in this thread, such as one raised by a signal, sets ``stop``, and the
    functions return after their next step. Threads are started by `_thread` and report
    to a queue whose lock no signal leaves locked: a signal that arrives inside
    `concurrent.futures` may leave its threads waiting for ever."""
    if len(shares) == 1:
        return function(shares[0], NEVER)
    stop = threading.Event()
    results = SimpleQueue()
    started = 0
    ended = []
    try:
        for share in shares:
            _thread.start_new_thread(_run, (function, share, stop, results, ended))
            started += 1
        for _ in shares:
            error = results.get()
            if error is not None:
                raise error
    except BaseException:
        stop.set()
        # Not counted by results: a signal may arrive between a `get` and its
        # assignment.
        while len(ended) < started:
            time.sleep(POLL_INTERVAL)
        raise


def _run(
    function: Callable, share, stop: threading.Event, results: SimpleQueue, ended: list
) -> None:
    try:
        function(share, stop)
        results.put(None)
    except BaseException as error:
        results.put(error)
    finally:
        ended.append(share)
