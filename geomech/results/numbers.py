"""Numbers as text, with as many digits as their errors leave meaning."""

from __future__ import annotations

import math

import numpy as np

SIGNIFICANT = 7  # digits of a number with an error, at most
PLAIN = 6  # digits of a number without an error
MOST_DECIMALS = 9  # of a column; smaller numbers are shown in their shortest form
LEAST = 1e-300  # stands for zero in logarithms


def decimals(values: np.ndarray, errors: np.ndarray | None) -> int | None:
    """Return the decimal places of a column that show two digits of its smallest error;
    None for the shortest form of each number."""
    if errors is None:
        return None
    positive = errors[np.isfinite(errors) & (errors > 0)]
    sizes = np.abs(values[np.isfinite(values)])
    if not positive.size or not sizes.size:
        return None
    by_error = 1 - magnitude(float(positive.min()))
    by_size = SIGNIFICANT - 1 - magnitude(float(sizes.max()))
    places = min(by_error, by_size)
    if places > MOST_DECIMALS:
        return None
    return max(places, 0)


def magnitude(number: float) -> int:
    """Return the power of ten of the first digit of a number > 0."""
    return math.floor(math.log10(max(number, LEAST)))


def number(value: float, places: int | None = None, digits: int = PLAIN) -> str:
    """Return a number with ``places`` decimal places, or with ``digits`` digits in its
    shortest form; "-" for nan."""
    if not math.isfinite(value):
        return "-"
    if places is None or value == 0:
        return f"{value + 0.0:.{digits}g}"
    return f"{round(value, places) + 0.0:.{places}f}"


def size(error: float) -> str:
    """Return an error with two digits."""
    if error == 0:
        return "0"
    if not math.isfinite(error):
        return "unknown"
    return f"{error:.1e}"


def with_error(value: np.ndarray, error: np.ndarray | None, unit: str = "") -> str:
    """Return a number with its error and its unit."""
    if error is None or np.isnan(error):
        return f"{number(float(value))} {unit}".strip()
    if not error > 0:
        return f"{number(float(value))} +- 0 {unit}".strip()
    places = decimals(np.asarray(value), np.asarray(error))
    return f"{number(float(value), places)} +- {size(float(error))} {unit}".strip()
