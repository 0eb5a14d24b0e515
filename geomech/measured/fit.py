"""The fit of a connection near the mean gait of a log, and its predictions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from geomech.gaits import Fourier
from geomech.geometry.reconstruct import displacement
from geomech.geometry.traits import unit_of
from geomech.geometry.tube import Loop, TaylorSeries, Tube, covering_grid, series, tube
from geomech.io.tables.base import LARGEST_ENTRY
from geomech.measured import cycles, plausibility, regression, smooth, unknowns
from geomech.measured import phase as phase_module
from geomech.measured.log import Log, read
from geomech.measured.residual import residual_of
from geomech.measured.spread import DEVIATIONS, spread
from geomech.systems.base import body_size
from rft.core.checks import in_range
from rft.formulas import se2

HARMONICS = 12  # of the connection and of the gait, at most
PHASES = 128  # of the mean gait, at which it is integrated
PRINTED_PHASES = 24  # phases of printed numbers
DEVIATING = 3  # harmonics of a cycle's deviation from the mean gait
PART = 0.1  # of it, by which the net pose is differentiated
SAFETY = 2.0  # covers the net poses of gaits in sand that pass many places where links begin and cease to stick
MOST_POINTS, MOST_SHAPES = 201, 100_000  # of a field, along an axis and in all


@dataclass(frozen=True, eq=False)
class Fitted:
    """Result of the fit of a log.

    times: (C + 1,), starts of its C full cycles and end of the last. measured, predicted: (C, 3), net pose of each
    cycle, in the body frame at its start, as logged and by the connection along the cycle's own shapes. frequency:
    cycles per unit of t. irregular: rms of the phase about a uniform run through each cycle, rad. residual: (3,), rms
    misfit of xi, over that of the joint rates; explained: (3,), share of the squares of xi that the fit explains.
    noise: (d + 3,), of the rows' joint angles, x, y and heading. across: whether the cycles vary enough to determine A
    across the gait. combined: joints that are linear combinations of others, factors (d,) by number, where these are
    why they do not. length: of the body in m; None for a log in body lengths.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from geomech.gaits import Circle
    >>> from geomech.measured import fit_log, synthetic
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "log.csv"
    >>> synthetic.save(file, synthetic.made(velocity, Circle(0.8), cycles=20))
    >>> fit = fit_log(file)
    >>> fit.measured.shape, fit.predicted.shape  # net poses of whole cycles
    ((18, 3), (18, 3))
    """

    log: Log
    known: TaylorSeries
    times: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    frequency: float
    irregular: float
    residual: np.ndarray
    explained: np.ndarray
    noise: np.ndarray
    across: bool
    combined: dict[int, np.ndarray]
    length: float | None
    samples: regression.Samples

    unit = property(lambda self: unit_of(self.length))

    @cached_property
    def gait(self) -> Fourier:
        """Mean gait, of amplitude 1, with the log's frequency if its t is a time."""
        c = self.known.loop.coefficients
        cos, sin = (tuple(map(tuple, c[:, k::2].tolist())) for k in (1, 2))
        frequency = self.frequency if self.log.seconds else None
        return Fourier(
            cos=cos, sin=sin, centre=tuple(c[:, 0].tolist()), frequency=frequency
        )

    @cached_property
    def displacement(self) -> tuple[np.ndarray, np.ndarray]:
        """Net pose (3,) of the mean gait by the connection, and half width of its interval (3,)."""
        net, alpha, alphadot = _net(self.known)
        return net, self.known.error(alpha, alphadot)

    @cached_property
    def mean(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean net pose (3,) of the logged cycles, and half width of its interval (3,)."""
        return mean_of(self.measured, self.known.level)

    @cached_property
    def tube(self) -> Tube:
        """Connection near the mean gait, with a grid for pictures and files."""
        wide = float(np.sqrt(np.einsum("iip->pi", self.known.spread).min()))
        extent = max(np.ptp(a) for a in covering_grid(self.known, 2))
        joints = len(self.log.joints)
        most = min(MOST_POINTS, int(MOST_SHAPES ** (1 / joints)))
        points = int(np.clip(np.ceil(3 * extent / wide), min(31, most), most))
        return tube(
            self.known,
            covering_grid(self.known, points),
            self.residual,
            self.unit,
            body_size(self),
        )

    def along(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return A (T, 3, d) at phases t of the mean gait, and half widths of its interval."""
        return self.known.along(t)

    @property
    def misfit(self) -> np.ndarray:
        """Rms (3,) over the phase of the error of A along the gait, from the misfit of xi beyond noise and the
        truncation of the series."""
        return np.sqrt((self.known.standard_error[:, 0] ** 2).mean(-1))


def fit_log(
    log: str | Path | Log, *, columns: Sequence[str] = (), degrees: bool = False, level: float = 0.95,
    harmonics: int | None = None, limits: float | None = None, body_length: float | None = None,
) -> Fitted:  # fmt: skip
    """Fit the connection near the mean gait of a log; Refusal for a log that does not determine it.

    columns, degrees: as in `geomech.measured.log.read`. level: share of cases in which an interval should contain the
    truth. harmonics: of the connection in the phase; by cross-validation if None. limits (rad): distance from the mean
    gait up to which the connection is given; as far as the data extend if None. body_length: in the unit
    of x and y; None for a log in body lengths.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from geomech.gaits import Circle
    >>> from geomech.measured import fit_log, synthetic
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "log.csv"
    >>> synthetic.save(file, synthetic.made(velocity, Circle(0.8), cycles=20))
    >>> fit = fit_log(file)
    >>> fit.gait.joints, len(fit.measured)  # joints, and whole cycles
    (2, 18)
    """
    in_range("``level``", level, 0.5, 0.999)
    if body_length is not None:
        in_range("``body_length``", body_length, 1e-9, 1e9)
    if harmonics is not None:
        in_range("``harmonics``", harmonics, 1, HARMONICS, whole=True)
    if limits is not None:
        in_range("``limits``", limits, 1e-6, 10)
    log = log if isinstance(log, Log) else read(log, columns, degrees)
    if body_length is not None:
        body_length *= log.size
    period = cycles.period(log)
    joints, pose = (smooth.smoothed(log.t, x, period) for x in (log.alpha, log.pose))
    rows = len(log.t) * period / (log.t[-1] - log.t[0])
    cycles.check_a_loop(log, joints, rows)
    most = max(1, int(min(HARMONICS, joints.knots / 2, rows / 4)))
    phase, loop = cycles.phased(log, joints, period, most)
    count = cycles.cycle_numbers(log, phase, period)
    if count.max() + 1 < cycles.FEWEST:
        raise log.wrong(
            f"{count.max() + 1} whole cycles, without the log's ends, are too few",
            instead=f"give at least {cycles.ENOUGH} in all",
        )
    cycles.check_no_drift(log, count, joints.values)
    cycles.check_one_gait(log, phase, count, joints.values)
    plausibility.check_right_handed(log, loop, phase, joints, pose, count)
    combined = cycles.combined(joints, rows)
    fit = _regressed(
        log,
        loop,
        phase,
        count,
        joints,
        pose,
        combined,
        level,
        harmonics,
        limits,
        body_length,
    )
    plausibility.note_units(log, joints, pose, period, body_length)
    return fit


def _regressed(
    log,
    loop: Loop,
    phase,
    count,
    joints,
    pose,
    combined,
    level,
    harmonics,
    limits,
    length,
) -> Fitted:
    inside = count >= 0
    xi, *xi_halves = (
        _in_the_body(*x)[inside] for x in ((pose.values, pose.rates), *pose.halves)
    )
    halves = tuple((a[inside], u[inside]) for a, u in joints.halves)
    nearest = loop.projected(joints.values, phase)
    samples = regression.Samples(
        nearest[inside],
        count[inside],
        joints.values[inside],
        joints.rates[inside],
        xi,
        halves,
        tuple(xi_halves),
    )
    varies = regression.varied(loop, samples)
    most = int(min(HARMONICS, len(samples.phase) / (samples.cycle[-1] + 1) / 4))
    if harmonics is not None and harmonics > most:
        raise log.wrong(
            f"``harmonics`` must be at most {most}, a quarter of the rows of a cycle, got {harmonics}"
        )
    size = joints.knots * (samples.cycle[-1] + 1)
    try:
        equations, varies = unknowns.selected(
            loop, samples, most, harmonics, varies, size
        )
        coefficients, errors = regression.solution(equations)
    except np.linalg.LinAlgError:
        raise log.wrong(
            "its cycles do not settle so many unknowns",
            instead="lower ``harmonics``, or give more cycles",
        ) from None
    across, others = (
        varies == regression.RATES,
        [k for k in range(len(log.joints)) if k not in combined],
    )
    if (
        not combined
        or across
        or regression.varied(*regression.of_joints(loop, samples, others)) == varies
    ):
        combined = {}  # leaving them out would not help
    A, errors = (equations.split(x, loop) for x in (coefficients, errors))
    if not across:
        errors = np.concatenate([errors, regression.unknown(loop, A, varies)])
    known = TaylorSeries(
        loop, A[:, :, 0], A[:, :, 1:], errors, spread(loop, samples, limits, varies > regression.NOTHING), np.zeros(3),
        np.zeros((3, 2, 1)), regression.factor(len(equations.square), level), level,
    )  # fmt: skip
    if (
        largest := max(np.abs(known.combined).max(), np.abs(known.errors).max())
    ) > LARGEST_ENTRY:
        raise log.wrong(
            f"entries of A come out as large as {largest:.1g}",
            instead="give x and y in body lengths or m, and joints that move",
        )
    times, measured, predicted = _cycles(log, known, phase, count, joints, pose)
    mean, mean_error = mean_of(measured, level)
    square = (_net(known)[0] - mean) ** 2 - mean_error**2  # less the error of the mean
    beyond = SAFETY * np.sqrt(np.maximum(square, 0.0))
    residual = residual_of(known, samples, varies)
    outward = _outward(known, spread(loop, samples, None, varies > regression.NOTHING))
    beyond = np.sqrt(
        beyond**2 + outward**2 + (known.factor * _by_gait(known, samples)) ** 2
    )
    known = replace(known, beyond=beyond, standard_error=residual.standard_error)
    frequency = (len(times) - 1) / (times[-1] - times[0])
    uniform = np.interp(log.t, times, np.interp(times, log.t, phase))
    return Fitted(
        log, known, times, measured, predicted, frequency, float(np.std((phase - uniform)[inside])),
        residual.residual, residual.explained, np.concatenate([joints.noise, pose.noise]), across, combined, length,
        samples,
    )  # fmt: skip


def _in_the_body(pose: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return xi (N, 3) from poses and their rates in the world."""
    return np.column_stack([*se2.rotated(-pose[:, 2], *rate[:, :2].T), rate[:, 2]])


def mean_of(poses: np.ndarray, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean of net poses (C, 3) of cycles, and half width of its interval. Neighbouring cycles are
    correlated."""
    errors = regression.lagged((poses - poses.mean(0)) / len(poses))
    return poses.mean(0), regression.factor(len(poses), level) * np.sqrt(
        (errors**2).sum(0)
    )


def _net(known: TaylorSeries) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the net pose (3,) of the mean gait, its shapes and their rates (PHASES, d)."""
    t = 2 * np.pi * np.arange(PHASES) / PHASES
    alpha, alphadot = known.loop.shape(t), known.loop.shape(t, 1)
    return (
        displacement(np.einsum("nij,nj->ni", known.connection(alpha), alphadot)),
        alpha,
        alphadot,
    )


def _outward(known: TaylorSeries, extent: np.ndarray) -> np.ndarray:
    """Return the change (3,) of the net pose by what the phase of the nearest point does to the mean gait.

    Shapes that lie beside the gait in all directions alike, with variance s^2 in each, are on average outside of it by
    s^2 / 2 times its curvature at their nearest points. extent: (d, d, P), `spread` of the data."""
    t = 2 * np.pi * np.arange(PHASES) / PHASES
    alpha, rate, second = (known.loop.shape(t, order) for order in range(3))
    along = (rate**2).sum(-1, keepdims=True)
    curvature = (second - (second * rate).sum(-1, keepdims=True) / along * rate) / along
    across = np.einsum("iip->", extent) / extent.shape[-1] / len(extent) / DEVIATIONS**2
    inside = alpha + across / 2 * curvature
    wave = 1j * np.arange(PHASES // 2 + 1)[:, None]
    inside_rate = np.fft.irfft(wave * np.fft.rfft(inside, axis=0), PHASES, axis=0)
    return (
        displacement(np.einsum("nij,nj->ni", known.connection(inside), inside_rate))
        - _net(known)[0]
    )


def _by_gait(known: TaylorSeries, samples: regression.Samples) -> np.ndarray:
    """Return the standard error (3,) of the net pose by that of the mean gait, whose cycles vary."""
    cycles = samples.cycle[-1] + 1
    deviation = samples.alpha - known.loop.shape(samples.phase)
    t, each = 2 * np.pi * np.arange(PHASES) / PHASES, []
    for k in range(cycles):
        rows = samples.cycle == k
        each.append(
            phase_module.fitted_loop(samples.phase[rows], deviation[rows], DEVIATING)
        )
    each = np.array(each) - np.mean(each, 0)
    loops = [
        (
            known.loop.shape(t) + PART * series(x, t),
            known.loop.shape(t, 1) + PART * series(x, t, 1),
        )
        for x in each
    ]
    alpha, alphadot = (np.array(x) for x in zip(*loops))
    net = displacement(np.einsum("knij,knj->kni", known.connection(alpha), alphadot))
    errors = regression.lagged((net - _net(known)[0]) / PART / cycles)
    return np.sqrt((errors**2).sum(0))


def _cycles(log: Log, known: TaylorSeries, phase, count, joints, pose):
    """Return times (C + 1,), measured (C, 3) and predicted (C, 3) of `Fitted`."""
    from scipy.interpolate import CubicSpline

    first = np.floor(phase[count == 0][0] / (2 * np.pi))
    marks = 2 * np.pi * (first + np.arange(count.max() + 2))
    growing = np.maximum.accumulate(phase)
    times = np.interp(marks, growing, log.t)
    w, terms = known.terms(
        known.loop.projected(joints.values, phase), joints.values, joints.rates
    )
    xi = np.einsum("ijmk,nk,njm->ni", known.combined, w, terms)
    heading = CubicSpline(log.t, xi[:, 2]).antiderivative()(log.t)
    path = CubicSpline(
        log.t, np.exp(1j * heading) * (xi[:, 0] + 1j * xi[:, 1])
    ).antiderivative()(log.t)
    poses = (pose.values, np.stack([path.real, path.imag, heading], -1))
    each = []
    for g in poses:
        at = CubicSpline(log.t, g)(times)
        each.append(se2.compose(se2.inverse(at[:-1]), at[1:]))
    return times, *each
