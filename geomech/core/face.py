"""Methods of values that take layers above them: how a notebook shows a value, how it is converted and loaded.

Such a method calls the function that `implementation` returns; `geomech.face`, imported with the package, names it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_functions: dict[str, Callable[..., Any]] = {}  # by method, such as "Field.to_xarray"


def implements(method: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that makes a function the implementation of a method, such as "Field.to_xarray"."""
    return lambda function: _functions.setdefault(method, function)


def implementation(method: str) -> Callable[..., Any]:
    """Return the function that implements a method."""
    return _functions[method]
