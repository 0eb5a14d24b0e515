"""Requirements of a local connection on a velocity, checked at a few shapes and rates.

The check comes before thousands of velocities are computed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.errors import VelocityWarning
from geomech.mathematics.geometry.periods import Periods, periodic_axes
from rft.core.checks import masked_arrays, real_array
from rft.core.notes import warn
from rft.core.refusal import Refusal

Velocity = Callable[[np.ndarray, np.ndarray], np.ndarray]

# Shapes tried, scattered over the grid: more than a body of a field has joints, so that
# the axis of shapes is not taken for an axis of joints.
SHAPES = 11
RATES = 13  # at each shape
TOLERANCE = 1e-3  # of the velocity's rms: larger than errors of solvers and rounding
SAME = 1e-12  # of the velocity's rms: a smaller change with the shape is none


def checked_velocity(
    velocity: Callable,
    axes: Sequence[ArrayLike],
    masked: bool,
    periods: Periods = (),
) -> Callable:
    """Return the velocity, as `geomech.mathematics.geometry.connection.evaluate` takes
    it; a velocity of a single shape is called for one shape at a time.

    `VelocityWarning`, once for all reasons, if it is not odd or not homogeneous in
    alphadot, ignores alpha, or does not have its ``periods``."""
    rng = np.random.default_rng(0)
    alpha = np.stack([rng.uniform(a[0], a[-1], SHAPES) for a in axes], -1)[:, None]
    alpha, rates = np.broadcast_arrays(alpha, rng.normal(size=(RATES, len(axes))))
    velocity = in_batches(velocity, alpha, rates)

    def values(rates, alpha=alpha):
        xi = np.asarray(velocity(alpha, rates), float)
        return np.broadcast_to(xi, (SHAPES, RATES, 3))

    try:
        xi = values(rates)
        backwards = values(-rates)
        twice = values(2 * rates)
        periods_later = []
        for k in periodic_axes(periods):
            later = alpha.copy()
            later[..., k] += periods[k]
            periods_later.append((k, values(rates, later)))
    except ValueError:
        # Of another shape, or refused at these shapes: the fit itself says so in full.
        return velocity
    good = np.isfinite(xi + backwards + twice).all(-1)
    if not good.any() or not (masked or good.all()):
        return velocity
    scale = np.sqrt((xi[good] ** 2).mean())
    if scale == 0:
        return velocity
    faults = _faults(xi, backwards, twice, good, scale)
    for k, later in periods_later:
        deviation = np.nanmax(np.abs((later - xi)[good])) / scale
        if deviation > TOLERANCE:
            faults.append(
                f"is another by {deviation:.2g} of its size after the period "
                f"{periods[k]:.6g} of alpha_{k + 1}"
            )
    if faults:
        warn(f"this velocity {'; it '.join(faults)}", VelocityWarning)
    return velocity


def _faults(xi, backwards, twice, good, scale) -> list[str]:
    """Return the faults of a velocity as words that follow its name.

    xi, backwards, twice: at rates, opposite and double ones, (S, C, 3). good: (S, C),
    where all are finite. scale: rms of xi."""
    faults = []
    deviation = np.abs((backwards + xi)[good]).max() / scale
    if deviation > TOLERANCE:
        faults.append(
            f"is not odd in alphadot (by {deviation:.2g} of its size): a connection "
            "describes only one of each two opposite directions"
        )
    deviation = np.abs((twice - 2 * xi)[good]).max() / scale / 2
    if deviation > TOLERANCE:
        faults.append(
            f"is not homogeneous in alphadot (by {deviation:.2g}): a connection holds "
            "only at |alphadot| = 1"
        )
    if good.all() and np.ptp(xi, axis=0).max() <= SAME * scale:
        faults.append("ignores alpha: is it evaluated at the shape that is passed?")
    return faults


def in_batches(velocity: Callable, alpha, rates) -> Callable:
    """Return the velocity if it takes shapes and rates (S, C, d) at once; else, if it
    takes a single shape and rate, a velocity that calls it for each."""
    shape = (*alpha.shape[:-2], *rates.shape[:-1], 3)
    try:
        if broadcasts_to(velocity(alpha, rates), shape):
            return velocity
    except (TypeError, ValueError, IndexError):
        pass
    each = one_by_one(velocity)
    try:
        each(alpha, rates)
    except (TypeError, ValueError, IndexError):
        return velocity  # the fit itself says what is wrong
    return each


def broadcasts_to(xi, shape) -> bool:
    """Return whether xi broadcasts to velocities of that shape, (..., 3)."""
    given = np.shape(xi)
    if given[-1:] != (3,) or len(given) > len(shape):
        return False
    return all(n in (1, m) for n, m in zip(given[::-1], shape[::-1]))


def one_by_one(velocity: Callable) -> Callable:
    """Return a velocity of many shapes from one of a single shape (d,) and rate
    (d,)."""

    def each(alpha, alphadot):
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        shapes = alpha.reshape(-1, alpha.shape[-1])
        rates = alphadot.reshape(-1, alphadot.shape[-1])
        xi = []
        for shape, rate in zip(shapes, rates):
            xi.append(np.asarray(velocity(shape.copy(), rate.copy()), float))
        if any(x.shape != (3,) for x in xi):
            raise Refusal("velocity must return (3,) for one shape and rate")
        return np.array(xi).reshape(*alpha.shape[:-1], 3)

    return each


class Reporting:
    """A velocity that reports more than xi.

    with_report(alpha, alphadot) returns xi and the report; receive(report) is called in
    the order of the shapes."""

    def __call__(self, alpha, alphadot) -> np.ndarray:
        return self.with_report(alpha, alphadot)[0]


def evaluate(
    velocity: Velocity, alpha: ArrayLike, alphadot: ArrayLike, masked: bool = False
) -> np.ndarray:
    """Return velocity(alpha, alphadot) as (..., 3); Refusal if it does not broadcast to
    that shape, or is not finite unless ``masked``."""
    shape = (*np.broadcast_shapes(alpha.shape, alphadot.shape)[:-1], 3)
    if not callable(velocity):
        raise Refusal(
            "velocity must be a function of alpha and alphadot", value=velocity
        )
    xi = velocity(*np.broadcast_arrays(alpha, alphadot))
    ma = masked_arrays()
    if masked and ma is not None and isinstance(xi, ma.MaskedArray):
        xi = xi.astype(float).filled(np.nan)
    xi = real_array("the value that velocity returns", xi)
    if xi.shape != shape and broadcasts_to(xi, shape):
        xi = np.broadcast_to(xi, shape).copy()
    if xi.shape != shape:
        raise Refusal(
            f"velocity must return shape {shape} for these alpha and alphadot",
            value=xi.shape,
        )
    if not masked and not np.isfinite(xi).all():
        shapes = np.broadcast_to(alpha, (*shape[:-1], alpha.shape[-1]))
        bad = ~np.isfinite(xi).all(-1)
        raise Refusal(f"velocity is not finite at alpha = {shapes[bad][0]}")
    return xi
