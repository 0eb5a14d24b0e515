"""Work beside the computing, such as the drawing of pictures: in a copy of this process, which leaves files and no more."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterator

from geomech.workers import alone, keeping, shared

COPIES = sys.platform == "linux"  # elsewhere frameworks of the system do not outlive a fork, or there is none


@contextlib.contextmanager
def aside() -> Iterator[Callable[[Callable[[], None]], None]]:
    """A function that calls another in a copy of this process as it stands, or here and now where one process is to do all.
    A copy has no workers, and nothing that it computes is kept by itself. At the end of the statement all copies have done,
    and what one raised is raised; none outlives it."""
    copies: dict[int, int] = {}  # where each tells how it ended, by its id

    def beside(call: Callable[[], None]) -> None:
        if COPIES and shared():
            _copied(call, copies)
        else:
            with keeping(None):
                call()

    try:
        yield beside
        for told in copies.values():
            _heard(told)
    finally:
        for copy, told in copies.items():
            with contextlib.suppress(ProcessLookupError):
                os.kill(copy, signal.SIGKILL)
            os.waitpid(copy, 0)
            os.close(told)


def _copied(call: Callable[[], None], copies: dict[int, int]) -> None:
    told, tell = os.pipe()
    for stream in filter(None, (sys.stdout, sys.stderr)):
        stream.flush()  # else the copy has its letters, too
    if copy := os.fork():
        os.close(tell)
        copies[copy] = told
        return
    try:
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # which the one it is a copy of hears, and ends it
            signal.signal(getattr(signal, name), signal.SIG_IGN)
        with alone():  # those who ask the workers are threads, of which a copy has none
            os.write(tell, _end_of(call))
    finally:
        os._exit(0)


def _end_of(call: Callable[[], None]) -> bytes:
    """How it ended, pickled: None, or what it raised."""
    try:
        call()
        return pickle.dumps(None)
    except BaseException as error:
        try:
            return pickle.dumps(error)
        except Exception:
            return pickle.dumps(RuntimeError(str(error)))


def _heard(told: int) -> None:
    with open(told, "rb", closefd=False) as pipe:
        said = pipe.read()
    if not said:
        raise RuntimeError("what draws beside the computing was killed: the same with --workers 1 draws in its turn")
    if (error := pickle.loads(said)) is not None:
        raise error
