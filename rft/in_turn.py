"""What is computed piece after piece, each from where the one before has led, such as the steps of a march: whoever asks may
keep the pieces, and give them back when the same is asked for again.

A piece follows from its start to the last digit, and both are numbers, arrays and tuples of these. How far one goes is
settled by the clock, so that a piece is neither too little to be worth keeping nor too much to be lost.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

LONG_ENOUGH = 2.0  # s of computing that a piece takes, about

Keeper = Callable[[str, Callable[[], Any], Any], Any]  # of `known`'s arguments, the start as it is

_keeper: ContextVar[Keeper | None] = ContextVar("keeper", default=None)


@contextlib.contextmanager
def keeping(keeper: Keeper | None) -> Iterator[None]:
    """In the body of the statement the keeper is asked for every piece; None for none."""
    token = _keeper.set(keeper)
    try:
        yield
    finally:
        _keeper.reset(token)


def known(what: str, compute: Callable[[], Any], start: Callable[[], Any], sure: bool = True) -> Any:
    """compute(), or what it gave before from the same start(). sure: that the same comes out again, to the last digit; else
    nothing is kept."""
    keeper = _keeper.get()
    return compute() if keeper is None or not sure else keeper(what, compute, start())


def piece(step: Callable[[], Any], most: int) -> list:
    """What one step after the other gives, till that took long enough, or is so many."""
    until, found = time.monotonic() + LONG_ENOUGH, [step()]
    while len(found) < most and time.monotonic() < until:
        found.append(step())
    return found
