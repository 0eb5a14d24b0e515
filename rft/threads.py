"""The machine below the solver: memory that is kept, and samples shared out to threads."""

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
AGAIN = 1e-3  # s after which one that is stopped looks whether its threads have ended
LARGE_BLOCK = 2**24  # bytes; glibc learns from blocks of up to 32 MB


def keep_freed_memory() -> None:
    """Let glibc see a large block freed: until then it hands freed memory back to the system, page by page; from then
    on it keeps up to twice that much for the next temporaries. Half the solver's time on Linux, nothing elsewhere."""
    np.empty(LARGE_BLOCK, np.uint8)


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


_one: ContextVar[bool] = ContextVar("one thread", default=False)


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """In the body of the statement the solver takes one thread: its neighbours have the other cores."""
    token = _one.set(True)
    try:
        yield
    finally:
        _one.reset(token)


def is_one_thread() -> bool:
    """Whether it is told to."""
    return _one.get()


def workers(threads: int | None, useful: int) -> int:
    """How many threads to take of those allowed, by default one a core."""
    return 1 if useful < 2 or _one.get() else max(1, min(threads or cores(), useful))


def split(samples: np.ndarray, count: int) -> list[np.ndarray]:
    """So many shares of the samples."""
    return np.array_split(samples, count) if count > 1 else [samples]


def each(f: Callable, shares: list) -> None:
    """f(share, stop) of each share, side by side: NumPy lets go of the interpreter inside its loops. What is raised
    here, by a signal among others, sets ``stop``, so that no share goes on for more than a step.

    Threads by hand, and a queue whose lock no signal leaves held: one that arrives inside of `concurrent.futures` may
    leave its threads to wait for ever."""
    if len(shares) == 1:
        return f(shares[0], NEVER)
    stop, ended, begun, over = threading.Event(), SimpleQueue(), 0, []
    try:
        for share in shares:
            _thread.start_new_thread(_told, (f, share, stop, ended, over))
            begun += 1
        for _ in shares:
            error = ended.get()
            if error is not None:
                raise error
    except BaseException:
        stop.set()
        while len(over) < begun:  # a signal may have come between what a thread said and our hearing it
            time.sleep(AGAIN)
        raise


def _told(f: Callable, share, stop: threading.Event, ended: SimpleQueue, over: list) -> None:
    try:
        f(share, stop)
        ended.put(None)
    except BaseException as error:
        ended.put(error)
    finally:
        over.append(share)
