"""Checks of arguments: numbers within bounds, arrays of real numbers, covariances. All
raise ValueError with one line.

The bounds, the unit and the meaning of a number field of a class stand in its
annotation (`Number`):

    radius: Annotated[float, Number(0, 1, "body lengths", "of the body")]
"""

from __future__ import annotations

import functools
import math
import numbers
import sys
from collections.abc import Collection
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeGuard, get_args, get_type_hints

from rft.core.refusal import Refusal, require

if TYPE_CHECKING:
    import numpy as np
from numpy.typing import ArrayLike


class Number(NamedTuple):
    """Bounds, unit and meaning of a number field.

    low, high: smallest and largest allowed value. unit: "-" for none. meaning: as lists
    of keys print it. whole: whether the number must be an integer."""

    low: float
    high: float
    unit: str
    meaning: str
    whole: bool = False


class Word(NamedTuple):
    """The annotation of a field whose text is one of several choices.

    meaning: as lists of keys print it."""

    choices: Collection[str]
    meaning: str


@functools.cache
def number_fields(kind: Any) -> dict[str, Number]:
    """Return the `Number` annotations of a class by field."""
    try:
        hints = get_type_hints(kind, include_extras=True)
    except (NameError, TypeError):
        # Annotations of a user's class may name something that cannot be imported.
        return {}
    found = {}
    for name, hint in hints.items():
        annotations = [x for x in get_args(hint) if isinstance(x, Number)]
        if annotations:
            found[name] = annotations[0]
    return found


def check_numbers(owner: Any) -> None:
    """Raise ValueError unless the number fields of an object lie within the bounds of
    their annotations, or are None where that is the default; store integers as int."""
    defaults = {}
    if is_dataclass(owner):
        defaults = {f.name: f.default for f in fields(owner)}
    kind: Any = type(owner)
    for name, number in number_fields(kind).items():
        value = getattr(owner, name)
        if value is not None or defaults.get(name) is not None:
            in_range(name, value, number.low, number.high, number.whole, number.unit)
            if number.whole:
                object.__setattr__(owner, name, int(value))


def real_array(name: str, x: ArrayLike) -> np.ndarray:
    """Return x as an array of floats; ValueError with its name unless it is an array of
    real numbers."""
    import numpy as np  # a command that refuses starts without it

    refuse_mask(name, x)
    try:
        array = np.asarray(x)
        has_numbers = array.dtype.kind in "iuf"
        if array.dtype.kind == "O":
            has_numbers = all(map(is_number, array.flat))
        if has_numbers:
            return array.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise Refusal(f"{name} must be an array of real numbers", value=x)


def refuse_mask(name: str, x: object) -> None:
    """Raise ValueError if x is a masked array, or rows of such, with a masked value,
    which NumPy would turn into the number under the mask."""
    ma = masked_arrays()
    if ma is None:
        return
    rows = x if isinstance(x, (list, tuple)) else (x,)
    for row in rows:
        if isinstance(row, ma.MaskedArray) and ma.is_masked(row):
            raise Refusal(
                f"{name} has masked values",
                instead="remove them, or replace them by nan where nan is allowed",
            )


def masked_arrays() -> Any:
    """Return `numpy.ma`; None where nobody has loaded it, so that there is no masked
    array. NumPy loads it at its first use, which takes as long as a scene."""
    return sys.modules.get("numpy.ma")


def unmasked(name: str, x: ArrayLike) -> np.ndarray:
    """Return x as an array of floats, otherwise unchecked; ValueError for a masked
    value."""
    import numpy as np

    refuse_mask(name, x)
    return np.asarray(x, float)


def is_number(value: object) -> TypeGuard[float]:
    """Return whether value is one real number; True and False are not."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def is_whole(value: object) -> bool:
    """Return whether value is an integer, as an int or a float."""
    return is_number(value) and (
        isinstance(value, numbers.Integral)
        or (math.isfinite(value) and value == int(value))
    )


def in_range(
    name: str, value: Any, low: float, high: float, whole: bool = False, unit: str = "-"
) -> None:
    """Raise ValueError with the name unless value is a number, if ``whole`` an integer,
    from low to high."""
    if is_number(value):
        # A NumPy number would round the bounds to its own type: float32 has no 1e-50.
        exact: Any = value.item() if hasattr(value, "item") else value
        has_kind = is_whole(value) or not whole
        if has_kind and low <= exact <= high:
            return
    kind = "whole number" if whole else "number"
    bounds = f"{low:g} to {high:g}"
    if unit != "-":
        bounds = f"{bounds} {unit}"
    raise Refusal(f"{name} must be a {kind} from {bounds}", value=value)


def checked_covariance(value, *sizes: int) -> tuple[tuple[float, ...], ...] | None:
    """Return a covariance matrix as rows of floats, None as it is; ValueError unless it
    is finite, n x n for an n among ``sizes``, symmetric and, to roundoff, without a
    negative eigenvalue."""
    if value is None:
        return None
    import numpy as np

    matrix = real_array("covariance", value)
    allowed = " or ".join(f"{n} x {n}" for n in sizes)
    require(
        matrix.shape in [(n, n) for n in sizes] and bool(np.isfinite(matrix).all()),
        f"covariance must be {allowed} finite numbers",
        value=value,
    )
    deviation = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale = np.where(deviation > 0, deviation, 1.0)
    correlation = matrix / scale[:, None] / scale
    is_symmetric = bool((np.abs(correlation - correlation.T) <= 1e-9).all())
    require(
        is_symmetric
        and bool(np.linalg.eigvalsh(correlation)[0] >= -1e-9)
        and bool((matrix[:, deviation == 0] == 0).all()),
        "covariance must be symmetric, without negative eigenvalues",
        value=value,
    )
    return tuple(tuple(row) for row in matrix.tolist())
