"""Who is told of force balances as they are solved: to count them, to time them, or to stop by what is raised."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar

Listener = Callable[[int, int, bool], None]  # samples, places of each where the law is evaluated, whether it is linear


def nobody(samples: int, points: int, linear: bool) -> None:
    """Hear nothing."""


_listener: ContextVar[Listener] = ContextVar("listener", default=nobody)


def listener() -> Listener:
    """Return who is told; threads of the solver do not know it by themselves."""
    return _listener.get()


def listen(some: Listener) -> None:
    """Let ``some`` be told from here on, in whatever thread balances are solved; each is told of once."""
    _listener.set(some)


@contextlib.contextmanager
def listening(some: Listener) -> Iterator[None]:
    """Let ``some`` be told in the body of the statement."""
    token = _listener.set(some)
    try:
        yield
    finally:
        _listener.reset(token)
