"""Smooth midlines: Legendre modes along the body whose coefficients are splines in
time.

Cross-validation finds the numbers of modes and knots that are best for the points.
Slopes and rates need more: with those numbers what smoothing cuts off is several times
their noise. So MORE modes and CLOSER knots are taken, whose noise is by a fifth to a
half larger and covers what they cut off.

x(s, t) and y(s, t) are linear in the data: their least squares have no bias from noise,
and how noise spreads is known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from geomech.studies.measured.midlines.trial import Trial

# Of the splines in time: their rates are of order 5 in the spacing of the knots.
DEGREE = 5
KNOTS = (6, 7, 8, 10, 12, 14, 16, 20, 24, 32)  # per cycle, that are tried
MODES = (4, 14)  # of x and of y along the body, that are tried
# Times the root of the number of points: more modes through equal distances oscillate
# at the ends (Runge).
SAFE = 2.2
# Of the polynomials' argument where more modes are needed: with it 18 modes through 22
# points are stable.
EVEN = 0.95
EVENER = 2  # modes more of that argument, which are as fine for one wave as plain ones
# Factor by which each mode more lessens the part that is cut off, assumed.
FALLS = 2.0
# The same of that argument; measured on slopes of one wave, 10 to 18 modes.
FALLS_EVEN = 1.5
# Modes over points, and modes, at most, of polynomials of that argument.
MOST_EVEN = (0.85, 30)
MORE = 3  # modes than by cross-validation
CLOSER = 1.5  # ratio of its distance between knots to the one taken
CERTAIN = 4.0  # standard deviations of a correlation by noise, beyond which it is none
PASSES = 3  # of finding where along the body the points lie
ALIKE = 0.9  # correlation of noise between frames, at most
HARMONICS = 10  # of a motion that repeats
NODES = 30  # places along the body at which a curve is evaluated


@dataclass(frozen=True, eq=False)
class Curve:
    """Smooth midlines x(s, t) of a trial.

    s: (P,), places of the points, 0 to 1. modes, step: the number of modes, and of rows
    between knots. even: as of `_polynomials`. knots: (K,). coefficients: (K - DEGREE -
    1, modes, 2). residual: (F, modes, 2), noise of the modes in the rows, orthonormal
    over the points. noise: standard deviation of x and y of a point. alike: correlation
    of noise between frames. triangle: (modes, modes), from Legendre coefficients to
    orthonormal ones. solver: of the least squares in time."""

    t: np.ndarray
    s: np.ndarray
    modes: int
    step: int
    even: float
    knots: np.ndarray
    coefficients: np.ndarray
    residual: np.ndarray
    noise: float
    alike: float
    triangle: np.ndarray
    solver: Any

    def at(self, t: np.ndarray, order: int = 0) -> np.ndarray:
        """Return orthonormal coefficients (T, modes, 2) at times t, or their
        derivatives."""
        from scipy.interpolate import BSpline

        return BSpline(self.knots, self.coefficients, DEGREE)(t, nu=order)

    def basis(self, s: np.ndarray, order: int = 0) -> np.ndarray:
        """Return what multiplies orthonormal coefficients at places s (S, modes), or
        its derivative by s."""
        polynomials = _polynomials(s, self.modes, order, self.even)
        return polynomials @ np.linalg.inv(self.triangle)

    @property
    def falls(self) -> float:
        """Factor by which each mode more lessens the part that is cut off."""
        if self.even:
            return FALLS_EVEN
        return FALLS

    @cached_property
    def places(self) -> np.ndarray:
        """Places (NODES,) of equal parts of the body."""
        return (np.arange(NODES) + 0.5) / NODES

    def noisy(self, rng: np.random.Generator) -> Curve:
        """Return the curve with the effect of new noise on top: rows of the residual
        drawn with replacement, with random signs, and as alike as the noise."""
        frames = len(self.t)
        drawn = self.residual[rng.integers(frames, size=frames)]
        rows = drawn * rng.choice([-1.0, 1.0], (frames, 1, 1))
        effect = self.solver(_ar1_filtered(rows, self.alike))
        return replace(self, coefficients=self.coefficients + effect)

    def repeating(self, phase: np.ndarray) -> Curve:
        """Return the curve with little of the noise: the part of its motion that
        follows the phase (F,) of the frames, rad.

        Its mean over a cycle and its first harmonic may vary from one cycle to the
        next; the HARMONICS above repeat."""
        from scipy.interpolate import BSpline

        turns = max(1, round((phase[-1] - phase[0]) / (2 * np.pi)))
        inner = np.linspace(phase.min(), phase.max(), turns + 1)
        knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
        slow = BSpline.design_matrix(phase, knots, 3).toarray()
        most = int(min(HARMONICS, len(phase) / turns / 2 - 1))
        at = np.arange(2, most + 1) * phase[:, None]
        first = [slow * np.cos(phase)[:, None], slow * np.sin(phase)[:, None]]
        columns = np.hstack([slow, *first, np.cos(at), np.sin(at)])
        rows = self.at(self.t).reshape(len(phase), -1)
        found = columns @ np.linalg.lstsq(columns, rows, rcond=None)[0]
        found = found.reshape(len(phase), self.modes, 2)
        return replace(self, coefficients=self.solver(found))


def _ar1_filtered(rows: np.ndarray, correlation: float) -> np.ndarray:
    """Return rows (F, ...) of the variance of independent ones, k apart correlated by
    the k-th power of a number."""
    from scipy.signal import lfilter

    fresh = np.sqrt(1 - correlation**2) * rows[1:]
    innovations = np.concatenate([rows[:1], fresh])
    return lfilter([1.0], [1.0, -correlation], innovations, axis=0)


def placed(basis: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return x + i y (T, S) at places, from `Curve.basis` (S, modes) and coefficients
    (T, modes, 2)."""
    return (z @ [1.0, 1j]) @ basis.T


