"""How many unknowns of a connection the cycles of a log tell: as many as predict cycles that were left out."""

from __future__ import annotations

import numpy as np

from geomech.geometry.tube import Loop
from geomech.measured.regression import FOLDS, NOTHING, RATES, SECOND, Samples, Sums, sums

LEAST, MORE = 4, 2  # harmonics at least, and beyond those of the best prediction: what is cut off stays below the noise
FEWEST = 2  # harmonics for which those of the second order are given up
SHARE = 0.5  # of the numbers that splines through the rows have, that unknowns are at most: more follow the noise
WORSE = 1.5  # times as large, what cycles that are left out keep of xi with more unknowns: then noise makes these up


def settled(loop: Loop, samples: Samples, most: int, fixed: int | None, varies: int, size: float) -> tuple[Sums, int]:
    """(the sums to be solved, and what varies in them, no more than ``varies``): with as many harmonics, at most ``most``, as
    cycles that are left out ask for, or ``fixed`` ones; without what is of the second order, or all that is across the gait,
    where these are predicted worse with it: what noise makes up for lack of variation. size: as in `afforded`."""
    wanted, second = afforded(samples.alpha.shape[1], most if fixed is None else fixed, varies, size)
    held = sums(loop, samples, wanted if fixed is None else fixed, varies, second)
    held = held if fixed else held.kept(chosen(held))
    if (unpredicted(held) > WORSE * unpredicted(held.plain)).any():
        held = held.plain
    if varies == NOTHING:
        return held, varies
    along, nothing = settled(loop, samples, most, fixed, NOTHING, size)
    return (along, nothing) if (unpredicted(held) > WORSE * unpredicted(along)).any() else (held, varies)


def afforded(joints: int, most: int, varies: int, size: float) -> tuple[int, int]:
    """(harmonics of the connection, at most ``most``, and of what is of the second order, -1 for none), of which the unknowns
    are no more than a SHARE of ``size`` numbers that tell them; at least one harmonic."""
    rates, deviations = (joints if varies == RATES else 1), (0 if varies == NOTHING else joints - 1)
    second_order = lambda second: deviations * (deviations + 1) // 2 * (2 * second + 1) * (second >= 0)
    unknowns = lambda first, second: rates * ((1 + deviations) * (2 * first + 1) + second_order(second))
    ways = [*((LEAST, k) for k in range(SECOND, 0, -1)), (FEWEST, 0)]
    second = next((k for h, k in ways if unknowns(min(h, most), k) <= SHARE * size), -1)
    return next((h for h in range(most, 1, -1) if unknowns(h, second) <= SHARE * size), 1), second


def chosen(held: Sums) -> int:
    """Harmonics: MORE than those with which cycles that are left out are predicted best, of the component of xi that asks for
    most, so that what is cut off stays below the noise."""
    errors = [unpredicted(held.kept(k)) for k in range(1, held.harmonics + 1)]
    return min(held.harmonics, max(LEAST, int(np.argmin(errors, 0).max()) + 1 + MORE))


def unpredicted(held: Sums) -> np.ndarray:
    """(3,): sum of squares of xi in cycles that are left out, less what the others predict of it."""
    fold = np.arange(len(held.square)) % FOLDS
    parts = [held.left(held.solved((fold != f).astype(float)))[fold == f].sum(0) for f in range(FOLDS)]
    return np.sum(parts, 0)
