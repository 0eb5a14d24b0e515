"""One part of a large request, as it is sent to a process that may know nothing of it yet."""

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

from geomech.errors import SceneError
from geomech.workers import alone
from geomech.workers.solving import VERSION, modestly


class Order(NamedTuple):
    """What all parts of a request share. version: of the code. settled: what "auto" stands for. plugins: (name, text) of the
    files of one's own. classes: (module, name) of those that were registered. work: the function and what it is given, as
    `pickle` has them, which takes the classes."""

    version: str
    settled: str
    plugins: tuple[tuple[str, str], ...]
    classes: tuple[tuple[str, str], ...]
    work: bytes


class Outcome(NamedTuple):
    """value, or the error that was raised; notes: warnings (text, category, file, line)."""

    value: Any
    error: BaseException | None
    where: str
    notes: tuple


def packed(f: Callable, common: Any, settled: str) -> Order:
    """`Alone` for what no other process could know."""
    from geomech import kinds

    classes = kinds.registered()
    if own := [name for module, name in classes if module == "__main__" or "<locals>" in name]:
        raise Alone(f"the class {own[0]} is of the program that runs, or of a function in it", told=True)
    try:
        work = pickle.dumps((f, common))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise Alone(str(error)) from None
    if b"__main__" in work:
        raise Alone("it has to do with the program that runs", told=True)
    return Order(VERSION, settled, kinds.files(), classes, work)


class Alone(Exception):
    """Other processes cannot compute it, and why. told: worth saying; a function made inside another is not."""

    def __init__(self, text: str, told: bool = False):
        super().__init__(text)
        self.told = told


def here(f: Callable, common: Any, item: Any, settled: str, one_of_many: bool = True) -> Any:
    """f(common, item), computed as anywhere else; what is the only one may take all threads."""
    with alone(), modestly(settled) if one_of_many else contextlib.nullcontext():
        return f(common, item)


@functools.lru_cache(maxsize=4)
def _known(order: Order) -> tuple[Callable, Any]:
    """(f, common), once all that they are made of is known here."""
    if order.version != VERSION:
        raise SceneError(f"a worker has {VERSION}, this command {order.version}: install the same there")
    if order.plugins or order.classes:
        _learn(order)
    return pickle.loads(order.work)


def _learn(order: Order) -> None:
    """What is of one's own."""
    from geomech import kinds

    for name, text in order.plugins:
        kinds.load_text(name, text)
    for module, name in order.classes:
        kinds.register(functools.reduce(getattr, name.split("."), importlib.import_module(module)))


def perform(order: Order, item: bytes) -> bytes:
    """The `Outcome` of a part, all pickled: what goes wrong is told where the command is."""
    value, error, where = None, None, ""
    with _noted() as notes:
        try:
            f, common = _known(order)
            value = here(f, common, pickle.loads(item), order.settled)
        except Exception as raised:
            error, where = _sendable(raised), traceback.format_exc()
    notes = tuple((str(w.message), w.category, w.filename, w.lineno) for w in notes or ())
    return pickle.dumps(Outcome(value, error, where, notes))


def _sendable(error: Exception) -> Exception:
    """The error, or what it says where its class cannot be sent."""
    try:
        pickle.loads(pickle.dumps(error))
        return error
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")


@contextlib.contextmanager
def _noted() -> Iterator[list | None]:
    """Warnings that are raised meanwhile; None in a process that does more than this (a thread of Dask's), whose filters
    are not ours."""
    if not getattr(sys, "geomech_worker", False):
        yield None
        return
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        yield notes


def opened(outcome: bytes, told: set) -> Any:
    """The value of an outcome; raises and warns what the part did. told: what was warned of before."""
    value, error, where, notes = pickle.loads(outcome)
    for text, category, file, line in notes:
        if (text, category) not in told:
            told.add((text, category))
            warnings.warn_explicit(text, category, file, line)
    if error is not None:
        raise error from Elsewhere(where)
    return value


class Elsewhere(Exception):
    """Where in a worker an error was raised."""
