"""Results in words: a kind of result has a module of its name.

Its ``text(result)`` returns lines for a reader, ``numbers(result)`` the JSON, and of a calibration ``medium(result)`` a file
that scenes take."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from geomech.core.variables import Result


def text(result: Result) -> str:
    """Return a result as lines."""
    return _module(result).text(result)


def numbers(result: Result) -> dict[str, Any]:
    """Return a result as plain numbers, for JSON."""
    return _module(result).numbers(result)


def medium(result: Result) -> str:
    """Return the medium that a calibration found, as TOML."""
    return _module(result).medium(result)


def _module(result: Result) -> Any:
    return import_module(f"geomech.text.{result.kind}")


__all__ = ["medium", "numbers", "text"]


def __dir__() -> list[str]:
    return __all__
