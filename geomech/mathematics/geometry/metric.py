"""The metric of shape space: the cost of a change of shape, by the power that it takes.

In a linear medium power is quadratic in the rate of shape, P = alphadot^T M(alpha)
alphadot with the dissipation metric M. The length of a path, the integral of sqrt(P),
is the time of its fastest run at given mean power (R. L. Hatton and H. Choset, Eur.
Phys. J. Special Topics 224, 3141 (2015)). In a dry medium power is homogeneous of
degree one in alphadot and does not distinguish slow from fast: F = P(alpha, alphadot)
is a Finsler norm, and the length of a path is the work along it. Either way

    length = integral of F(alpha, alphadot) dt,     F(alpha, c alphadot) = |c| F(alpha,
    alphadot),

which does not depend on the gait's pacing. F is in sqrt(drag length / time) x time, or
drag length, per rad; drag is the axial drag of the whole body (`rft.work_done`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import cached_property, partial

import numpy as np

from geomech.core.work import Map, each
from geomech.mathematics.geometry.connection import (
    SAMPLES_TOGETHER,
    directions,
    sign_changes,
)
from geomech.mathematics.geometry.gait import Gait, checked_gait
from geomech.mathematics.geometry.periods import Periods
from geomech.mathematics.geometry.representations.field import Field, as_axes
from rft.core.checks import is_whole, real_array
from rft.core.refusal import Refusal

Power = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Metric:
    """A dissipation metric on a grid.

    M: (d, d, N_1, ..., N_d), symmetric. degree: of the interpolating spline. periods:
    of the shape variables, as in `Field`.

    Examples
    --------
    >>> import geomech
    >>> M = geomech.study("three-link-viscous", grid=15).tables.metric
    >>> round(float(M.norm([0.0, 0.0], [1.0, 0.0])), 4)  # per rad of alpha_1, straight
    0.0855
    """

    axes: tuple[np.ndarray, ...]
    M: np.ndarray
    degree: int = 3
    _: KW_ONLY
    periods: Periods = ()

    @cached_property
    def field(self) -> Field:
        """M as a field."""
        return Field(self.axes, self.M, self.degree, periods=self.periods)

    def norm(self, alpha, alphadot) -> np.ndarray:
        """Return F (...,) at alpha, alphadot (..., d); ValueError outside the grid."""
        alphadot = real_array("alphadot", alphadot)
        square = np.einsum(
            "...i,...ij,...j->...", alphadot, self.field(alpha), alphadot
        )
        return np.sqrt(np.maximum(square, 0.0))

    def indicatrix(self, alpha, count: int = 64) -> np.ndarray:
        """Return alphadot (..., count, 2) of unit cost in every direction of the plane
        of two joints: an ellipse."""
        return _indicatrix(self, alpha, count)


@dataclass(frozen=True, eq=False)
class Finsler:
    """A Finsler norm F on a grid, for two joints, by its even harmonics in the
    direction beta of alphadot.

    coefficients: (K + 1, N_1, N_2), the mean, then cosine and sine of 2 beta, 4 beta
    ... K beta. residual: (N_1, N_2), rms over directions of the misfit. periods: of the
    shape variables, as in `Field`.

    Examples
    --------
    >>> import geomech
    >>> F = geomech.study("three-link-glass", grid=15).tables.metric
    >>> round(float(F.norm([0.0, 0.0], [1.0, 0.0])), 3)  # per rad of alpha_1, straight
    0.134
    """

    axes: tuple[np.ndarray, ...]
    coefficients: np.ndarray
    residual: np.ndarray
    degree: int = 3
    _: KW_ONLY
    periods: Periods = ()

    @cached_property
    def field(self) -> Field:
        """The coefficients as a field."""
        return Field(self.axes, self.coefficients, self.degree, periods=self.periods)

    def norm(self, alpha, alphadot) -> np.ndarray:
        """Return F (...,) at alpha, alphadot (..., 2); ValueError outside the grid."""
        alphadot = real_array("alphadot", alphadot)
        beta = np.arctan2(alphadot[..., 1], alphadot[..., 0])
        basis = _even(beta, len(self.coefficients) - 1)
        per_speed = np.maximum((self.field(alpha) * basis).sum(-1), 0.0)
        return per_speed * np.hypot(alphadot[..., 0], alphadot[..., 1])

    def indicatrix(self, alpha, count: int = 64) -> np.ndarray:
        """Return alphadot (..., count, 2) of unit cost in every direction."""
        return _indicatrix(self, alpha, count)


def _indicatrix(metric, alpha, count: int) -> np.ndarray:
    beta = 2 * np.pi * np.arange(count) / count
    unit = np.stack([np.cos(beta), np.sin(beta)], -1)
    alpha = real_array("alpha", alpha)[..., None, :]
    size = metric.norm(np.broadcast_to(alpha, (*alpha.shape[:-2], count, 2)), unit)
    return unit / np.where(size > 0, size, np.nan)[..., None]


def _even(beta, highest: int) -> np.ndarray:
    """Return 1, cos 2 beta, sin 2 beta, ... up to ``highest``: (..., highest + 1)."""
    k = np.arange(2, highest + 1, 2)
    waves = np.exp(1j * k * np.asarray(beta)[..., None])
    pairs = np.stack([waves.real, waves.imag], -1).reshape(*np.shape(beta), -1)
    return np.concatenate([np.ones((*np.shape(beta), 1)), pairs], -1)


def fit(
    power: Power,
    axes,
    degree: int = 3,
    progress: Callable | None = None,
    map: Map = each,
    periods: Periods = (),
    singularity: Callable | None = None,
) -> Metric:
    """Fit M on the grid spanned by ``axes`` exactly, from d (d + 1) / 2 powers at each
    shape.

    power(alpha, alphadot) -> (...,), quadratic in alphadot. periods: of the shape
    variables; the axis of one with a period covers it (`connection.grid`). singularity:
    a function of shapes that passes through 0 where the power does not exist; M is nan
    where A is (`connection.fit`).

    Examples
    --------
    >>> from geomech.mathematics.geometry import metric
    >>> from geomech.mathematics.geometry.connection import grid
    >>> from geomech.scenes import load
    >>> swimmer = load("three-link-viscous").system
    >>> def power(alpha, alphadot):
    ...     return swimmer.power(alpha, alphadot, swimmer.velocity(alpha, alphadot))
    >>> metric.fit(power, grid(2, 9)).M[..., 4, 4].round(5)  # of the straight body
    array([[0.00732, 0.00503],
           [0.00503, 0.00732]])
    """
    axes = as_axes(axes)
    d = len(axes)
    i, j = np.triu_indices(d)
    # One joint at a time, and each two at once.
    unit = np.eye(d)[i] + np.where(i == j, 0.0, 1.0)[:, None] * np.eye(d)[j]
    masked = singularity is not None
    P = _sampled(power, axes, unit, progress, map, masked)  # (C, N...)
    if singularity is not None:
        alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
        P = np.where(sign_changes(singularity(alpha), periods), np.nan, P)
    M = np.empty((d, d, *P.shape[1:]))
    for c in np.flatnonzero(i == j):
        M[i[c], i[c]] = P[c]
    for c in np.flatnonzero(i != j):
        M[i[c], j[c]] = M[j[c], i[c]] = (P[c] - M[i[c], i[c]] - M[j[c], j[c]]) / 2
    return Metric(axes, M, degree, periods=periods)


def fit_norm(
    norm: Power,
    axes,
    count: int = 24,
    degree: int = 3,
    progress: Callable | None = None,
    *,
    highest: int = 14,
    map: Map = each,
    periods: Periods = (),
) -> Finsler:
    """Fit even harmonics up to ``highest`` of a norm(alpha, alphadot) -> (...,), from
    ``count`` directions at each shape of two joints. periods: as in `fit`.

    Examples
    --------
    >>> from geomech.mathematics.geometry import metric
    >>> from geomech.mathematics.geometry.connection import grid
    >>> from geomech.scenes import load
    >>> swimmer = load("three-link-glass").system
    >>> def power(alpha, alphadot):
    ...     return swimmer.power(alpha, alphadot, swimmer.velocity(alpha, alphadot))
    >>> metric.fit_norm(power, grid(2, 5)).coefficients.shape
    (15, 5, 5)
    """
    if not is_whole(highest) or highest % 2 or not 0 <= highest < count:
        raise Refusal(
            f"harmonics must be even and below the number of directions ({count})",
            value=highest,
        )
    axes = as_axes(axes)
    if len(axes) != 2:
        raise Refusal(
            f"harmonics need a plane of two joint rates, got {len(axes)} joints"
        )
    unit = directions(2, count)
    F = _sampled(norm, axes, unit, progress, map)
    return norm_from_samples(F, axes, unit, degree, highest=highest, periods=periods)


def norm_from_samples(
    F: np.ndarray,
    axes,
    unit: np.ndarray,
    degree: int = 3,
    *,
    highest: int = 14,
    periods: Periods = (),
) -> Finsler:
    """Return the series of `fit_norm` from norms F (C, N_1, N_2) of the rates ``unit``
    (C, 2).

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.connection import directions, grid
    >>> from geomech.mathematics.geometry.metric import norm_from_samples
    >>> unit, axes = directions(2, 24), grid(2, 5)
    >>> F = norm_from_samples(np.ones((24, 5, 5)), axes, unit)  # F = |alphadot|
    >>> round(float(F.norm([0.1, 0.2], [3.0, 4.0])), 6)
    5.0
    """
    basis = _even(np.arctan2(unit[:, 1], unit[:, 0]), highest)
    onto = np.linalg.pinv(basis)
    coefficients = np.tensordot(onto, F, 1)
    residual = np.sqrt(((F - np.tensordot(basis, coefficients, 1)) ** 2).mean(0))
    return Finsler(axes, coefficients, residual, degree, periods=periods)


def _sampled(
    power: Power,
    axes,
    unit: np.ndarray,
    progress: Callable | None,
    map: Map,
    masked: bool = False,
) -> np.ndarray:
    """Return (C, N_1, ..., N_d): powers at every shape for the rates ``unit`` (C, d).
    masked: they may be nan."""
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 1, len(axes))
    n = len(alpha)
    step = max(1, SAMPLES_TOGETHER // len(unit))
    parts = [slice(k, min(k + step, n)) for k in range(0, n, step)]
    results = map(
        partial(_powers, (power, unit, masked)), [alpha[part] for part in parts]
    )
    P = np.empty((len(unit), n))
    for part, powers in zip(parts, results):
        P[:, part] = powers.T
        if progress:
            progress(part.stop / n)
    return P.reshape(len(unit), *[len(axis) for axis in axes])


def _powers(shared: tuple, alpha: np.ndarray) -> np.ndarray:
    """Return the powers (s, C) at some shapes. shared: (power, unit, whether powers may
    be nan)."""
    power, unit, masked = shared
    powers = np.asarray(power(alpha, unit))
    is_finite = masked or np.isfinite(powers).all()
    if powers.shape != (len(alpha), len(unit)) or not is_finite:
        raise Refusal(
            f"power must be finite, of shape {(len(alpha), len(unit))} for these rates",
            value=powers.shape,
        )
    return powers


def path_length(
    norm: Power, gait: Gait, amplitudes=None, phases: int = 256
) -> np.ndarray:
    """Return the length of a gait's cycle, for amplitudes (...,) or the gait's own.

    norm: F(alpha, alphadot) -> (...,).

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.mathematics.geometry.metric import path_length
    >>> norm = lambda alpha, alphadot: np.linalg.norm(alphadot, axis=-1)
    >>> round(float(path_length(norm, Circle(0.5))), 4)  # of the circle itself, rad
    3.1416
    """
    alpha, alphadot = checked_gait(gait).cycle(phases, amplitudes)
    return np.asarray(norm(alpha, alphadot)).mean(-1) * 2 * np.pi
