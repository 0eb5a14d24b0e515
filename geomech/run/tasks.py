"""One task as it is sent to a process that has not loaded anything yet, and its outcome."""

from __future__ import annotations

import contextlib
import functools
import importlib
import pickle
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from geomech.run.backend import VERSION, one_thread, preferring
from rft.core.refusal import Refusal


class Order(NamedTuple):
    """Data common to all tasks of a request.

    version: of the code. back_end: that "auto" stands for. plugins: (name, text) of plug-in files. classes: (module,
    name) of registered classes. work: the pickled function and its common argument, which need these classes."""

    version: str
    back_end: str
    plugins: tuple[tuple[str, str], ...]
    classes: tuple[tuple[str, str], ...]
    work: bytes


class Outcome(NamedTuple):
    """Result of a task: value, or the error that was raised and its traceback (where); notes: warnings (text, category,
    file, line)."""

    value: Any
    error: BaseException | None
    where: str
    notes: tuple


class Alone(Exception):
    """A task that other processes cannot compute, and why. worth_saying: False for a function defined inside another."""

    def __init__(self, text: str, worth_saying: bool = False):
        super().__init__(text)
        self.worth_saying = worth_saying


def packed(task: Callable, common: Any, back_end: str) -> Order:
    """Return the order of a task; `Alone` for one that no other process could load."""
    from geomech.scenes import kinds

    classes = kinds.registered()
    if own := [
        name for module, name in classes if module == "__main__" or "<locals>" in name
    ]:
        raise Alone(
            f"the class {own[0]} is of the program that runs, or of a function in it",
            True,
        )
    try:
        work = pickle.dumps((task, common))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise Alone(str(error)) from None
    if b"__main__" in work:
        raise Alone("it has to do with the program that runs", True)
    return Order(VERSION, back_end, kinds.files(), classes, work)


def compute_here(
    task: Callable, common: Any, item: Any, back_end: str, one_of_many: bool = True
) -> Any:
    """Return task(common, item), computed as in a worker; the only task of a request may use all threads."""
    with (
        one_thread() if one_of_many else contextlib.nullcontext(),
        preferring(back_end),
    ):
        return task(common, item)


@functools.lru_cache(maxsize=4)
def _known(order: Order) -> tuple[Callable, Any]:
    """Return (task, common), after registering all classes that they need."""
    if order.version != VERSION:
        raise Refusal(
            f"a worker has {VERSION}, this command {order.version}",
            instead="install the same there",
        )
    if order.plugins or order.classes:
        _learn(order)
    return pickle.loads(order.work)


def _learn(order: Order) -> None:
    """Register the classes of plug-ins."""
    from geomech.scenes import kinds

    for name, text in order.plugins:
        kinds.load_text(name, text)
    for module, name in order.classes:
        kinds.register(
            functools.reduce(getattr, name.split("."), importlib.import_module(module))
        )


def perform(order: Order, item: bytes) -> bytes:
    """Return the `Outcome` of a task, pickled; errors are raised where the command runs."""
    value, error, where = None, None, ""
    with _noted() as notes:
        try:
            task, common = _known(order)
            value = compute_here(task, common, pickle.loads(item), order.back_end)
        except Exception as raised:
            error, where = _sendable(raised), traceback.format_exc()
    notes = tuple(
        (str(w.message.args[0]), w.category, w.filename, w.lineno) for w in notes or ()
    )
    return pickle.dumps(Outcome(value, error, where, notes))


def _sendable(error: Exception) -> Exception:
    """Return the error, or its text where its class cannot be sent."""
    try:
        pickle.loads(pickle.dumps(error))
        return error
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")


@contextlib.contextmanager
def _noted() -> Iterator[list | None]:
    """Record warnings; None in a process with other work (a thread of Dask's), whose filters must not change."""
    if not getattr(sys, "geomech_worker", False):
        yield None
        return
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        yield notes


def opened(outcome: bytes, warned: set) -> Any:
    """Return the value of an outcome; raise and warn as the task did. warned: warnings already passed on."""
    value, error, where, notes = pickle.loads(outcome)
    for text, category, file, line in notes:
        if (text, category) not in warned:
            warned.add((text, category))
            warnings.warn_explicit(text, category, file, line)
    if error is not None:
        raise error from Elsewhere(where)
    return value


class Elsewhere(Exception):
    """Traceback of an error that was raised in a worker."""
