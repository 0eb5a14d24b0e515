"""How the solver works for one of several workers: in one thread, by one back end from the first part to the last."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from geomech import __version__
from rft import SOLVER, backend, in_turn
from rft.workers import cores, one_thread

__all__ = ["SOLVER", "VERSION", "at_hand", "cores", "in_turn", "known", "modestly", "settled", "settled_on"]

VERSION = f"geomech {__version__}, solver {SOLVER}"
at_hand, settled, settled_on = backend.at_hand, backend.settled, backend.settled_on
known = in_turn.known


@contextlib.contextmanager
def modestly(back_end: str) -> Iterator[None]:
    """back_end: what "auto" stands for; nothing if it may choose."""
    with one_thread(), settled(back_end):
        yield
