"""Packages whose public names are their modules, each imported at its first use."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterable
from importlib import import_module
from types import ModuleType


def lazy_modules(
    name: str, path: Iterable[str]
) -> tuple[Callable[[str], ModuleType], Callable[[], list[str]]]:
    """Return (__getattr__, __dir__) of a package from its __name__ and __path__."""
    names = sorted(module.name for module in pkgutil.iter_modules(path))

    def get(module: str) -> ModuleType:
        if module not in names:
            raise AttributeError(f"module {name!r} has no attribute {module!r}")
        return import_module(f"{name}.{module}")

    def listed() -> list[str]:
        return names

    return get, listed
