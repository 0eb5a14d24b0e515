"""Which driver solves the balance of forces: compiled code, or NumPy by the same formulas.

"auto" is compiled code where numba is installed, else NumPy. Whoever has little to compute may prefer NumPy, whose
first call takes half a second less (`preferring`). No clock and no state of a cache decides. `python -m rft` compiles
beforehand."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
from collections.abc import Iterator
from contextvars import ContextVar

from rft.checks import require, shown
from rft.laws.records import is_compilable

BACKENDS = ("auto", "numpy", "numba")


class Note(UserWarning):
    """Something beside the computing that went wrong and is made good; on the command line a line on standard error."""


def check(backend: str) -> None:
    """ValueError for no back end, and for one that is not installed."""
    if not (isinstance(backend, str) and backend in BACKENDS):
        raise ValueError(f"backend must be one of {', '.join(BACKENDS)}, got {shown(backend)}")
    require(
        backend != "numba" or installed(), "backend = 'numba' takes numba: pip install 'geomech[fast]', or take 'auto'"
    )


@functools.cache
def installed() -> bool:
    """Return whether numba is."""
    return importlib.util.find_spec("numba") is not None


_preferred: ContextVar[str] = ContextVar("preferred", default="")


@contextlib.contextmanager
def preferring(backend: str) -> Iterator[None]:
    """Let "auto" be this back end in the body of the statement; "" leaves it as it is."""
    token = _preferred.set(backend or _preferred.get())
    try:
        yield
    finally:
        _preferred.reset(token)


def prefer(backend: str) -> None:
    """Let "auto" be this back end from here on."""
    _preferred.set(backend)


def fastest() -> str:
    """Return the back end for much to compute: "numba" where it is installed, else "numpy"."""
    return "numba" if installed() else "numpy"


def preferred() -> str:
    """Return the back end that "auto" is here."""
    return _preferred.get() or fastest()


def compiles(backend: str, law) -> bool:
    """Return whether the balances of a law, given its record, are solved by compiled code."""
    chosen = preferred() if backend == "auto" else backend
    return chosen == "numba" and installed() and is_compilable(law)
