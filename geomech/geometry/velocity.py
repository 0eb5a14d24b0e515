"""What a local connection requires of a velocity, checked at a few shapes and rates before thousands are computed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.errors import VelocityWarning
from rft.checks import masked_arrays, real_array
from rft.refusal import Refusal

Velocity = Callable[[np.ndarray, np.ndarray], np.ndarray]

SHAPES = 11  # tried, scattered over the grid; more than a body of a field has joints, so that none is taken for one
RATES = 13  # at each
TOLERANCE = 1e-3  # of the velocity's rms: more than solvers and roundings leave
SAME = 1e-12  # of it: what does not depend on the shape at all


def checked_velocity(
    velocity: Callable, axes: Sequence[ArrayLike], masked: bool
) -> Callable:
    """Return the velocity, as `geomech.geometry.connection.evaluate` takes it; one for a single shape is called one by
    one. Warn (`VelocityWarning`, once for all reasons) if it is not odd or not homogeneous in alphadot, or ignores
    alpha."""
    rng = np.random.default_rng(0)
    alpha = np.stack([rng.uniform(a[0], a[-1], SHAPES) for a in axes], -1)[:, None]
    alpha, rates = np.broadcast_arrays(alpha, rng.normal(size=(RATES, len(axes))))
    velocity = in_batches(velocity, alpha, rates)
    values = lambda rates: np.broadcast_to(
        np.asarray(velocity(alpha, rates), float), (SHAPES, RATES, 3)
    )
    try:
        xi, backwards, twice = values(rates), values(-rates), values(2 * rates)
    except ValueError:  # of another shape, or refused at these shapes: told in full where the grid is asked for
        return velocity
    good = np.isfinite(xi + backwards + twice).all(-1)
    if (
        (masked or good.all())
        and good.any()
        and (scale := np.sqrt((xi[good] ** 2).mean())) > 0
    ):
        lacks = _lacking(xi, backwards, twice, good, scale)
        if lacks:
            warnings.warn(
                f"this velocity {'; it '.join(lacks)}", VelocityWarning, stacklevel=3
            )
    return velocity


def _lacking(xi, backwards, twice, good, scale) -> list[str]:
    difference_over_size = lambda difference: np.abs(difference[good]).max() / scale
    lacks = []
    if (deviation := difference_over_size(backwards + xi)) > TOLERANCE:
        lacks.append(
            f"is not odd in alphadot (off by {deviation:.2g} of its size): a connection tells one direction of each two"
        )
    if (deviation := difference_over_size(twice - 2 * xi) / 2) > TOLERANCE:
        lacks.append(
            f"is not homogeneous in alphadot (off by {deviation:.2g}): a connection holds at |alphadot| = 1 only"
        )
    if (
        np.ptp(np.where(good[..., None], xi, xi[good][0]), axis=0).max() <= SAME * scale
        and good.all()
    ):
        lacks.append("ignores alpha: is it asked for at the shape that is passed?")
    return lacks


def in_batches(velocity: Callable, alpha, rates) -> Callable:
    """Return the velocity if it takes shapes and rates (S, C, d) at once; else, if it takes a single shape and rate,
    one that calls it for each."""
    try:
        if broadcasts_to(
            velocity(alpha, rates), (*alpha.shape[:-2], *rates.shape[:-1], 3)
        ):
            return velocity
    except (TypeError, ValueError, IndexError):
        pass
    each = one_by_one(velocity)
    try:
        each(alpha, rates)
    except (TypeError, ValueError, IndexError):
        return velocity  # says itself what is wrong
    return each


def broadcasts_to(xi, shape) -> bool:
    """Return whether xi broadcasts to velocities of that shape, (..., 3)."""
    given = np.shape(xi)
    return (
        given[-1:] == (3,)
        and len(given) <= len(shape)
        and all(n in (1, m) for n, m in zip(given[::-1], shape[::-1]))
    )


def one_by_one(velocity: Callable) -> Callable:
    """Return a velocity of many shapes from one of a single shape (d,) and rate (d,)."""

    def each(alpha, alphadot):
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        pairs = zip(
            alpha.reshape(-1, alpha.shape[-1]), alphadot.reshape(-1, alphadot.shape[-1])
        )
        xi = [np.asarray(velocity(a.copy(), r.copy()), float) for a, r in pairs]
        if any(x.shape != (3,) for x in xi):
            raise Refusal("velocity must return (3,) for one shape and rate")
        return np.array(xi).reshape(*alpha.shape[:-1], 3)

    return each


class Reporting:
    """A velocity that reports more than xi: with_report(alpha, alphadot) returns xi and the report, and receive(report)
    is called in the order of the shapes."""

    def __call__(self, alpha, alphadot) -> np.ndarray:
        return self.with_report(alpha, alphadot)[0]


def evaluate(
    velocity: Velocity, alpha: ArrayLike, alphadot: ArrayLike, masked: bool = False
) -> np.ndarray:
    """Return velocity(alpha, alphadot); Refusal if that does not broadcast to (..., 3), or is not finite unless
    ``masked``."""
    shape = (*np.broadcast_shapes(alpha.shape, alphadot.shape)[:-1], 3)
    if not callable(velocity):
        raise Refusal(
            "velocity must be a function of alpha and alphadot", value=velocity
        )
    xi = velocity(*np.broadcast_arrays(alpha, alphadot))
    ma = masked_arrays()
    if masked and ma is not None and isinstance(xi, ma.MaskedArray):
        xi = xi.astype(float).filled(np.nan)
    xi = real_array("what velocity returns", xi)
    if xi.shape != shape and broadcasts_to(xi, shape):
        xi = np.broadcast_to(xi, shape).copy()
    if xi.shape != shape:
        raise Refusal(
            f"velocity must return shape {shape} for these alpha and alphadot",
            value=xi.shape,
        )
    if not masked and not np.isfinite(xi).all():
        where = np.broadcast_to(alpha, (*shape[:-1], alpha.shape[-1]))[
            ~np.isfinite(xi).all(-1)
        ][0]
        raise Refusal(f"velocity is not finite at alpha = {where}")
    return xi
