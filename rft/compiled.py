"""Making the compiled code of `rft.lanes`, once for an installation."""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
from pathlib import Path

SOURCES = [Path(__file__).with_name(f"{name}.py") for name in ("lanes", "lane_nets", "lane_loads", "loads")]
STAMP = hashlib.sha256(b"".join(source.read_bytes() for source in SOURCES)).hexdigest()[:16]


def _mark() -> tuple[Path, str]:
    """A file beside the compiled code, and what stands in it if the code is that of these sources, on this machine."""
    import llvmlite.binding
    import numba

    from rft.lanes import attempt

    name = f"lanes.{sys.implementation.cache_tag}.made"
    parts = STAMP, os.stat(SOURCES[0]).st_mtime, numba.__version__, llvmlite.binding.get_host_cpu_name()
    return Path(attempt.stats.cache_path or os.devnull) / name, " ".join(map(str, parts))


def made() -> bool:
    """Whether the compiled code lies ready on this machine. Imports numba."""
    file, text = _mark()
    try:
        return file.read_text() == text
    except OSError:
        return False


def make(nice: int = 0) -> bool:
    """Compile what is not compiled yet, and tell whether it is kept. nice: how much this process's priority falls."""
    from rft import CATALOGUE, Chain, body_velocity

    if nice and hasattr(os, "nice"):
        os.nice(nice)
    if not made():
        body_velocity(CATALOGUE["glass-0.3mm-loose"].medium, Chain(), (1.0, 1.0), (1.0, 1.0), backend="numba")
        file, text = _mark()
        with contextlib.suppress(OSError):  # no folder that may be written
            file.write_text(text)
    return made()


def folder() -> Path:
    """Where it is kept."""
    return _mark()[0].parent
