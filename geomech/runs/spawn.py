"""Processes that do not load the program that starts them, so that it needs no guard,
and that end with it."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import types
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import context, parent_process, resource_tracker

from geomech.runs import THREAD_VARIABLES

TERMINAL_SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)
]


def pool(count: int) -> ProcessPoolExecutor:
    """Return a pool of ``count`` processes, each with one thread of BLAS, which start
    with the tasks that they get."""
    # After a kill the tracker would warn of the resources that it removes.
    with _environment({"PYTHONWARNINGS": "ignore"}):
        resource_tracker.ensure_running()
    return ProcessPoolExecutor(count, Context(), start_worker)


def start_worker() -> None:
    """Start a worker: printed text goes to the error stream, and the process ends with
    its parent, even within a task."""
    sys.geomech_worker = True
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent_process().join()
    os._exit(0)


class Process(context.SpawnProcess):
    @staticmethod
    def _Popen(process):
        with _hide_program(), _block_terminal_signals():
            return context.SpawnProcess._Popen(process)


class Context(context.SpawnContext):
    Process = Process


@contextlib.contextmanager
def _hide_program() -> Iterator[None]:
    """Hide the program that runs, which a new process would run again, and let
    libraries there take one thread."""
    program = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        with _environment(dict.fromkeys(THREAD_VARIABLES, "1")):
            yield
    finally:
        sys.modules["__main__"] = program


@contextlib.contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set variables of the environment, which new processes inherit, in the body of the
    statement."""
    before = {name: os.environ[name] for name in values if name in os.environ}
    os.environ.update(values)
    try:
        yield
    finally:
        for name in values:
            del os.environ[name]
        os.environ.update(before)


@contextlib.contextmanager
def _block_terminal_signals() -> Iterator[None]:
    """Block the terminal's signals, as a new process then does from its start to its
    end."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, TERMINAL_SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
