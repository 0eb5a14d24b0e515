"""The cycles of a log: its period, its phase, and whether all are cycles of one gait."""

from __future__ import annotations

import numpy as np

from geomech.geometry.gait import FASTEST
from geomech.geometry.tube import Loop, waves
from geomech.measured import phase
from geomech.measured.log import Log, check_rows
from geomech.measured.smooth import Smoothed

FEWEST = 8  # full cycles: fewer do not show their scatter
ENOUGH = (
    FEWEST + 2
)  # cycles of a log for that many full ones: half a cycle at each end is not used
ROWS = 12  # per cycle, at least
GAP = 1 / 8  # of a cycle without a row, at most
PERIOD_RATIO = (
    1.25  # ratio of the periods of the first and the last quarter of a log of two gaits
)
TWO = 0.9  # of the spread of cycles of two gaits is that between them; 2/3 of normal ones, 3/4 of a steady drift
AFTER = (
    0.8  # the same share where all cycles of one gait come before those of the other
)
LEAST_DISTANCE = 0.05  # of the gait's size, between the means of two gaits
STEADY = 4  # least drift over the scatter of a joint's cycles about it
SURELY = 1.5  # standard deviations of noise that may look like a motion
THIN = 1e-3  # of its length: width of a gait that encloses no area
SLIGHT = 0.01  # of a joint: smaller contributions of others are not named
REFINED = 3  # iterations of the phase by the nearest point of the mean gait


def period(log: Log) -> float:
    """Return the period of the joints, in units of t; Refusal, with the line, for too few or too sparse cycles, gaps
    and two gaits."""
    t = np.linspace(log.t[0], log.t[-1], len(log.t))
    alpha = np.stack([np.interp(t, log.t, a) for a in log.alpha.T], -1)
    repeat = phase.period_of(t, alpha)
    quarter = len(t) // 4
    if repeat and 3 * repeat < t[quarter] - t[0]:
        first, last = (
            phase.period_of(t[k], alpha[k])
            for k in (slice(0, quarter), slice(-quarter, None))
        )
        if first and last and max(first, last) > PERIOD_RATIO * min(first, last):
            raise log.wrong(
                f"the joints repeat every {first:.3g} in the first quarter of the log and every {last:.3g} in the last",
                because="two gaits are in it",
                instead="give each a file",
            )
    count = (log.t[-1] - log.t[0]) / repeat if repeat else 0.0
    if count < FEWEST + 1:
        what = (
            f"the joints repeat {count:.1f} times"
            if count
            else "the joints do not repeat"
        )
        raise log.wrong(
            what,
            instead=f"give at least {ENOUGH} cycles of one gait, some dozens are better",
        )
    if repeat * FASTEST < 1.0:
        raise log.wrong(
            f"the joints repeat every {repeat:.3g} where t is in s",
            instead="give t in s, or in any longer unit",
        )
    if (rows := len(log.t) / count) < ROWS:
        raise log.wrong(
            f"{rows:.1f} rows a cycle are too few", instead=f"give at least {ROWS}"
        )
    gaps = np.diff(log.t)
    k = int(gaps.argmax())
    if many := int((gaps > max(GAP * repeat, 2.5 * np.median(gaps))).sum()):
        which = "its one gap" if many == 1 else f"the longest of {many} gaps"
        raise log.wrong(
            f"no rows for {gaps[k]:.3g} after this one (t = {log.t[k]:.6g}), {gaps[k] / repeat:.2g} of a cycle, {which}",
            k,
            instead=f"cut the log and give the longest part, or fill what is longer than {GAP:g} of a cycle",
        )
    check_rows(log)
    return repeat


def check_a_loop(log: Log, joints: Smoothed, rows: float) -> None:
    """Refuse a joint that shows nothing but noise, and joints that are all proportional: motion to and fro on a line is
    no loop. rows: per cycle."""
    deviations, noise_sizes = (
        joints.values - joints.values.mean(0),
        _noise(joints, rows),
    )
    for name, size, noise in zip(log.joints, deviations.std(0), noise_sizes):
        if size <= noise:
            raise log.wrong(
                f"{name} does not move beyond its noise",
                instead="leave it out with ``columns``",
            )
    _, size, axes = np.linalg.svd(deviations, full_matrices=False)
    if size[1] > max(THIN * size[0], np.sqrt(len(deviations)) * noise_sizes.max()):
        return
    first, last, slope = log.joints[0], log.joints[-1], axes[0, -1] / axes[0, 0]
    raise log.wrong(
        f"{last} is {slope:.3g} times {first}, but for a constant and noise",
        because=f"one shape variable recorded {len(log.joints)} times goes to and fro, and is no loop",
        instead="name the columns of joints that move apart, by ``columns``",
    )


def _noise(joints: Smoothed, rows: float) -> np.ndarray:
    """Return the rms (d,), rad, that noise may have in splines through the joints. rows: per cycle."""
    return SURELY * joints.noise * np.sqrt(joints.knots / rows)


def combined(joints: Smoothed, rows: float) -> dict[int, np.ndarray]:
    """Return the joints that are linear combinations of others, up to a constant and noise, with the factors (d,) of
    these others.

    The others come before them and are not combined themselves. rows: per cycle. Joints of a wave of one harmonic have
    at most two others."""
    deviations, noise = joints.values - joints.values.mean(0), _noise(joints, rows)
    others, factors_of = [0], {}
    for k in range(1, deviations.shape[1]):
        factors = np.zeros(deviations.shape[1])
        factors[others] = np.linalg.lstsq(
            deviations[:, others], deviations[:, k], rcond=None
        )[0]
        residual = (deviations[:, k] - deviations @ factors).std()
        if residual <= max(
            THIN * deviations[:, k].std(),
            np.hypot(noise[k], np.linalg.norm(factors * noise)),
        ):
            factors_of[k] = factors * (
                np.abs(factors) * deviations.std(0) > SLIGHT * deviations[:, k].std()
            )
        else:
            others.append(k)
    return factors_of