def _polynomials(
    s: np.ndarray, modes: int, order: int, even: float = 0.0
) -> np.ndarray:
    """Return Legendre polynomials (S, modes) of u at places s, or their derivatives by
    s.

    u = 2 s - 1, or, if ``even`` is above 0, sin(a (2 s - 1)) / even with a =
    arcsin(even): equal distances in s are then small at the ends in u, as those of
    stable polynomials are, and a wave needs three modes in place of four and more.
    Source: Kosloff and Tal-Ezer, J. Comput. Phys. 104, 457 (1993)."""
    identity = np.eye(modes)
    u = 2 * s - 1
    rate = np.full_like(u, 2.0)
    if even:
        angle = np.arcsin(even) * u
        u = np.sin(angle) / even
        rate = 2 * np.arcsin(even) / even * np.cos(angle)
    if not order:
        return legendre.legvander(u, modes - 1)
    slopes = legendre.legder(identity, 1, axis=0)
    return rate[:, None] * (legendre.legvander(u, modes - 2) @ slopes)


class Solver:
    """Least squares by splines in time with a knot at every ``step``-th row: linear in
    the rows, factored once."""

    def __init__(self, t: np.ndarray, step: int):
        from scipy.interpolate import BSpline
        from scipy.linalg import cholesky_banded

        inner = t[step : len(t) - step : step]
        self.knots = np.concatenate(
            [[t[0]] * (DEGREE + 1), inner, [t[-1]] * (DEGREE + 1)]
        )
        self.design = BSpline.design_matrix(t, self.knots, DEGREE).tocsr()
        normal = (self.design.T @ self.design).todia()
        self.count = self.design.shape[1]
        banded = np.zeros((DEGREE + 1, self.count))
        for offset, row in zip(normal.offsets, normal.data):
            if offset >= 0:
                banded[DEGREE - offset, : len(row)] = row[: self.count]
        banded[DEGREE] *= 1 + 1e-12
        self.factor = cholesky_banded(banded)

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """Return the splines' coefficients (K, ...) through rows (F, ...)."""
        from scipy.linalg import cho_solve_banded

        right = self.design.T @ rows.reshape(len(rows), -1)
        coefficients = cho_solve_banded((self.factor, False), right)
        return coefficients.reshape(-1, *rows.shape[1:])

    def smoothed(self, rows: np.ndarray) -> np.ndarray:
        """Return the splines through rows (F, C) at the rows."""
        return self.design @ self(rows)


def crude(trial: Trial) -> np.ndarray:
    """Return headings (F, 8) along the body from few modes frame by frame, less their
    mean, rad."""
    heading = np.unwrap(np.angle(_crude_tangents(trial)), axis=1)
    return heading - heading.mean(1, keepdims=True)


def crude_length(trial: Trial) -> float:
    """Return the mean length of the body from few modes frame by frame, in the trial's
    unit."""
    return float(np.abs(_crude_tangents(trial)).mean())


