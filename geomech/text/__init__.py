"""Results in words: a kind of result has a module of its name.

Its ``text(result)`` returns lines for a reader, which fit a screen, and ``full(result)`` all of them where there are
more; ``MORE`` says so in words. ``numbers(result)`` is the JSON."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from geomech.core.variables import Result


def text(result: Result) -> str:
    """Return a result as lines that fit a screen."""
    return _module(result).text(result)


def full(result: Result) -> str:
    """Return everything of a result as lines."""
    module = _module(result)
    return getattr(module, "full", module.text)(result)


def more(result: Result) -> str:
    """Return in words what `text` leaves out; "" for nothing."""
    return getattr(_module(result), "MORE", "")


def numbers(result: Result) -> dict[str, Any]:
    """Return a result as plain numbers, for JSON."""
    return _module(result).numbers(result)


def _module(result: Result) -> Any:
    return import_module(f"geomech.text.{result.kind}")


__all__ = ["numbers", "text"]


def __dir__() -> list[str]:
    return __all__
