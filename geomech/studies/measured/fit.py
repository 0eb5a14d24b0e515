"""The fit of a connection near the mean gait of a log, and its predictions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geomech.io.tables.base import LARGEST_ENTRY
from geomech.mathematics.gaits import Fourier
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.geometry.representations.tube import (
    Loop,
    TaylorSeries,
    Tube,
    covering_grid,
    series,
    tube,
)
from geomech.mathematics.geometry.traits import unit_of
from geomech.mathematics.systems.base import body_size
from geomech.studies.measured import cycles, plausibility, regression, smooth, unknowns
from geomech.studies.measured import phase as phase_module
from geomech.studies.measured.log import Log, read
from geomech.studies.measured.residual import fit_residual
from geomech.studies.measured.spread import DEVIATIONS, spread
from rft.core.checks import in_range
from rft.formulas import se2

HARMONICS = 12  # of the connection and of the gait, at most
PHASES = 128  # of the mean gait, at which it is integrated
PRINTED_PHASES = 24  # phases of printed numbers
DEVIATION_HARMONICS = 3  # of a cycle's deviation from the mean gait
STEP = 0.1  # of that deviation, by which the net pose is differentiated
# Covers the net poses of gaits in sand that pass many shapes where links begin and
# cease to stick.
SAFETY = 2.0
MOST_POINTS = 201  # of a field, along an axis
MOST_SHAPES = 100_000  # of a field, in all


@dataclass(frozen=True, eq=False)
class Fitted:
    """Result of the fit of a log.

    times: (C + 1,), starts of its C full cycles and end of the last. measured,
    predicted: (C, 3), net pose of each cycle, in the body frame at its start, as logged
    and by the connection along the cycle's own shapes. frequency: cycles per unit of t.
    irregular: rms of the phase about a uniform run through each cycle, rad. residual:
    (3,), rms misfit of xi, over the rms of the joint rates; explained: (3,), share of
    the squares of xi that the fit explains. noise: (d + 3,), of the rows' joint angles,
    x, y and heading. across: whether the cycles vary enough to determine A across the
    gait. combined: where they do not because of them, the joints that are linear
    combinations of others, factors (d,) by number. length: of the body in m; None for a
    log in body lengths.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.studies.measured import fit_log, synthetic
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "log.csv"
    >>> log = synthetic.synthetic_log(velocity, Circle(0.8), cycles=20)
    >>> synthetic.save(file, log)
    >>> fit = fit_log(file)
    >>> fit.measured.shape, fit.predicted.shape  # net poses of whole cycles
    ((18, 3), (18, 3))
    """

    log: Log
    taylor: TaylorSeries
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

    @property
    def unit(self) -> str:
        """Unit of lengths, "BL" or "m"."""
        return unit_of(self.length)

    @cached_property
    def gait(self) -> Fourier:
        """Mean gait, of amplitude 1, with the log's frequency if its t is a time."""
        c = self.taylor.loop.coefficients
        return Fourier(
            cos=tuple(map(tuple, c[:, 1::2].tolist())),
            sin=tuple(map(tuple, c[:, 2::2].tolist())),
            centre=tuple(c[:, 0].tolist()),
            frequency=self.frequency if self.log.seconds else None,
        )

    @cached_property
    def displacement(self) -> tuple[np.ndarray, np.ndarray]:
        """Net pose (3,) of the mean gait by the connection, and half width of its
        interval (3,)."""
        net, alpha, alphadot = _net(self.taylor)
        return net, self.taylor.error(alpha, alphadot)

    @cached_property
    def mean(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean net pose (3,) of the logged cycles, and half width of its interval
        (3,)."""
        return mean_pose(self.measured, self.taylor.level)

    @cached_property
    def tube(self) -> Tube:
        """Connection near the mean gait, with a grid for pictures and files."""
        # Three points within the least width that the data reach.
        width = float(np.sqrt(np.einsum("iip->pi", self.taylor.spread).min()))
        extent = max(np.ptp(axis) for axis in covering_grid(self.taylor, 2))
        joints = len(self.log.joints)
        most = min(MOST_POINTS, int(MOST_SHAPES ** (1 / joints)))
        points = int(np.clip(np.ceil(3 * extent / width), min(31, most), most))
        axes = covering_grid(self.taylor, points)
        return tube(self.taylor, axes, self.residual, self.unit, body_size(self))

    def along(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return A (T, 3, d) at phases t of the mean gait, and half widths of its
        interval."""
        return self.taylor.along(t)

    @property
    def misfit(self) -> np.ndarray:
        """Rms (3,) over the phase of the error of A along the gait, from the misfit of
        xi beyond noise and the truncation of the series."""
        return np.sqrt((self.taylor.standard_error[:, 0] ** 2).mean(-1))


def fit_log(
    log: str | Path | Log,
    *,
    columns: Sequence[str] = (),
    degrees: bool = False,
    level: float = 0.95,
    harmonics: int | None = None,
    limits: float | None = None,
    body_length: float | None = None,
) -> Fitted:
    """Fit the connection near the mean gait of a log; Refusal for a log that does not
    determine it.

    columns, degrees: as in `geomech.studies.measured.log.read`. level: share of cases
    in which an interval should contain the truth. harmonics: of the connection in the
    phase; by cross-validation if None. limits (rad): distance from the mean gait up to
    which the connection is given; as far as the data extend if None. body_length: in
    the unit of x and y; None for a log in body lengths.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.studies.measured import fit_log, synthetic
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "log.csv"
    >>> log = synthetic.synthetic_log(velocity, Circle(0.8), cycles=20)
    >>> synthetic.save(file, log)
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
    if not isinstance(log, Log):
        log = read(log, columns, degrees)
    if body_length is not None:
        body_length *= log.size
    period = cycles.period(log)
    rows = len(log.t) * period / (log.t[-1] - log.t[0])
    if harmonics is not None:
        _check_harmonics(log, harmonics, rows)
    joints = smooth.smoothed(log.t, log.alpha, period)
    pose = smooth.smoothed(log.t, log.pose, period)
    cycles.check_a_loop(log, joints, rows)
    most = max(1, int(min(HARMONICS, joints.knots / 2, rows / 4)))
    phase, loop = cycles.phases(log, joints, period, most)
    number = cycles.cycle_numbers(log, phase, period)
    count = number.max() + 1
    if count < cycles.FEWEST:
        raise log.wrong(
            f"{count} full cycles, without the ends of the log, are too few",
            instead=f"give at least {cycles.ENOUGH} in all",
        )
    cycles.check_no_drift(log, number, joints.values)
    cycles.check_one_gait(log, phase, number, joints.values)
    plausibility.check_right_handed(log, loop, phase, joints, pose, number)
    rows_of_log = Rows(log, loop, phase, number, joints, pose)
    combined = cycles.combined(joints, rows)
    fit = _regress(rows_of_log, combined, level, harmonics, limits, body_length)
    plausibility.note_units(log, joints, pose, period, body_length)
    return fit


def _check_harmonics(log: Log, harmonics: int, rows: float) -> None:
    """Refuse more harmonics than the rows per cycle can tell apart, before anything is
    fitted."""
    most = int(min(HARMONICS, rows / 4))
    if harmonics > most:
        raise log.wrong(
            f"``harmonics`` must be at most {most}, a quarter of the {rows:.3g} rows"
            f" per cycle, got {harmonics}"
        )


class Rows(NamedTuple):
    """A log with its phase, cycles and splines.

    loop: the mean gait. phase: (N,), of each row, rad. number: (N,), of its cycle, -1
    outside of full cycles. joints, pose: splines through their columns."""

    log: Log
    loop: Loop
    phase: np.ndarray
    number: np.ndarray
    joints: smooth.Smoothed
    pose: smooth.Smoothed

    def samples(self) -> regression.Samples:
        """Return the samples of the full cycles."""
        inside = self.number >= 0
        halves = []
        for alpha, rate in self.joints.halves:
            halves.append((alpha[inside], rate[inside]))
        xi_halves = []
        for pose, rate in self.pose.halves:
            xi_halves.append(_body_velocity(pose, rate)[inside])
        return regression.Samples(
            phase=self.loop.projected(self.joints.values, self.phase)[inside],
            cycle=self.number[inside],
            alpha=self.joints.values[inside],
            rate=self.joints.rates[inside],
            xi=_body_velocity(self.pose.values, self.pose.rates)[inside],
            halves=tuple(halves),
            xi_halves=tuple(xi_halves),
        )


def _regress(
    rows: Rows,
    combined: dict[int, np.ndarray],
    level: float,
    harmonics: int | None,
    limits: float | None,
    length: float | None,
) -> Fitted:
    """Return the fit of a log; arguments as in `fit_log` and `Fitted`."""
    log = rows.log
    loop = rows.loop
    samples = rows.samples()
    taylor, varies = _taylor_series(rows, samples, level, harmonics, limits)
    across = varies == regression.RATES
    others = [k for k in range(len(log.joints)) if k not in combined]
    if combined and not across:
        selected = regression.select_joints(loop, samples, others)
        if regression.variation(*selected) == varies:
            combined = {}  # leaving them out would not help
    else:
        combined = {}

    times, measured, predicted = _cycle_poses(rows, taylor)
    residual = fit_residual(taylor, samples, varies)
    beyond = _beyond_first_order(taylor, samples, measured, varies)
    taylor = replace(taylor, beyond=beyond, standard_error=residual.standard_error)
    uniform = np.interp(log.t, times, np.interp(times, log.t, rows.phase))
    irregular = np.std((rows.phase - uniform)[rows.number >= 0])
    return Fitted(
        log=log,
        taylor=taylor,
        times=times,
        measured=measured,
        predicted=predicted,
        frequency=(len(times) - 1) / (times[-1] - times[0]),
        irregular=float(irregular),
        residual=residual.residual,
        explained=residual.explained,
        noise=np.concatenate([rows.joints.noise, rows.pose.noise]),
        across=across,
        combined=combined,
        length=length,
        samples=samples,
    )


def _taylor_series(
    rows: Rows,
    samples: regression.Samples,
    level: float,
    harmonics: int | None,
    limits: float | None,
) -> tuple[TaylorSeries, int]:
    """Return the connection about the mean gait, without the errors of
    `_beyond_first_order` and `fit_residual`, and what varies in the cycles."""
    log = rows.log
    loop = rows.loop
    cycle_count = samples.cycle[-1] + 1
    most = int(min(HARMONICS, len(samples.phase) / cycle_count / 4))
    varies = regression.variation(loop, samples)
    size = rows.joints.knots * cycle_count
    try:
        equations, varies = unknowns.selected(
            loop, samples, most, harmonics, varies, size
        )
        coefficients, errors = regression.solution(equations)
    except np.linalg.LinAlgError:
        raise log.wrong(
            "its cycles do not determine so many unknowns",
            instead="lower ``harmonics``, or give more cycles",
        ) from None

    A = equations.split(coefficients, loop)
    errors = equations.split(errors, loop)
    if varies != regression.RATES:
        undetermined = regression.undetermined_errors(loop, A, varies)
        errors = np.concatenate([errors, undetermined])
    largest = max(np.abs(A).max(), np.abs(errors).max())
    if largest > LARGEST_ENTRY:
        raise log.wrong(
            f"entries of A reach {largest:.1g}",
            instead="give x and y in body lengths or m, and choose joints that move",
        )
    taylor = TaylorSeries(
        loop=loop,
        A=A[:, :, 0],
        slope=A[:, :, 1:],
        errors=errors,
        spread=spread(loop, samples, limits, varies > regression.NOTHING),
        beyond=np.zeros(3),
        standard_error=np.zeros((3, 2, 1)),
        factor=regression.interval_factor(len(equations.square), level),
        level=level,
    )
    return taylor, varies


def _beyond_first_order(
    taylor: TaylorSeries,
    samples: regression.Samples,
    measured: np.ndarray,
    varies: int,
) -> np.ndarray:
    """Return the errors (3,) of the net pose beyond those of A and its slopes."""
    # The difference from the measured mean, beyond the error of that mean.
    mean, mean_error = mean_pose(measured, taylor.level)
    square = (_net(taylor)[0] - mean) ** 2 - mean_error**2
    difference = SAFETY * np.sqrt(np.maximum(square, 0.0))

    extent = spread(taylor.loop, samples, None, varies > regression.NOTHING)
    outward = _outward_change(taylor, extent)
    by_gait = taylor.factor * _error_by_gait(taylor, samples)
    return np.sqrt(difference**2 + outward**2 + by_gait**2)


def _body_velocity(pose: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return xi (N, 3) from poses and their rates in the world."""
    return np.column_stack([*se2.rotated(-pose[:, 2], *rate[:, :2].T), rate[:, 2]])


def mean_pose(poses: np.ndarray, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean of net poses (C, 3) of cycles, and half width of its interval.
    Neighbouring cycles are correlated."""
    count = len(poses)
    errors = regression.newey_west_terms((poses - poses.mean(0)) / count)
    standard_error = np.sqrt((errors**2).sum(0))
    return poses.mean(0), regression.interval_factor(count, level) * standard_error


def _net(taylor: TaylorSeries) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the net pose (3,) of the mean gait, its shapes and their rates (PHASES,
    d)."""
    t = 2 * np.pi * np.arange(PHASES) / PHASES
    alpha = taylor.loop.shape(t)
    alphadot = taylor.loop.shape(t, 1)
    xi = np.einsum("nij,nj->ni", taylor.connection(alpha), alphadot)
    return displacement(xi), alpha, alphadot


def _outward_change(taylor: TaylorSeries, extent: np.ndarray) -> np.ndarray:
    """Return the change (3,) of the net pose that the phase of the nearest point causes
    in the mean gait.

    Shapes that lie beside the gait in all directions equally, with variance s^2 in
    each, are on average outside of it by s^2 / 2 times its curvature at their nearest
    points. extent: (d, d, P), `spread` of the data."""
    t = 2 * np.pi * np.arange(PHASES) / PHASES
    alpha = taylor.loop.shape(t)
    rate = taylor.loop.shape(t, 1)
    second = taylor.loop.shape(t, 2)
    square = (rate**2).sum(-1, keepdims=True)
    along = (second * rate).sum(-1, keepdims=True) / square * rate
    curvature = (second - along) / square
    trace = np.einsum("iip->", extent) / extent.shape[-1]
    variance = trace / len(extent) / DEVIATIONS**2
    inside = alpha + variance / 2 * curvature

    wave = 1j * np.arange(PHASES // 2 + 1)[:, None]
    inside_rate = np.fft.irfft(wave * np.fft.rfft(inside, axis=0), PHASES, axis=0)
    xi = np.einsum("nij,nj->ni", taylor.connection(inside), inside_rate)
    return displacement(xi) - _net(taylor)[0]


def _error_by_gait(taylor: TaylorSeries, samples: regression.Samples) -> np.ndarray:
    """Return the standard error (3,) of the net pose by the error of the mean gait,
    whose cycles vary."""
    count = samples.cycle[-1] + 1
    deviation = samples.alpha - taylor.loop.shape(samples.phase)
    fitted = []
    for k in range(count):
        rows = samples.cycle == k
        fitted.append(
            phase_module.fitted_loop(
                samples.phase[rows], deviation[rows], DEVIATION_HARMONICS
            )
        )
    deviations = np.array(fitted) - np.mean(fitted, 0)

    t = 2 * np.pi * np.arange(PHASES) / PHASES
    mean_shape = taylor.loop.shape(t)
    mean_rate = taylor.loop.shape(t, 1)
    alpha = np.array([mean_shape + STEP * series(x, t) for x in deviations])
    alphadot = np.array([mean_rate + STEP * series(x, t, 1) for x in deviations])
    net = displacement(np.einsum("knij,knj->kni", taylor.connection(alpha), alphadot))
    errors = regression.newey_west_terms((net - _net(taylor)[0]) / STEP / count)
    return np.sqrt((errors**2).sum(0))


def _cycle_poses(rows: Rows, taylor: TaylorSeries):
    """Return times (C + 1,), measured (C, 3) and predicted (C, 3) of `Fitted`."""
    from scipy.interpolate import CubicSpline

    t = rows.log.t
    phase = rows.phase
    joints = rows.joints
    first = np.floor(phase[rows.number == 0][0] / (2 * np.pi))
    marks = 2 * np.pi * (first + np.arange(rows.number.max() + 2))
    times = np.interp(marks, np.maximum.accumulate(phase), t)

    # The motion by the connection along the log's own shapes.
    nearest = taylor.loop.projected(joints.values, phase)
    w, terms = taylor.terms(nearest, joints.values, joints.rates)
    xi = np.einsum("ijmk,nk,njm->ni", taylor.combined, w, terms)
    heading = CubicSpline(t, xi[:, 2]).antiderivative()(t)
    velocity = np.exp(1j * heading) * (xi[:, 0] + 1j * xi[:, 1])
    path = CubicSpline(t, velocity).antiderivative()(t)
    predicted = np.stack([path.real, path.imag, heading], -1)

    def net_poses(poses):
        marked = CubicSpline(t, poses)(times)
        return se2.compose(se2.inverse(marked[:-1]), marked[1:])

    return times, net_poses(rows.pose.values), net_poses(predicted)
