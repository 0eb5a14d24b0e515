"""The cycles of a log: its period, its phase, and whether all are cycles of one
gait."""

from __future__ import annotations

import numpy as np

from geomech.mathematics.geometry.gait import FASTEST
from geomech.mathematics.geometry.representations.tube import Loop, waves
from geomech.studies.measured import phase
from geomech.studies.measured.log import Log, check_rows
from geomech.studies.measured.smooth import Smoothed

FEWEST = 8  # full cycles: fewer do not show their scatter
# Cycles of a log with that many full ones: half a cycle at each end is not used.
ENOUGH = FEWEST + 2
LEAST_ROWS = 12  # per cycle
LARGEST_GAP = 1 / 8  # of a cycle, without a row
# Ratio of the periods of the first and the last quarter of a log of two gaits.
PERIOD_RATIO = 1.25
# Least share of the variance of cycles that lies between two gaits; it is 2/3 for
# normally distributed cycles, 3/4 for a steady drift.
BETWEEN_GAITS = 0.9
# The same where all cycles of one gait come before those of the other.
BETWEEN_GAITS_IN_ORDER = 0.8
LEAST_DISTANCE = 0.05  # of the gait's size, between the means of two gaits
STEADY_DRIFT = 4  # least drift over the scatter of a joint's cycles about it
NOISE_DEVIATIONS = 1.5  # standard deviations of noise that may look like a motion
THIN = 1e-3  # of its length: width of a gait that encloses no area
SLIGHT = 0.01  # of a joint: smaller contributions of others are not named
PHASE_STEPS = 3  # iterations of the phase by the nearest point of the mean gait


def period(log: Log) -> float:
    """Return the period of the joints, in units of t; Refusal, with the line, for too
    few or too sparse cycles, gaps and two gaits."""
    t = np.linspace(log.t[0], log.t[-1], len(log.t))
    alpha = np.stack([np.interp(t, log.t, a) for a in log.alpha.T], -1)
    repeat = phase.period_of(t, alpha)
    _check_one_period(log, t, alpha, repeat)
    instead = f"give at least {ENOUGH} cycles of one gait, preferably some dozens"
    if not repeat:
        raise log.wrong("the joints do not repeat", instead=instead)
    count = (log.t[-1] - log.t[0]) / repeat
    if count < FEWEST + 1:
        raise log.wrong(f"the joints repeat {count:.1f} times", instead=instead)
    if repeat * FASTEST < 1.0:
        raise log.wrong(
            f"the joints repeat every {repeat:.3g} where t is in s",
            instead="give t in s, or in another unit longer than ms",
        )
    rows = len(log.t) / count
    if rows < LEAST_ROWS:
        raise log.wrong(
            f"{rows:.1f} rows per cycle are too few",
            instead=f"give at least {LEAST_ROWS}",
        )
    _check_gaps(log, repeat)
    check_rows(log)
    return repeat


def _check_one_period(
    log: Log, t: np.ndarray, alpha: np.ndarray, repeat: float
) -> None:
    """Refuse a log whose first and last quarters have different periods."""
    quarter = len(t) // 4
    if not repeat or 3 * repeat >= t[quarter] - t[0]:
        return
    first = phase.period_of(t[:quarter], alpha[:quarter])
    last = phase.period_of(t[-quarter:], alpha[-quarter:])
    if first and last and max(first, last) > PERIOD_RATIO * min(first, last):
        raise log.wrong(
            f"the joints repeat every {first:.3g} in the first quarter of the log and"
            f" every {last:.3g} in the last",
            because="it contains two gaits",
            instead="give each its own file",
        )


def _check_gaps(log: Log, repeat: float) -> None:
    """Refuse a log with gaps that are long in a cycle."""
    gaps = np.diff(log.t)
    is_long = gaps > max(LARGEST_GAP * repeat, 2.5 * np.median(gaps))
    count = int(is_long.sum())
    if count == 0:
        return
    k = int(gaps.argmax())
    which = "its only gap"
    if count > 1:
        which = f"the longest of {count} gaps"
    raise log.wrong(
        f"no rows for {gaps[k]:.3g} after this one (t = {log.t[k]:.6g}), "
        f"{gaps[k] / repeat:.2g} of a cycle, {which}",
        k,
        instead="cut the log and give its longest part, or fill gaps longer than "
        f"{LARGEST_GAP:g} of a cycle",
    )


