"""A law fitted to measurements, in lines."""

from __future__ import annotations

from typing import Any

from geomech.core.variables import Result


def numbers(result: Result) -> dict[str, Any]:
    """Return the law's parameters with their errors, and what the fit leaves."""
    return result.subject.numbers()


def text(result: Result) -> str:
    """Return the same in words and a table of residuals."""
    return result.subject.text()
