"""Processes that do not load the program that starts them, which so needs no guard, and that end with it."""

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

from geomech.run import BELOW

UNHEARD = [
    getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)
]  # the terminal's signals


def pool(count: int) -> ProcessPoolExecutor:
    """Return so many processes, each of one thread of BLAS, that start with the tasks they get."""
    with _environment(
        {"PYTHONWARNINGS": "ignore"}
    ):  # else it warns, after a kill, of the resources that it removes
        resource_tracker.ensure_running()
    return ProcessPoolExecutor(count, Context(), begin)


def begin() -> None:
    """Start a worker: printed text goes to the error stream, and the process ends with its parent, even within a task."""
    sys.geomech_worker = True
    os.dup2(2, 1)
    parent = parent_process()
    threading.Thread(target=lambda: (parent.join(), os._exit(0)), daemon=True).start()


class Process(context.SpawnProcess):
    @staticmethod
    def _Popen(process):
        with _hidden_program(), _unheard_signals():
            return context.SpawnProcess._Popen(process)


class Context(context.SpawnContext):
    Process = Process


@contextlib.contextmanager
def _hidden_program() -> Iterator[None]:
    """Hide the program that runs, which a new process would run again, and let libraries there take one thread."""
    program = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        with _environment(dict.fromkeys(BELOW, "1")):
            yield
    finally:
        sys.modules["__main__"] = program


@contextlib.contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Set variables of the environment, which new processes inherit, in the body of the statement."""
    before = {name: os.environ[name] for name in values if name in os.environ}
    os.environ.update(values)
    try:
        yield
    finally:
        for name in values:
            del os.environ[name]
        os.environ.update(before)


@contextlib.contextmanager
def _unheard_signals() -> Iterator[None]:
    """Block the terminal's signals, as a new process then does from its start to its end."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, UNHEARD)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