def check_a_loop(log: Log, joints: Smoothed, rows: float) -> None:
    """Refuse a joint that shows nothing but noise, and joints that are all
    proportional: motion to and fro on a line is no loop. rows: per cycle."""
    deviations = joints.values - joints.values.mean(0)
    noise_sizes = _noise(joints, rows)
    for name, size, noise in zip(log.joints, deviations.std(0), noise_sizes):
        if size <= noise:
            raise log.wrong(
                f"{name} does not move beyond its noise",
                instead="leave it out with ``columns``",
            )
    _, size, axes = np.linalg.svd(deviations, full_matrices=False)
    noise = np.sqrt(len(deviations)) * noise_sizes.max()
    if size[1] > max(THIN * size[0], noise):
        return
    first = log.joints[0]
    last = log.joints[-1]
    slope = axes[0, -1] / axes[0, 0]
    raise log.wrong(
        f"{last} is {slope:.3g} times {first}, apart from a constant and noise",
        because=f"one shape variable that is recorded {len(log.joints)} times moves "
        "back and forth and encloses no loop",
        instead="use ``columns`` to choose joints that move independently",
    )


def _noise(joints: Smoothed, rows: float) -> np.ndarray:
    """Return the rms (d,), rad, that noise may have in splines through the joints.
    rows: per cycle."""
    return NOISE_DEVIATIONS * joints.noise * np.sqrt(joints.knots / rows)


def combined(joints: Smoothed, rows: float) -> dict[int, np.ndarray]:
    """Return the joints that are linear combinations of others, up to a constant and
    noise, with the factors (d,) of these others.

    The others come before them and are not combined themselves. rows: per cycle. Joints
    of a wave of one harmonic have at most two others."""
    deviations = joints.values - joints.values.mean(0)
    sizes = deviations.std(0)
    noise = _noise(joints, rows)
    others = [0]
    combinations = {}
    for k in range(1, deviations.shape[1]):
        joint = deviations[:, k]
        factors = np.zeros(deviations.shape[1])
        factors[others] = np.linalg.lstsq(deviations[:, others], joint, rcond=None)[0]
        residual = (joint - deviations @ factors).std()
        allowed = np.hypot(noise[k], np.linalg.norm(factors * noise))
        if residual <= max(THIN * sizes[k], allowed):
            is_slight = np.abs(factors) * sizes <= SLIGHT * sizes[k]
            combinations[k] = np.where(is_slight, 0.0, factors)
        else:
            others.append(k)
    return combinations


def phases(
    log: Log, joints: Smoothed, period: float, harmonics: int
) -> tuple[np.ndarray, Loop]:
    """Return the phase (N,) of each row, rad, increasing, and the mean gait.

    At first it is the phase of a sine through the joints, then the phase of the nearest
    point of the mean gait, transformed so that it grows at a uniform rate on average.
    At phase 0 the first harmonic of the first joint is largest."""
    t = np.linspace(log.t[0], log.t[-1], len(log.t))
    equally_spaced = np.stack([np.interp(t, log.t, a) for a in joints.values.T], -1)
    protophase = phase.protophase(t, equally_spaced, period)
    row_phases = np.interp(log.t, t, protophase)
    _check_growing(log, row_phases, period)

    row_phases = phase.uniform(row_phases)
    for _ in range(PHASE_STEPS):
        loop = Loop(phase.fitted_loop(row_phases, joints.values, harmonics))
        row_phases = phase.uniform(loop.projected(joints.values, row_phases))
    row_phases = row_phases - _start(row_phases, joints.values)
    return row_phases, Loop(phase.fitted_loop(row_phases, joints.values, harmonics))


def _start(row_phases: np.ndarray, alpha: np.ndarray) -> float:
    """Return the phase at which the first harmonic of the first joint with a large one
    is largest."""
    cos, sin = phase.fitted_loop(row_phases, alpha, 1)[:, 1:].T
    size = np.hypot(cos, sin)
    k = int(np.flatnonzero(size > 0.5 * size.max())[0])
    return float(np.arctan2(sin[k], cos[k]))


