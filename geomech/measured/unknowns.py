"""Number of unknowns of a connection that the cycles of a log determine: as many as best predict cycles left out of the
fit."""

from __future__ import annotations

import numpy as np

from geomech.geometry.tube import Loop
from geomech.measured.regression import (
    FOLDS,
    NOTHING,
    RATES,
    SECOND,
    Samples,
    Sums,
    sums,
)

LEAST, MORE = (
    4,
    2,
)  # harmonics: the least number, and those beyond the best prediction, so that the truncation is below the noise
FEWEST = 2  # harmonics: with fewer, terms of the second order are dropped
SHARE = (
    0.5  # unknowns over parameters of the splines, at most: more would fit the noise
)
WORSE = 1.5  # ratio of prediction errors from which on more unknowns only fit noise


def selected(
    loop: Loop, samples: Samples, most: int, fixed: int | None, varies: int, size: float
) -> tuple[Sums, int]:
    """Return the normal equations to be solved, and what varies in them, at most ``varies``.

    The number of harmonics is ``fixed``, or by cross-validation over cycles, at most ``most``. Terms of the second
    order, or all terms across the gait, are dropped where they worsen the prediction of cycles left out, as noise does
    for lack of variation. size: see `afforded`."""
    affordable, second = afforded(
        samples.alpha.shape[1], most if fixed is None else fixed, varies, size
    )
    equations = sums(
        loop, samples, affordable if fixed is None else fixed, varies, second
    )
    equations = equations if fixed else equations.truncated(chosen(equations))
    if (unpredicted(equations) > WORSE * unpredicted(equations.plain)).any():
        equations = equations.plain
    if varies == NOTHING:
        return equations, varies
    along, nothing = selected(loop, samples, most, fixed, NOTHING, size)
    return (
        (along, nothing)
        if (unpredicted(equations) > WORSE * unpredicted(along)).any()
        else (equations, varies)
    )


def afforded(joints: int, most: int, varies: int, size: float) -> tuple[int, int]:
    """Return the harmonics of the connection, at most ``most``, and of the terms of the second order, -1 for none.

    The unknowns are at most a SHARE of ``size`` data; at least one harmonic."""
    rates, deviations = (
        (joints if varies == RATES else 1),
        (0 if varies == NOTHING else joints - 1),
    )
    second_order = lambda second: (
        deviations * (deviations + 1) // 2 * (2 * second + 1) * (second >= 0)
    )
    unknowns = lambda first, second: (
        rates * ((1 + deviations) * (2 * first + 1) + second_order(second))
    )
    choices = [*((LEAST, k) for k in range(SECOND, 0, -1)), (FEWEST, 0)]
    second = next(
        (k for h, k in choices if unknowns(min(h, most), k) <= SHARE * size), -1
    )
    return next(
        (h for h in range(most, 1, -1) if unknowns(h, second) <= SHARE * size), 1
    ), second


def chosen(equations: Sums) -> int:
    """Return the number of harmonics: MORE than in the best prediction of cycles left out, for the component of xi that
    needs most. So the truncation stays below the noise."""
    errors = [
        unpredicted(equations.truncated(k)) for k in range(1, equations.harmonics + 1)
    ]
    return min(
        equations.harmonics, max(LEAST, int(np.argmin(errors, 0).max()) + 1 + MORE)
    )


def unpredicted(equations: Sums) -> np.ndarray:
    """Return sums of squares (3,) of xi in cycles left out, less what the others predict."""
    fold = np.arange(len(equations.square)) % FOLDS
    parts = [
        equations.residual(equations.solved((fold != f).astype(float)))[fold == f].sum(
            0
        )
        for f in range(FOLDS)
    ]
    return np.sum(parts, 0)
