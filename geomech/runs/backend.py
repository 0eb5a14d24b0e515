"""The back end of a request: compiled code where the number of balances is worth its
start and all workers have it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar

from geomech.core import version
from rft import SOLVER
from rft.balance import backend
from rft.balance.backend import at_once, prefer, preferred, preferring
from rft.balance.listening import listen, listener, no_listener
from rft.core.threads import cores, one_thread

__all__ = [
    "BACKENDS",
    "VERSION",
    "at_most",
    "at_once",
    "cores",
    "fastest",
    "listen",
    "listener",
    "no_listener",
    "one_thread",
    "prefer",
    "prefer_backend",
    "prefer_for",
    "preferred",
    "preferring",
]

VERSION = f"geomech {version.VERSION}, solver {SOLVER}"
BACKENDS = ("numpy", "built", "numba")  # slowest first
# Seconds of balances by NumPy, as `geomech.runs.cost` assumes them, about as long as
# compiled code takes to load.
WORTH_LOADING = 1.5

_limit: ContextVar[str] = ContextVar("limit", default="numba")


def fastest() -> str:
    """Return the fastest back end that a request may take."""
    return min(backend.fastest(), _limit.get(), key=BACKENDS.index)


@contextlib.contextmanager
def at_most(name: str) -> Iterator[None]:
    """Use no back end faster than this one in the body of the statement."""
    token = _limit.set(min(name, fastest(), key=BACKENDS.index))
    try:
        with preferring(min(preferred(), fastest(), key=BACKENDS.index)):
            yield
    finally:
        _limit.reset(token)


def prefer_backend(numpy_seconds: float) -> contextlib.AbstractContextManager[None]:
    """Let "auto" be the fastest back end in the body of the statement if balances that
    are assumed to take NumPy so long are worth its start."""
    if numpy_seconds < WORTH_LOADING:
        return preferring("")
    return preferring(fastest())


def prefer_for(numpy_seconds: float) -> None:
    """Let "auto" be the fastest back end from here on if balances that are assumed to
    take NumPy so long are worth its start."""
    if numpy_seconds >= WORTH_LOADING:
        prefer(fastest())
