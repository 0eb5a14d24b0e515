"""Values and rates of noisy channels by least-squares splines, with knots spaced by cross-validation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

DEGREE = 5  # of the splines: their rates are of order 5 in the spacing of the knots
KNOTS = (4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)  # per cycle, at most
PIECE = 2000  # rows of a spline that is solved as one
TRIED = 4000  # rows for the choice of a spacing
CLOSER = 1.5  # more knots than is best for values: rates need more
FEWEST = 2  # rows between two knots; of every second row twice as many, at least


class Smoothed(NamedTuple):
    """Splines through channels.

    values, rates: (N, channels). halves: values and rates from every second row, from the first and from the second on;
    their noise is independent. knots: per cycle. noise: (channels,), standard deviation of the rows about the spline.
    """

    values: np.ndarray
    rates: np.ndarray
    halves: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    knots: float
    noise: np.ndarray


def smoothed(t: np.ndarray, channels: np.ndarray, period: float) -> Smoothed:
    """Return splines through channels (N, C) at times t (N,), which need not be equally spaced.

    Knots are at rows; their number per cycle minimises the geometric mean over the channels of the generalised
    cross-validation."""
    rows = len(t) * period / (t[-1] - t[0])  # per cycle
    step = _spacing(
        t[:TRIED],
        channels[:TRIED],
        sorted({max(FEWEST, round(rows / k)) for k in KNOTS}, reverse=True),
    )
    values, rates = _through(t, channels, step, t)
    noise = np.sqrt(((channels - values) ** 2).sum(0) / (len(t) * (1 - 1 / step)))
    halves = tuple(
        _through(t[k::2], channels[k::2], max(2, -(-step // 2)), t) for k in (0, 1)
    )
    return Smoothed(values, rates, halves, rows / step, noise)


def _spacing(t: np.ndarray, channels: np.ndarray, steps: list[int]) -> int:
    """Return the number of rows between two knots: by CLOSER less than the best of ``steps`` in cross-validation."""
    scores = {}
    for step in steps:
        curve = _spline(t, channels, step)
        residual, free = channels - curve(t), 1 - len(curve.c) / len(t)
        scores[step] = np.log(
            np.maximum((residual**2).mean(0), 1e-300) / free**2
        ).mean()
    return max(FEWEST, round(min(scores, key=scores.get) / CLOSER))


def _through(
    t: np.ndarray, channels: np.ndarray, step: int, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return values and rates at ascending times ``at`` (M,) of the spline with a knot at every ``step``-th row.

    It is assembled from pieces of PIECE rows with margins, as the solver's time grows with the square of a piece."""
    margin, parts = 40 * step, []
    starts = np.arange(0, max(len(t) - PIECE // 2, 1), PIECE)
    ends = np.searchsorted(at, [*t[starts[1:]], np.inf])
    for a, low, high in zip(starts, [0, *ends[:-1]], ends):
        last = len(t) if high == len(at) else min(len(t), a + PIECE + margin)
        window = slice(
            max(0, a - margin) // step * step, last
        )  # knots stay where they are
        curve = _spline(t[window], channels[window], step)
        inside = np.clip(at[low:high], curve.t[0], curve.t[-1])
        parts.append((curve(inside), curve.derivative()(inside)))
    return tuple(np.concatenate(x) for x in zip(*parts))


def _spline(t: np.ndarray, channels: np.ndarray, step: int):
    """Return the least-squares spline with a knot at every ``step``-th row."""
    from scipy.interpolate import make_lsq_spline

    inner = t[step : len(t) - step : step]
    knots = np.concatenate([[t[0]] * (DEGREE + 1), inner, [t[-1]] * (DEGREE + 1)])
    return make_lsq_spline(t, channels, knots, DEGREE)