def _check_growing(log: Log, row_phases: np.ndarray, period: float) -> None:
    """Refuse a log whose phase stands or runs back: over half a cycle it must grow by
    at least a fifth of a cycle."""
    is_inside = (log.t > log.t[0] + period / 2) & (log.t < log.t[-1] - period)
    inside = np.flatnonzero(is_inside)
    later = np.interp(log.t[inside] + period / 2, log.t, row_phases)
    slow = np.flatnonzero(later - row_phases[inside] < 0.4 * np.pi)
    if slow.size:
        row = inside[slow[0]]
        raise log.wrong(
            "the gait pauses, slips or runs backwards after this row (t = "
            f"{log.t[row]:.6g})",
            row,
            instead="cut out pauses and starts, and give each gait its own file",
        )


def cycle_numbers(log: Log, row_phases: np.ndarray, period: float) -> np.ndarray:
    """Return the number (N,) of each row's cycle from 0; -1 in incomplete cycles and
    too near the ends of the log for a phase."""
    inside = (log.t > log.t[0] + period / 2) & (log.t < log.t[-1] - period / 2)
    turns = row_phases / (2 * np.pi)
    first = np.ceil(turns[inside].min())
    last = np.floor(turns[inside].max())
    number = np.floor(turns - first).astype(int)
    return np.where(inside & (turns >= first) & (turns < last), number, -1)


def check_no_drift(log: Log, number: np.ndarray, alpha: np.ndarray) -> None:
    """Refuse a joint that drifts from cycle to cycle by more than it swings in one."""
    c = np.arange(number.max() + 1)
    for name, x in zip(log.joints, alpha.T):
        cycles = [x[number == k] for k in c]
        means = np.array([cycle.mean() for cycle in cycles])
        swing = float(np.median([np.ptp(cycle) for cycle in cycles]))
        slope, start = np.polyfit(c, means, 1)
        scatter = (means - start - slope * c).std()
        if abs(slope) * c[-1] > max(swing, STEADY_DRIFT * scatter):
            raise log.wrong(
                f"{name} drifts from {means[0]:.3g} to {means[-1]:.3g} over the log "
                f"and oscillates by {swing:.2g} within a cycle",
                because="a drifting variable is not part of a gait",
                instead="leave it out with ``columns``",
            )


def check_one_gait(
    log: Log, row_phases: np.ndarray, number: np.ndarray, alpha: np.ndarray
) -> None:
    """Refuse cycles of two kinds: along the direction in which first harmonics differ
    most, almost all variance is between two groups."""
    count = number.max() + 1
    w = waves(row_phases, 2)
    harmonics = []
    for c in range(count):
        rows = number == c
        fitted = np.linalg.lstsq(w[rows], alpha[rows], rcond=None)[0]
        harmonics.append(fitted.ravel())
    mean = np.mean(harmonics, 0)
    deviations = np.array(harmonics) - mean
    size = np.linalg.norm(mean.reshape(5, -1)[1:])
    score = deviations @ np.linalg.svd(deviations, full_matrices=False)[2][0]

    # The variance between the k lowest cycles and the others, for each k.
    order = np.sort(score)
    k = np.arange(1, count)
    low = np.cumsum(order)[:-1] / k
    high = (order.sum() - np.cumsum(order)[:-1]) / (count - k)
    between = k * (count - k) / count * (high - low) ** 2
    best = 0
    if count > 5:
        best = int(between[2:-2].argmax()) + 2
    kind = score > (order[best] + order[best + 1]) / 2
    is_in_order = (kind[1:] != kind[:-1]).sum() == 1
    share = BETWEEN_GAITS_IN_ORDER if is_in_order else BETWEEN_GAITS
    is_distinct = high[best] - low[best] > LEAST_DISTANCE * size
    are_several = min(k[best], count - k[best]) > 2
    if is_distinct and are_several and between[best] > share * (order**2).sum():
        change = int(np.flatnonzero(kind != kind[0])[0])
        row = int(np.flatnonzero(number == change)[0])
        raise log.wrong(
            "two gaits",
            row,
            because=f"{k[best]} cycles are of one kind and {count - k[best]} of "
            f"another, which begins here (t = {log.t[row]:.6g})",
            instead="give each its own file",
        )
