"""Loads on elements as arrays, for tests: columns of the value and of its slopes."""

import numpy as np

from rft.formulas.link import Load
from rft.laws.records import record


def as_array(load: Load, like: np.ndarray) -> np.ndarray:
    """(3, 4, *shape): rows t, n and w; columns the value and its slopes in v_t, v_n and
    v_w."""
    return np.array(np.broadcast_arrays(*load, like)[:12]).reshape(
        3, 4, *np.shape(like)
    )


def element_load(law, rule: str = "exact"):
    """load(v_t, v_n, v_w, rounding) -> (3, 4, n, B) of a law by a rule."""
    average = record(law, rule).average
    return lambda v_t, v_n, v_w, rounding: as_array(
        average(v_t, v_n, v_w, rounding), v_t
    )
