"""Kernels that were built ahead of time, for laws in closed form.

A wheel that is built with them (`.ci/release`) solves balances at compiled speed
without numba. They are for processors with the instructions AVX2 and FMA
(x86-64-v3)."""

from __future__ import annotations

import functools
import importlib
import importlib.util
from collections.abc import Callable
from types import ModuleType

from rft.core.notes import warn
from rft.laws.records import Terms

NAME = "rft.balance._kernels"
INSTRUCTIONS = ("AVX2", "FMA3")


@functools.cache
def library() -> ModuleType | None:
    """Return the module of kernels; None if there is none for this processor, or, with
    a `Note`, if it does not load."""
    if importlib.util.find_spec(NAME) is None or not _can_run():
        return None
    try:
        return importlib.import_module(NAME)
    except ImportError as error:
        reason = str(error).splitlines()[0]
        warn(
            f"the compiled balances of this wheel do not load: {reason}; slower code "
            "computes the same: install the wheel for this version of Python"
        )
        return None


def has(Law: type) -> bool:
    """Return whether there are kernels for a class of law records."""
    return Law is Terms and library() is not None


def element_kernel(formula: Callable) -> Callable | None:
    """Return the kernel of an effect's formula of one element; None if there is
    none."""
    if not formula.__module__.startswith("rft.formulas."):
        return None
    return getattr(library(), formula.__name__, None)


def _can_run() -> bool:
    """Return whether the processor has the instructions, as NumPy found out."""
    for name in ("numpy._core", "numpy.core"):  # of NumPy 2, and 1
        if importlib.util.find_spec(name) is not None:
            core = importlib.import_module(f"{name}._multiarray_umath")
            found = getattr(core, "__cpu_features__", {})
            return all(found.get(x, False) for x in INSTRUCTIONS)
    return False
