"""Listeners to the solver: functions called whenever force balances are solved, to
count or time them, or to stop by raising."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar

Listener = Callable[
    [int, int, bool], None
]  # samples, places of each where the law is evaluated, whether it is linear


def no_listener(samples: int, points: int, linear: bool) -> None:
    """Hear nothing."""


_listener: ContextVar[Listener] = ContextVar("listener", default=no_listener)


def listener() -> Listener:
    """Return the listener; threads of the solver do not inherit it."""
    return _listener.get()


def listen(new: Listener) -> None:
    """Call ``new`` from here on, in whatever thread balances are solved, once for each
    batch."""
    _listener.set(new)


@contextlib.contextmanager
def listening(new: Listener) -> Iterator[None]:
    """Call ``new`` in the body of the statement."""
    token = _listener.set(new)
    try:
        yield
    finally:
        _listener.reset(token)
