"""Making the compiled code of `rft.lanes`, once for an installation; `rft.lane_cache` keeps it."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

SOURCES = [Path(__file__).with_name(f"{name}.py") for name in ("lanes", "lane_nets", "lane_loads", "loads")]
STAMP = hashlib.sha256(b"".join(source.read_bytes() for source in SOURCES)).hexdigest()[:16]


class Note(UserWarning):
    """Something beside the computing that went wrong and is made good; on the command line a line on standard error."""


def _file():
    """Return the `rft.lane_cache.CodeFile` of the compiled code; None if no folder can be written. Imports numba."""
    from rft.lanes import attempt

    return getattr(getattr(attempt, "_cache", None), "file", None)


def made() -> bool:
    """Return whether the compiled code of these sources lies ready, undamaged, for this machine. Imports numba."""
    file = _file()
    return file is not None and file.read() is not None


def make(nice: int = 0) -> bool:
    """Compile what is not compiled yet, and return whether it is kept. nice: how much this process's priority falls."""
    from rft import CATALOGUE, Chain, body_velocity

    if nice and hasattr(os, "nice"):
        os.nice(nice)
    if not made():
        body_velocity(CATALOGUE["glass-0.3mm-loose"].medium, Chain(), (1.0, 1.0), (1.0, 1.0), backend="numba")
    return made()


def folder() -> Path | None:
    """Return where it is kept."""
    file = _file()
    return file and file.path.parent
