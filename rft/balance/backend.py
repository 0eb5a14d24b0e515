"""The choice of the driver that solves balances of forces: compiled code, or NumPy by
the same formulas.

"auto" is compiled code where numba is installed, or where kernels were built ahead of
time (`rft.balance.ahead`), else NumPy. A caller with little to compute may prefer what
needs no loading (`preferring`, `at_once`): numba takes half a second. Neither a clock
nor the state of a cache decides. `python -m rft` compiles
beforehand."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Any

from rft.balance import ahead
from rft.core.refusal import Refusal, require
from rft.effects.base import Effect
from rft.formulas.vectors import is_formula
from rft.laws.records import is_compilable

BACKENDS = ("auto", "numpy", "numba")


def check(backend: str) -> None:
    """Raise ValueError unless a back end exists and is installed."""
    if not (isinstance(backend, str) and backend in BACKENDS):
        raise Refusal(f"backend must be one of {', '.join(BACKENDS)}", value=backend)
    require(
        backend != "numba" or fastest() != "numpy",
        "backend = 'numba' needs numba",
        instead="pip install 'geomech[fast]', or use 'auto'",
    )


@functools.cache
def installed() -> bool:
    """Return whether numba is installed."""
    return importlib.util.find_spec("numba") is not None


_preferred: ContextVar[str] = ContextVar("preferred", default="")


@contextlib.contextmanager
def preferring(backend: str) -> Iterator[None]:
    """Let "auto" be this back end in the body of the statement; "" changes nothing."""
    token = _preferred.set(backend or _preferred.get())
    try:
        yield
    finally:
        _preferred.reset(token)


def prefer(backend: str) -> None:
    """Let "auto" be this back end from now on."""
    _preferred.set(backend)


def at_once() -> str:
    """Return the fastest back end that needs no loading: "built", which solves balances
    by kernels where there are some and else by NumPy, or "numpy"."""
    return "numpy" if ahead.library() is None else "built"


def fastest() -> str:
    """Return the fastest back end for many balances: "numba" where it is installed,
    else `at_once`."""
    return "numba" if installed() else at_once()


def preferred() -> str:
    """Return the back end that "auto" stands for."""
    return _preferred.get() or fastest()


def compiles(backend: str, law) -> bool:
    """Return whether numba compiles what is computed by a law, given by its record."""
    if backend == "auto":
        backend = preferred()
    return backend == "numba" and installed() and is_compilable(law)


def solves_compiled(backend: str, law) -> bool:
    """Return whether compiled code solves the balances of a law, given by its record:
    that of numba, or kernels built ahead of time."""
    if backend == "auto":
        backend = preferred()
    if backend != "numpy" and ahead.has(type(law)):
        return True
    return compiles(backend, law)


def updates_compiled(backend: str, effect: Effect, law: Any) -> bool:
    """Return whether compiled code computes an effect's formula of one element, beside
    balances of a law, given by its record."""
    formula = effect.element_update
    if not is_formula(formula) or type(effect).after is not Effect.after:
        return False
    if ahead.element_kernel(formula) is not None:
        return solves_compiled(backend, law)
    return compiles(backend, law)
