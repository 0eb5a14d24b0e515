"""One task as it is sent to a process that has not loaded anything yet, and its
outcome."""

from __future__ import annotations

import contextlib
import functools
import importlib
import pickle
import sys
import traceback
import typing
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from geomech.runs.backend import VERSION, one_thread, preferring
from geomech.runs.threads import one_blas_thread
from geomech.scenes import kinds
from rft.core.notes import Note, warn
from rft.core.refusal import Refusal


class TaskPayload(NamedTuple):
    """Data common to all tasks of a request.

    version: of the code. back_end: that "auto" stands for. plugins: (name, text) of
    plug-in files. classes: (module, name) of registered classes. work: the pickled
    function and its common argument, which need these classes."""

    version: str
    back_end: str
    plugins: tuple[tuple[str, str], ...]
    classes: tuple[tuple[str, str], ...]
    work: bytes


class Outcome(NamedTuple):
    """Result of a task: its value, or the error that was raised and its traceback.

    notes: warnings (text, category, file, line)."""

    value: Any
    error: BaseException | None
    traceback: str
    notes: tuple


class NotPicklable(Exception):
    """A task that other processes cannot load, and the reason.

    is_told: whether the user hears of it; False for a function defined inside
    another."""

    def __init__(self, reason: str, is_told: bool = False):
        super().__init__(reason)
        self.is_told = is_told


class WorkerTraceback(Exception):
    """Traceback of an error that was raised in a worker."""


@functools.cache
def result_type(task: Callable) -> Any:
    """Return the declared type of a task's result."""
    return typing.get_type_hints(task).get("return", Any)


def pack(task: Callable, common: Any, back_end: str) -> TaskPayload:
    """Return the payload of a task; `NotPicklable` if no other process could load
    it."""
    classes = kinds.registered()
    for module, name in classes:
        if module == "__main__" or "<locals>" in name:
            raise NotPicklable(
                f"the class {name} is defined in the script that runs, or inside "
                "one of its functions",
                is_told=True,
            )
    try:
        work = pickle.dumps((task, common))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise NotPicklable(str(error)) from None
    if b"__main__" in work:
        raise NotPicklable("it depends on the script that runs", is_told=True)
    return TaskPayload(VERSION, back_end, kinds.files(), classes, work)


def compute(
    task: Callable, common: Any, item: Any, back_end: str, one_of_many: bool = True
) -> Any:
    """Return task(common, item), computed as in a worker. The solver may use all
    threads for the only task of a request, and BLAS never more than one."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(one_blas_thread())
        if one_of_many:
            stack.enter_context(one_thread())
        stack.enter_context(preferring(back_end))
        return task(common, item)


@functools.lru_cache(maxsize=4)
def load_task(payload: TaskPayload) -> tuple[Callable, Any]:
    """Return (task, common), after registering all classes that they need."""
    if payload.version != VERSION:
        raise Refusal(
            f"a worker has {VERSION}, this command {payload.version}",
            instead="install the same version there",
        )
    if payload.plugins or payload.classes:
        register_plugins(payload)
    return pickle.loads(payload.work)


def register_plugins(payload: TaskPayload) -> None:
    """Register the classes of plug-ins."""
    for name, text in payload.plugins:
        kinds.load_text(name, text)
    for module, name in payload.classes:
        path = name.split(".")
        kinds.register(functools.reduce(getattr, path, importlib.import_module(module)))


def perform(payload: TaskPayload, item: bytes) -> bytes:
    """Return the `Outcome` of a task, pickled; errors are raised where the command
    runs."""
    value = None
    error = None
    where = ""
    with _record_warnings() as caught:
        try:
            task, common = load_task(payload)
            value = compute(task, common, pickle.loads(item), payload.back_end)
        except Exception as raised:
            error = _picklable(raised)
            where = traceback.format_exc()
    notes = []
    for warning in caught:
        text = str(warning.message.args[0])
        notes.append((text, warning.category, warning.filename, warning.lineno))
    return pickle.dumps(Outcome(value, error, where, tuple(notes)))


def _picklable(error: Exception) -> Exception:
    """Return the error, or its text where its class cannot be sent."""
    try:
        pickle.loads(pickle.dumps(error))
        return error
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")


@contextlib.contextmanager
def _record_warnings() -> Iterator[list]:
    """Yield the list of warnings that the body of the statement gives; it stays empty
    in a process with other work (a thread of Dask's), whose filters must not change."""
    if not getattr(sys, "geomech_worker", False):
        yield []
        return
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield caught


def unpack_outcome(raw: bytes, warned: set) -> Any:
    """Return the value of a pickled outcome; raise and warn as the task did.

    warned: warnings that were passed on before; it is added to."""
    outcome = pickle.loads(raw)
    for text, category, file, line in outcome.notes:
        if (text, category) not in warned:
            warned.add((text, category))
            if issubclass(category, Note):  # a worker has no line of the caller
                warn(text, category)
            else:
                warnings.warn_explicit(text, category, file, line)
    if outcome.error is not None:
        raise outcome.error from WorkerTraceback(outcome.traceback)
    return outcome.value
