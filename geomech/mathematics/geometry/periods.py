"""Shape variables that repeat: the phase of a contact, or the angle of a wheel.

A velocity at alpha_k + period is that at alpha_k. An axis of such a variable covers one
period with both its ends, which are the same shape: grids, halves of grids, pictures
and files treat it as they treat any axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rft.core.refusal import Refusal, formatted

Periods = tuple[float | None, ...]

LONGEST = 1e6  # rad: of a longer period few digits of a shape are left
SAME = 1e-6  # of the largest value: the largest difference of the two ends of an axis
CLOSED = 1e-9  # rad: the largest distance of the ends of a closed curve
SHORTEST = 1e-2  # rad: ends that are further apart are those of a gait that winds


def checked_periods(periods: object, joints: int) -> Periods:
    """Return the period of each of ``joints`` shape variables, () where none has one;
    Refusal for anything else."""
    if not isinstance(periods, (tuple, list)) or len(periods) not in (0, joints):
        raise Refusal(
            "periods must be a tuple of one number or None for each of the"
            f" {joints} shape variables",
            value=periods,
        )
    if not any(period is not None for period in periods):
        return ()
    for period in periods:
        if period is None:
            continue
        is_number = isinstance(period, (int, float, np.number))
        is_number = is_number and not isinstance(period, bool)
        if not (is_number and SHORTEST < period <= LONGEST):
            raise Refusal(
                f"a period must be above {SHORTEST:g} and at most {LONGEST:g}, or None",
                value=period,
            )
    return tuple(None if period is None else float(period) for period in periods)


def periodic_axes(periods: Periods) -> list[int]:
    """Return the indices of the variables that have a period."""
    return [k for k, period in enumerate(periods) if period is not None]


def period_of(periods: Periods, k: int) -> float | None:
    """Return the period of variable k, counted from 0; None without one."""
    return periods[k] if periods else None


def period_axis(period: float, points: int) -> np.ndarray:
    """Return ``points`` equally spaced angles from 0 to the period, both included."""
    return np.linspace(0.0, period, int(points))


def check_axes(axes: Sequence[np.ndarray], periods: Periods) -> None:
    """Refuse an axis of a variable with a period that does not cover one period."""
    for k in periodic_axes(periods):
        span = axes[k][-1] - axes[k][0]
        if abs(span - periods[k]) > 1e-9 * periods[k]:
            raise Refusal(
                f"the axis of alpha_{k + 1} must cover one period, {periods[k]:.6g}, "
                f"with both ends, got {axes[k][0]:.6g} to {axes[k][-1]:.6g}"
            )


def closed_ends(values: np.ndarray, joints: int, periods: Periods) -> np.ndarray:
    """Return values (..., N_1, ..., N_d) with the last of each axis that has a period
    equal to the first; Refusal where the two are no rounding apart."""
    for k in periodic_axes(periods):
        along = np.moveaxis(values, k - joints, 0)
        if np.array_equal(along[0], along[-1], equal_nan=True):
            continue
        size = np.nanmax(np.abs(values), initial=0.0)
        if not np.allclose(
            along[0], along[-1], rtol=0, atol=SAME * size, equal_nan=True
        ):
            raise Refusal(
                f"values at the two ends of the axis of alpha_{k + 1} differ",
                because=f"its period is {formatted(periods[k])}, so both are one shape",
                instead="correct the period",
            )
        values = values.copy()
        np.moveaxis(values, k - joints, 0)[-1] = along[0]
    return values


def wrapped(
    alpha: np.ndarray, axes: Sequence[np.ndarray], periods: Periods
) -> np.ndarray:
    """Return shapes alpha (..., d) with each variable that has a period within its
    axis."""
    if not periods:
        return alpha
    alpha = alpha.copy()
    for k in periodic_axes(periods):
        first, last = axes[k][0], axes[k][-1]
        beyond = (alpha[..., k] < first) | (alpha[..., k] > last)
        around = first + np.mod(alpha[..., k] - first, periods[k])
        alpha[..., k] = np.where(beyond, np.minimum(around, last), alpha[..., k])
    return alpha


def winding(
    gait: Any, periods: Periods, amplitudes: ArrayLike | None = None
) -> tuple[int, ...]:
    """Return how many periods (d,) each variable advances in a cycle of a gait, for
    amplitudes (B,) or its own; () where none does, or none has a period.

    Refusal for a gait that is not closed, or does not wind alike at all amplitudes."""
    if not periods:
        return ()
    change, tolerance = _change_per_cycle(gait, amplitudes)
    change = change.reshape(-1, change.shape[-1])
    turns = np.zeros(change.shape, int)
    for k in periodic_axes(periods):
        turns[:, k] = np.round(change[:, k] / periods[k])
        change[:, k] -= turns[:, k] * periods[k]
    if np.abs(change).max(initial=0.0) > tolerance or (turns != turns[:1]).any():
        k = int(np.abs(change).max(0).argmax())
        raise Refusal(
            f"the gait is not closed: alpha_{k + 1} ends"
            f" {np.abs(change[:, k]).max():.4g} rad from its start, whole periods left"
            " out",
            instead="let each variable return, or advance by whole periods at every "
            "amplitude",
        )
    if not turns.any():
        return ()
    return tuple(turns[0].tolist())


def ends_differ(gait: Any) -> bool:
    """Return whether a gait ends at other angles than it starts at, as one that winds
    around a variable with a period does."""
    change, _ = _change_per_cycle(gait)
    return bool(np.abs(change).max(initial=0.0) > SHORTEST)


def _change_per_cycle(
    gait: Any, amplitudes: ArrayLike | None = None
) -> tuple[np.ndarray, float]:
    """Return the change (..., d) of each variable in a cycle, and below what it is
    none."""
    gait = getattr(gait, "command", gait)  # of joints that give way
    if hasattr(gait, "shape"):
        ends = gait.shape(np.array([0.0, 2 * np.pi]), amplitudes)
        size = max(1.0, float(np.abs(ends).max(initial=0.0)))
        return ends[..., 1, :] - ends[..., 0, :], CLOSED * size
    # A gait that has only cycles does not tell its end: its rates do, less exactly.
    phases = max(64, 8 * getattr(gait, "harmonics", 1))
    _, alphadot = gait.cycle(phases, amplitudes)
    return 2 * np.pi * alphadot.mean(-2), SHORTEST
