"""Methods of values that need the layers above them: display in notebooks, conversion,
loading.

Such a method calls the function that `implementation` returns. `geomech.shell.face`,
imported with the package, registers these functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_functions: dict[str, Callable[..., Any]] = {}  # by method, such as "Field.to_xarray"


def implements(method: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that makes a function the implementation of a method, such as
    "Field.to_xarray"."""

    def register(function):
        return _functions.setdefault(method, function)

    return register


def implementation(method: str) -> Callable[..., Any]:
    """Return the function that implements a method."""
    return _functions[method]
