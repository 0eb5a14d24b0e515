"""Values and rates of noisy channels: least-squares splines whose knots are as close as cross-validation asks for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

DEGREE = 5  # of the splines: their rates are of order 5 in the spacing of the knots
KNOTS = (4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)  # a cycle, at most
PIECE = 2000  # rows of a spline that is solved at once
TRIED = 4000  # rows on which spacings are tried
CLOSER = 1.5  # knots for each that values want: rates want more
FEWEST = 2  # rows between two knots; of every second row twice as many, at least


class Smoothed(NamedTuple):
    """values, rates: (N, channels). halves: the same from every second row, from the first and from the second; their noise
    is independent. knots: a cycle. noise: (channels,), standard deviation of what the spline leaves of the rows."""

    values: np.ndarray
    rates: np.ndarray
    halves: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    knots: float
    noise: np.ndarray


def smoothed(t: np.ndarray, channels: np.ndarray, period: float) -> Smoothed:
    """Splines through channels (N, C) at times t (N,), which need not be equally spaced. Knots are at rows, as many a cycle
    as generalised cross-validation likes best in the geometric mean over the channels."""
    rows = len(t) * period / (t[-1] - t[0])  # a cycle
    step = _spacing(t[:TRIED], channels[:TRIED], sorted({max(FEWEST, round(rows / k)) for k in KNOTS}, reverse=True))
    values, rates = _through(t, channels, step, t)
    noise = np.sqrt(((channels - values) ** 2).sum(0) / (len(t) * (1 - 1 / step)))
    halves = tuple(_through(t[k::2], channels[k::2], max(2, -(-step // 2)), t) for k in (0, 1))
    return Smoothed(values, rates, halves, rows / step, noise)


def _spacing(t: np.ndarray, channels: np.ndarray, steps: list[int]) -> int:
    """Rows between two knots, CLOSER than those of ``steps`` that cross-validation likes best."""
    found = {}
    for step in steps:
        curve = _spline(t, channels, step)
        left, free = channels - curve(t), 1 - len(curve.c) / len(t)
        found[step] = np.log(np.maximum((left**2).mean(0), 1e-300) / free**2).mean()
    return max(FEWEST, round(min(found, key=found.get) / CLOSER))


def _through(t: np.ndarray, channels: np.ndarray, step: int, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(values, rates) at times ``at`` (M,), ascending, of the spline with a knot at every so manieth row. It is made of pieces
    of PIECE rows, which see as far as a spline remembers to either side: the solver's time grows with the square of a piece."""
    beside, found = 40 * step, []
    starts = np.arange(0, max(len(t) - PIECE // 2, 1), PIECE)
    ends = np.searchsorted(at, [*t[starts[1:]], np.inf])
    for a, low, high in zip(starts, [0, *ends[:-1]], ends):
        last = len(t) if high == len(at) else min(len(t), a + PIECE + beside)
        some = slice(max(0, a - beside) // step * step, last)  # knots stay where they are
        curve = _spline(t[some], channels[some], step)
        inside = np.clip(at[low:high], curve.t[0], curve.t[-1])
        found.append((curve(inside), curve.derivative()(inside)))
    return tuple(np.concatenate(x) for x in zip(*found))


def _spline(t: np.ndarray, channels: np.ndarray, step: int):
    """Least squares, with a knot at every so manieth row."""
    from scipy.interpolate import make_lsq_spline

    inner = t[step : len(t) - step : step]
    knots = np.concatenate([[t[0]] * (DEGREE + 1), inner, [t[-1]] * (DEGREE + 1)])
    return make_lsq_spline(t, channels, knots, DEGREE)
