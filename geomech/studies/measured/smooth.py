"""Values and rates of noisy channels by least-squares splines, with knots spaced by
cross-validation."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

DEGREE = 5  # of the splines: their rates are of order 5 in the spacing of the knots
KNOTS = (4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)  # per cycle, at most
ROWS_PER_PIECE = 2000  # of a spline that is solved at once
TRIED_ROWS = 4000  # for the choice of a spacing
MORE_KNOTS = 1.5  # than is best for values, as rates need more
FEWEST = 2  # rows between two knots, for every second row as well


class Smoothed(NamedTuple):
    """Splines through channels.

    values, rates: (N, channels). halves: values and rates from every second row, from
    the first and from the second on; their noise is independent. knots: per cycle.
    noise: (channels,), standard deviation of the rows about the spline."""

    values: np.ndarray
    rates: np.ndarray
    halves: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    knots: float
    noise: np.ndarray


def smoothed(t: np.ndarray, channels: np.ndarray, period: float) -> Smoothed:
    """Return splines through channels (N, C) at times t (N,), which need not be equally
    spaced.

    Knots are at rows; their number per cycle minimises the geometric mean over the
    channels of the generalised cross-validation."""
    rows = len(t) * period / (t[-1] - t[0])  # per cycle
    steps = {max(FEWEST, round(rows / knots)) for knots in KNOTS}
    step = _spacing(t[:TRIED_ROWS], channels[:TRIED_ROWS], sorted(steps, reverse=True))
    values, rates = _fit(t, channels, step, t)
    free_rows = len(t) * (1 - 1 / step)
    noise = np.sqrt(((channels - values) ** 2).sum(0) / free_rows)
    half_step = max(FEWEST, math.ceil(step / 2))
    halves = tuple(_fit(t[k::2], channels[k::2], half_step, t) for k in (0, 1))
    return Smoothed(values, rates, halves, rows / step, noise)


def _spacing(t: np.ndarray, channels: np.ndarray, steps: list[int]) -> int:
    """Return the number of rows between two knots: the best of ``steps`` in
    cross-validation, over MORE_KNOTS."""
    scores = {}
    for step in steps:
        spline = _spline(t, channels, step)
        square = ((channels - spline(t)) ** 2).mean(0)
        free = 1 - len(spline.c) / len(t)
        scores[step] = np.log(np.maximum(square, 1e-300) / free**2).mean()
    return max(FEWEST, round(min(scores, key=scores.get) / MORE_KNOTS))


def _fit(
    t: np.ndarray, channels: np.ndarray, step: int, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return values and rates at ascending times (M,) of the spline with a knot at
    every ``step``-th row.

    It is assembled from pieces of ROWS_PER_PIECE rows with margins, as the solver's
    time grows with the square of a piece."""
    margin = 40 * step
    starts = np.arange(0, max(len(t) - ROWS_PER_PIECE // 2, 1), ROWS_PER_PIECE)
    ends = np.searchsorted(times, [*t[starts[1:]], np.inf])
    values = []
    rates = []
    for start, low, high in zip(starts, [0, *ends[:-1]], ends):
        last = len(t)
        if high < len(times):
            last = min(len(t), start + ROWS_PER_PIECE + margin)
        # Every piece begins at a knot, so that knots stay in place.
        first = max(0, start - margin) // step * step
        spline = _spline(t[first:last], channels[first:last], step)
        inside = np.clip(times[low:high], spline.t[0], spline.t[-1])
        values.append(spline(inside))
        rates.append(spline.derivative()(inside))
    return np.concatenate(values), np.concatenate(rates)


def _spline(t: np.ndarray, channels: np.ndarray, step: int):
    """Return the least-squares spline with a knot at every ``step``-th row."""
    from scipy.interpolate import make_lsq_spline

    inner = t[step : len(t) - step : step]
    knots = np.concatenate([[t[0]] * (DEGREE + 1), inner, [t[-1]] * (DEGREE + 1)])
    return make_lsq_spline(t, channels, knots, DEGREE)