def _crude_tangents(trial: Trial) -> np.ndarray:
    """Return derivatives (F, 8) of x + iy by the share of the body's length, at eight
    places along it."""
    s = _chord_places(trial.points)
    z, triangle, _ = projected(trial.points, s, min(6, len(s) - 1))
    places = (np.arange(8) + 0.5) / 8
    slope = _polynomials(places, len(triangle), 1) @ np.linalg.inv(triangle)
    return placed(slope, z)


def _chord_places(points: np.ndarray) -> np.ndarray:
    """Return the shares (P,) of the body's length at which points lie, by their
    chords."""
    chord = np.median(np.hypot(*np.moveaxis(np.diff(points, axis=1), -1, 0)), 0)
    s = np.concatenate([[0.0], np.cumsum(chord)])
    return s / s[-1]


def projected(
    points: np.ndarray, s: np.ndarray, modes: int, even: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return orthonormal coefficients (F, modes, 2) of frames, what makes them from
    those of `_polynomials`, and what they leave of the frames (F, P, 2)."""
    q, triangle = np.linalg.qr(_polynomials(s, modes, 0, even))
    z = q.T @ points
    return z, triangle, points - q @ z


def filled(trial: Trial) -> Trial:
    """Return the trial with missing points interpolated in time, point by point;
    `fitted` replaces them."""
    from scipy.interpolate import PchipInterpolator

    missing = np.isnan(trial.points[..., 0])
    points = trial.points.copy()
    for p in np.flatnonzero(missing.any(0)):
        known = ~missing[:, p]
        inside = np.clip(trial.t, *trial.t[known][[0, -1]])
        curve = PchipInterpolator(trial.t[known], points[known, p])
        points[:, p] = np.where(known[:, None], points[:, p], curve(inside))
    return replace(trial, points=points, filled=missing)


def fitted(trial: Trial, period: float) -> tuple[Curve, Trial]:
    """Return the smooth midlines of a trial, finer than by generalised
    cross-validation, and the trial with the smooth midlines where points were
    missing."""
    s = _chord_places(trial.points)
    rows = len(trial.t) * period / (trial.t[-1] - trial.t[0])
    steps = {max(2, round(rows / n)) for n in KNOTS}
    solvers = {step: Solver(trial.t, step) for step in sorted(steps)}
    even, modes, step = _chosen(trial, s, solvers, period)
    for _ in range(PASSES):
        curve = _curve(trial, s, modes, step, solvers[step], even)
        trial = _completed(trial, curve)
        s = _arc_places(curve, s)
    even, modes, step = _chosen(trial, s, solvers, period)
    most = _most(len(s))
    if not even and modes + MORE > most[even] and most[EVEN] > most[even]:
        # Plain ones oscillate at the ends; as fine ones of an even argument are EVENER
        # more.
        even = EVEN
        modes += EVENER
    modes = min(modes + MORE, most[even])
    return curve_of(trial, s, modes, max(2, round(step / CLOSER)), even), trial


def _most(points: int) -> dict[float, int]:
    """Return how many modes so many points bear, by the argument ``even`` of
    `_polynomials`."""
    plain = min(MODES[1], int(SAFE * np.sqrt(points)), points - 1)
    share, most = MOST_EVEN
    return {0.0: plain, EVEN: max(plain, min(most, int(share * points)))}


def _completed(trial: Trial, curve: Curve) -> Trial:
    """Return the trial with points of the curve where there were none: so the least
    squares of what is known converge."""
    if not trial.filled.any():
        return trial
    smooth = curve.basis(curve.s) @ curve.at(trial.t)
    points = np.where(trial.filled[..., None], smooth, trial.points)
    return replace(trial, points=points)


def coarser(trial: Trial, curve: Curve) -> Curve:
    """Return the curve with fewer modes and knots, whose difference from it shows what
    smoothing cuts off."""
    modes = max(curve.modes - MORE, min(MODES[0], curve.modes - 1))
    return curve_of(trial, curve.s, modes, round(CLOSER * curve.step), curve.even)


def curve_of(
    trial: Trial, s: np.ndarray, modes: int, step: int, even: float = 0.0
) -> Curve:
    """Return the curve with these places of points (P,), modes, and rows between knots.
    even: as of `_polynomials`."""
    return _curve(trial, s, modes, step, Solver(trial.t, step), even)


def _chosen(
    trial: Trial, s: np.ndarray, solvers: dict[int, Solver], period: float
) -> tuple[float, int, int]:
    """Return the argument of the polynomials, modes and rows between knots.

    They are those of the least generalised cross-validation among plain polynomials,
    unless what these leave of the frames repeats: then as many of an even argument as
    leave nothing that repeats. Noise that is alike from frame to frame would have
    cross-validation take all modes."""
    plain, most = _most(len(s)).values()
    tried = range(min(MODES[0], plain), plain + 1)
    _, modes, step = _least(trial, s, solvers, 0.0, tried)
    if not _repeats(trial, projected(trial.points, s, plain)[2], plain, period):
        return 0.0, modes, step
    modes = plain
    while modes < most:
        modes += 1
        left = projected(trial.points, s, modes, EVEN)[2]
        if not _repeats(trial, left, modes, period):
            break
    _, modes, step = _least(trial, s, solvers, EVEN, range(modes, modes + 1))
    return EVEN, modes, step


def _least(
    trial: Trial, s: np.ndarray, solvers: dict[int, Solver], even: float, tried: range
) -> tuple[float, int, int]:
    """Return the least score of generalised cross-validation, its modes, and its rows
    between knots."""
    z, _, left = projected(trial.points, s, tried[-1], even)
    count = trial.n_observed
    scores = []
    for step, solver in solvers.items():
        smoothed = solver.smoothed(z.reshape(len(z), -1)).reshape(z.shape)
        square = ((z - smoothed) ** 2).sum((0, 2))
        for modes in tried:
            residual = (left**2).sum() + square[:modes].sum()
            residual = residual + (z[:, modes:] ** 2).sum()
            share = 2 * modes * solver.count / count
            scores.append((residual / (1 - share) ** 2, modes, step))
    return min(scores)


def _repeats(trial: Trial, left: np.ndarray, modes: int, period: float) -> bool:
    """Return whether what modes leave of the frames (F, P, 2) is like itself a period
    later, beyond what noise is."""
    first = np.flatnonzero(trial.t + period <= trial.t[-1])
    free = left.shape[1] - modes
    if len(first) < 2 or free < 1:
        return False
    later = np.clip(np.searchsorted(trial.t, trial.t[first] + period), 1, None)
    step = trial.t[later] - trial.t[later - 1]
    share = (trial.t[later] - trial.t[first] - period) / step
    share = share[:, None, None]
    after = share * left[later - 1] + (1 - share) * left[later]
    size = np.sqrt((left[first] ** 2).sum() * (after**2).sum())
    # Neighbouring frames that are alike are fewer; of independent ones a correlation
    # varies by the root of their number.
    alike = _correlation(left)
    number = 2 * free * len(first) * (1 - alike**2) / (1 + alike**2)
    return (left[first] * after).sum() > CERTAIN * size / np.sqrt(number)


def _correlation(left: np.ndarray) -> float:
    """Return how alike what modes leave of the frames (F, P, 2) is from one to the
    next, up to ALIKE."""
    like = (left[1:] * left[:-1]).sum() / max((left**2).sum(), 1e-300)
    return float(np.clip(like, 0.0, ALIKE))


def _curve(
    trial: Trial, s: np.ndarray, modes: int, step: int, solver: Solver, even: float
) -> Curve:
    """Return the curve with these places, modes and knots; arguments as in `Curve`."""
    z, triangle, left = projected(trial.points, s, modes, even)
    coefficients = solver(z)
    fitted = solver.design @ coefficients.reshape(solver.count, -1)
    residual = z - fitted.reshape(z.shape)
    # What modes leave of the frames shows how alike noise is from one to the next; the
    # more it is, the more of it a spline takes along.
    alike = _correlation(left)
    drawn = np.random.default_rng(0).normal(size=(len(trial.t), 2 * NODES))
    correlated = _ar1_filtered(drawn, alike)
    remaining = ((correlated - solver.smoothed(correlated)) ** 2).sum()
    white = ((drawn - solver.smoothed(drawn)) ** 2).sum()
    free = 1 - solver.count / len(trial.t)
    residual = residual / np.sqrt(free * remaining / white)
    noise = np.sqrt(((left**2).sum() + (residual**2).sum()) / trial.n_observed)
    return Curve(
        trial.t,
        s,
        modes,
        step,
        even,
        solver.knots,
        coefficients,
        residual,
        float(noise),
        alike,
        triangle,
        solver,
    )


def _arc_places(curve: Curve, s: np.ndarray) -> np.ndarray:
    """Return the shares (P,) of the curve's own length, mean over the frames, at which
    points of s (P,) lie."""
    fine = np.linspace(0, 1, 201)
    speed = np.abs(placed(curve.basis(fine, 1), curve.at(curve.t))).mean(0)
    arc = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    return np.interp(s, fine, arc / arc[-1])