def phased(
    log: Log, joints: Smoothed, period: float, harmonics: int
) -> tuple[np.ndarray, Loop]:
    """Return the phase (N,) of each row, rad, increasing, and the mean gait.

    The phase is that of a sine through the joints at first, then that of the nearest point of the mean gait,
    transformed so that it grows at a uniform rate on average. Phase 0 is where the first harmonic of the first joint is
    largest."""
    t = np.linspace(log.t[0], log.t[-1], len(log.t))
    even = np.stack([np.interp(t, log.t, a) for a in joints.values.T], -1)
    at = np.interp(log.t, t, phase.protophase(t, even, period))
    _check_growing(log, at, period)
    at = phase.uniform(at)
    for _ in range(REFINED):
        loop = Loop(phase.fitted_loop(at, joints.values, harmonics))
        at = phase.uniform(loop.projected(joints.values, at))
    at = at - _start(at, joints.values)
    return at, Loop(phase.fitted_loop(at, joints.values, harmonics))


def _start(at: np.ndarray, alpha: np.ndarray) -> float:
    """Return the phase at which the first harmonic of the first joint that swings with it is largest."""
    cos, sin = phase.fitted_loop(at, alpha, 1)[:, 1:].T
    size = np.hypot(cos, sin)
    k = int(np.flatnonzero(size > 0.5 * size.max())[0])
    return float(np.arctan2(sin[k], cos[k]))


def _check_growing(log: Log, at: np.ndarray, period: float) -> None:
    """Refuse a log whose phase stands or runs back: over half a cycle it must grow by at least a fifth of one."""
    inside = np.flatnonzero(
        (log.t > log.t[0] + period / 2) & (log.t < log.t[-1] - period)
    )
    ahead = np.interp(log.t[inside] + period / 2, log.t, at) - at[inside]
    if (bad := np.flatnonzero(ahead < 0.4 * np.pi)).size:
        row = inside[bad[0]]
        raise log.wrong(
            f"the gait stands, slips or runs back after this row (t = {log.t[row]:.6g})",
            row,
            instead="cut pauses and starts out, and give each gait a file",
        )


def cycle_numbers(log: Log, at: np.ndarray, period: float) -> np.ndarray:
    """Return the number (N,) of each row's cycle from 0; -1 in incomplete cycles and too near the ends of the log for a
    phase."""
    inside = (log.t > log.t[0] + period / 2) & (log.t < log.t[-1] - period / 2)
    turns = at / (2 * np.pi)
    first, last = np.ceil(turns[inside].min()), np.floor(turns[inside].max())
    number = np.floor(turns - first).astype(int)
    return np.where(inside & (turns >= first) & (turns < last), number, -1)


def check_no_drift(log: Log, number: np.ndarray, alpha: np.ndarray) -> None:
    """Refuse a joint that drifts from cycle to cycle by more than it swings in one."""
    c = np.arange(number.max() + 1)
    for name, x in zip(log.joints, alpha.T):
        each = [x[number == k] for k in c]
        means, swing = (
            np.array([a.mean() for a in each]),
            float(np.median([np.ptp(a) for a in each])),
        )
        slope, start = np.polyfit(c, means, 1)
        if abs(slope) * c[-1] > max(swing, STEADY * (means - start - slope * c).std()):
            raise log.wrong(
                f"{name} drifts from {means[0]:.3g} to {means[-1]:.3g} over the log and swings by {swing:.2g} in a cycle",
                because="what drifts is no part of a gait",
                instead="leave it out with ``columns``",
            )


def check_one_gait(
    log: Log, at: np.ndarray, number: np.ndarray, alpha: np.ndarray
) -> None:
    """Refuse cycles of two kinds: along the direction in which first harmonics differ most, almost all variance is
    between two groups."""
    count = number.max() + 1
    w = waves(at, 2)
    each = np.array(
        [
            np.linalg.lstsq(w[number == c], alpha[number == c], rcond=None)[0].ravel()
            for c in range(count)
        ]
    )
    deviations = each - each.mean(0)
    size = np.linalg.norm(each.mean(0).reshape(5, -1)[1:])
    score = deviations @ np.linalg.svd(deviations, full_matrices=False)[2][0]
    order = np.sort(score)
    k = np.arange(1, count)
    low = np.cumsum(order)[:-1] / k
    high = (order.sum() - np.cumsum(order)[:-1]) / (count - k)
    between = k * (count - k) / count * (high - low) ** 2
    best = int(between[2:-2].argmax()) + 2 if count > 5 else 0
    kind = score > (order[best] + order[best + 1]) / 2
    share = AFTER if (kind[1:] != kind[:-1]).sum() == 1 else TWO
    distinct = (
        high[best] - low[best] > LEAST_DISTANCE * size
        and min(k[best], count - k[best]) > 2
    )
    if distinct and between[best] > share * (order**2).sum():
        change = int(np.flatnonzero(kind != kind[0])[0])
        row = int(np.flatnonzero(number == change)[0])
        raise log.wrong(
            "two gaits",
            row,
            because=f"{k[best]} cycles are of one kind and {count - k[best]} of another, which begins "
            f"here (t = {log.t[row]:.6g})",
            instead="give each a file",
        )
