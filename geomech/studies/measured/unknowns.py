"""The number of unknowns of a connection that the cycles of a log determine: the number
that best predicts cycles left out of the fit."""

from __future__ import annotations

import numpy as np

from geomech.mathematics.geometry.representations.tube import Loop
from geomech.studies.measured.regression import (
    FOLDS,
    NOTHING,
    RATES,
    SECOND,
    Samples,
    Sums,
    sums,
)

LEAST_HARMONICS = 4
# Harmonics beyond the best prediction, so that the truncation is below the noise.
MORE_HARMONICS = 2
FEWEST = 2  # harmonics: with fewer, terms of the second order are dropped
# Unknowns over parameters of the splines, at most: more would fit the noise.
SHARE = 0.5
WORSE = 1.5  # ratio of prediction errors beyond which more unknowns only fit noise


def selected(
    loop: Loop, samples: Samples, most: int, fixed: int | None, varies: int, size: float
) -> tuple[Sums, int]:
    """Return the normal equations to be solved, and what varies in them, at most
    ``varies``.

    The number of harmonics is ``fixed``, or by cross-validation over cycles, at most
    ``most``. Terms of the second order, or all terms across the gait, are dropped where
    they worsen the prediction of cycles left out, as noise does for lack of variation.
    size: see `afforded`."""
    joints = samples.alpha.shape[1]
    if fixed:
        _, second = afforded(joints, fixed, varies, size)
        equations = sums(loop, samples, fixed, varies, second)
    else:
        affordable, second = afforded(joints, most, varies, size)
        equations = sums(loop, samples, affordable, varies, second)
        equations = equations.truncated(best_harmonics(equations))
    if _is_worse(equations, equations.plain):
        equations = equations.plain
    if varies == NOTHING:
        return equations, varies
    along, nothing = selected(loop, samples, most, fixed, NOTHING, size)
    if _is_worse(equations, along):
        return along, nothing
    return equations, varies


def _is_worse(equations: Sums, fewer: Sums) -> bool:
    """Return whether equations predict a component of xi much worse than fewer unknowns
    do."""
    return bool((unpredicted(equations) > WORSE * unpredicted(fewer)).any())


def afforded(joints: int, most: int, varies: int, size: float) -> tuple[int, int]:
    """Return the harmonics of the connection, at most ``most`` and at least 1, and of
    the terms of the second order, -1 for none.

    The unknowns are at most a SHARE of ``size`` data."""
    rates = joints if varies == RATES else 1
    deviations = 0 if varies == NOTHING else joints - 1
    products = deviations * (deviations + 1) // 2

    def is_affordable(first, second):
        unknowns = (1 + deviations) * (2 * first + 1)
        if second >= 0:
            unknowns += products * (2 * second + 1)
        return rates * unknowns <= SHARE * size

    # Terms of the second order come before more than a few harmonics of the connection.
    choices = [(LEAST_HARMONICS, k) for k in range(SECOND, 0, -1)]
    choices.append((FEWEST, 0))
    second = next((k for h, k in choices if is_affordable(min(h, most), k)), -1)
    first = next((h for h in range(most, 1, -1) if is_affordable(h, second)), 1)
    return first, second


def best_harmonics(equations: Sums) -> int:
    """Return the number of harmonics: MORE_HARMONICS than in the best prediction of
    cycles left out, for the component of xi that needs most."""
    numbers = range(1, equations.harmonics + 1)
    errors = [unpredicted(equations.truncated(k)) for k in numbers]
    best = int(np.argmin(errors, 0).max()) + 1
    return min(equations.harmonics, max(LEAST_HARMONICS, best + MORE_HARMONICS))


def unpredicted(equations: Sums) -> np.ndarray:
    """Return sums of squares (3,) of the misfit of xi in cycles that are left out of
    the fit."""
    fold = np.arange(len(equations.square)) % FOLDS
    squares = []
    for f in range(FOLDS):
        others = equations.solved((fold != f).astype(float))
        squares.append(equations.residual(others)[fold == f].sum(0))
    return np.sum(squares, 0)
