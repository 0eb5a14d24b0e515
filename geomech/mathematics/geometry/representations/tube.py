"""A connection that is known near one gait, by its first-order Taylor series.

With theta(phi) the gait, phi the phase of its point nearest to a shape and
delta = alpha - theta(phi), which is normal to it,

    A(alpha) = A(phi) + sum_k dA/dn_k(phi) (n_k . delta),

n_k orthonormal along the gait (Bittner, Hatton and Revzen, Nonlinear Dynamics 94, 1933
(2018), here with the phase of the nearest point). All are Fourier series in phi.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.geometry.representations.field import inside
from rft.core.checks import real_array, unmasked
from rft.core.refusal import Refusal
from rft.formulas import se2

BEYOND = "nan, where the data of the log do not reach"
# Places on the gait: the search for the nearest point begins at one, and normals are
# stored there.
PLACES = 512
NEWTON_STEPS = 6  # to the nearest point from there
# Shapes whose distances from all places, 1 MB, are held at a time: this takes a fourth
# of the time of 4096 shapes.
SHAPES_TOGETHER = 256


def waves(t, harmonics: int, order: int = 0) -> np.ndarray:
    """Return (..., 2 harmonics + 1): 1, cos t, sin t, cos 2t, sin 2t ... or their
    derivatives of an order, at phases t (...)."""
    turn = np.exp(1j * unmasked("t", t))[..., None]
    turns = np.cumprod(np.broadcast_to(turn, (*np.shape(t), harmonics)), -1)
    turns *= (1j * np.arange(1.0, harmonics + 1)) ** order
    values = np.empty((*np.shape(t), 2 * harmonics + 1))
    values[..., 0] = 1.0 if order == 0 else 0.0
    values[..., 1::2] = turns.real
    values[..., 2::2] = turns.imag
    return values


def series(coefficients: np.ndarray, t, order: int = 0) -> np.ndarray:
    """Return (..., *lead): a Fourier series with coefficients (*lead, 2 K + 1) as in
    `waves`, or a derivative of an order, at phases t (...)."""
    harmonics = coefficients.shape[-1] // 2
    return np.tensordot(waves(t, harmonics, order), coefficients, (-1, -1))


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed curve of shapes. coefficients: (d, 2 K + 1), rad, d >= 2."""

    coefficients: np.ndarray

    @property
    def harmonics(self) -> int:
        """Highest harmonic K."""
        return self.coefficients.shape[1] // 2

    def shape(self, t, order: int = 0) -> np.ndarray:
        """Return shapes (..., d) at phases t (...), or their derivatives of an
        order."""
        return series(self.coefficients, t, order)

    @cached_property
    def _twice_differentiated(self) -> np.ndarray:
        """Coefficients (3, d, 2 K + 1) of the shape and its first two derivatives."""
        k = np.arange(1, self.harmonics + 1)
        orders = [self.coefficients]
        for _ in range(2):
            cos = orders[-1][:, 1::2]
            sin = orders[-1][:, 2::2]
            rate = np.zeros_like(self.coefficients, float)
            rate[:, 1::2] = k * sin
            rate[:, 2::2] = -k * cos
            orders.append(rate)
        return np.array(orders)

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Phases (P,) and shapes (P, d) at which the search for the nearest point
        begins."""
        t = 2 * np.pi * np.arange(PLACES) / PLACES
        return t, self.shape(t)

    @cached_property
    def _normals(self) -> np.ndarray:
        """Normals (P + 1, d, d - 1) for more than two joints, at the places and at the
        first once more.

        They rotate about the curve as little as they can and close after a cycle:
        parallel transport, whose holonomy is spread over the cycle."""
        from scipy.linalg import expm, logm

        rate = self.shape(self._places[0], 1)
        tangent = rate / np.linalg.norm(rate, axis=1, keepdims=True)
        normals = [_complement(tangent[0])]
        for t in [*tangent[1:], tangent[0]]:
            projected = normals[-1] - np.outer(t, t @ normals[-1])
            u, _, v = np.linalg.svd(projected, full_matrices=False)
            normals.append(u @ v)
        holonomy = np.real(logm(normals[0].T @ normals[-1]))
        rotations = [expm(-k / PLACES * holonomy) for k in range(len(normals))]
        return np.array([n @ rotation for n, rotation in zip(normals, rotations)])

    def normals(self, t) -> np.ndarray:
        """Return orthonormal normals (..., d, d - 1) of the curve at phases t (...)."""
        rate = self.shape(t, 1)
        if rate.shape[-1] == 2:
            tangent = rate / np.linalg.norm(rate, axis=-1, keepdims=True)
            return np.stack([-tangent[..., 1], tangent[..., 0]], -1)[..., None]
        place = unmasked("t", t) % (2 * np.pi) * PLACES / (2 * np.pi)
        k = np.minimum(place.astype(int), PLACES - 1)
        share = (place - k)[..., None, None]
        return (1 - share) * self._normals[k] + share * self._normals[k + 1]

    def nearest(self, alpha) -> np.ndarray:
        """Return phases (...,) of the points of the curve nearest to shapes alpha (...,
        d)."""
        flat = np.reshape(alpha, (-1, np.shape(alpha)[-1]))
        phases, places = self._places
        half_square = (places**2).sum(1) / 2
        start = np.zeros(len(flat))
        for k in range(0, len(flat), SHAPES_TOGETHER):
            shapes = flat[k : k + SHAPES_TOGETHER]
            # Half of the squared distance, less half of the shape's own square.
            distance = half_square - shapes @ places.T
            start[k : k + SHAPES_TOGETHER] = phases[distance.argmin(1)]
        start = start.reshape(np.shape(alpha)[:-1])
        return self.projected(alpha, start, np.pi / PLACES)

    def projected(self, alpha, t, step: float = 0.1) -> np.ndarray:
        """Return phases (...,) near t at which alpha - theta is normal to the curve, by
        Newton's method with steps of at most ``step`` rad."""
        for _ in range(NEWTON_STEPS):
            orders = series(self._twice_differentiated, t)
            shape, rate, bend = np.moveaxis(orders, -2, 0)
            deviation = alpha - shape
            square = (rate**2).sum(-1)
            # Beyond the centre of curvature the slope is Gauss-Newton's.
            slope = np.maximum(square - (deviation * bend).sum(-1), 0.2 * square)
            t = t + np.clip((deviation * rate).sum(-1) / slope, -step, step)
        return t


def _between(values: np.ndarray, t) -> np.ndarray:
    """Return (..., *lead): values (*lead, P) at equally spaced phases, interpolated at
    phases t (...)."""
    count = values.shape[-1]
    places = 2 * np.pi * np.arange(count + 1) / count
    closed = np.concatenate([values, values[..., :1]], -1).reshape(-1, count + 1)
    t = np.asarray(t) % (2 * np.pi)
    interpolated = np.stack([np.interp(t, places, row) for row in closed], -1)
    return interpolated.reshape(*np.shape(t), *values.shape[:-1])


def _complement(unit: np.ndarray) -> np.ndarray:
    """Return (d, d - 1): orthonormal vectors normal to a unit vector, by a reflection
    that takes the first axis there."""
    first = np.zeros_like(unit)
    first[0] = -1.0 if unit[0] > 0 else 1.0
    v = unit - first
    return (np.eye(len(unit)) - 2 * np.outer(v, v) / (v @ v))[:, 1:]


@dataclass(frozen=True, eq=False)
class TaylorSeries:
    """The Taylor series of a connection about a gait, coefficients of Fourier series in
    its phase.

    A: (3, d, 2 K + 1). slope: (3, d, d - 1, 2 K + 1), dA/dn_k. errors: (E, 3, d, d, 2 K
    + 1), of A and then of its slopes, independent: the squares of their effects on a
    result add up to its variance. spread: (d, d, P), at equally spaced phases: the data
    reach a shape where delta . spread^-1 delta <= 1. beyond: (3,), of a net pose: its
    change beyond the first order with the variation of the cycles. Where links begin
    and cease to stick, a Taylor series may have an error of that size. standard_error:
    (3, 2, P), at equally spaced phases, of A along the gait and across it, for the
    residual of xi and for the harmonics that the series omit. factor: an error is this
    many standard deviations. level: share of cases in which it should cover the
    truth."""

    loop: Loop
    A: np.ndarray
    slope: np.ndarray
    errors: np.ndarray
    spread: np.ndarray
    beyond: np.ndarray
    standard_error: np.ndarray
    factor: float
    level: float

    def _deviation(self, alpha) -> tuple[np.ndarray, np.ndarray]:
        """Return the phases (...,) of the nearest points and the deviations (..., d)
        from them, for shapes (..., d)."""
        t = self.loop.nearest(alpha)
        return t, alpha - self.loop.shape(t)

    def spread_at(self, t) -> np.ndarray:
        """Return the spread (..., d, d) at phases t (...)."""
        return _between(self.spread, t)

    def standard_error_at(self, t) -> np.ndarray:
        """Return the standard errors (..., 3, d) of A at phases t (...)."""
        rate = self.loop.shape(t, 1)
        along = rate**2 / (rate**2).sum(-1, keepdims=True)
        variance = _between(self.standard_error**2, t)
        return np.sqrt(variance @ np.stack([along, 1 - along], -2))

    def reach(self, alpha) -> np.ndarray:
        """Return the distances (...,) of shapes (..., d) from the gait, 1 where the
        data end."""
        t, delta = self._deviation(real_array("alpha", alpha))
        inverse = np.linalg.inv(self.spread_at(t))
        return np.sqrt(np.einsum("...i,...ij,...j->...", delta, inverse, delta))

    def terms(self, t, alpha, alphadot) -> tuple[np.ndarray, np.ndarray]:
        """Return waves (..., 2 K + 1) and terms (..., d, d), such that
        xi_i = sum of combined_i,j,m,k terms_j,m waves_k.

        alpha, alphadot: shapes and rates (..., d) whose nearest points of the gait have
        phases t (...)."""
        deviation = alpha - self.loop.shape(t)
        normal = np.einsum("...ik,...i->...k", self.loop.normals(t), deviation)
        factors = np.concatenate([np.ones((*normal.shape[:-1], 1)), normal], -1)
        terms = alphadot[..., :, None] * factors[..., None, :]
        return waves(t, self.A.shape[-1] // 2), terms

    @cached_property
    def combined(self) -> np.ndarray:
        """Coefficients (3, d, d, 2 K + 1) of A and then of its slopes."""
        return np.concatenate([self.A[:, :, None], self.slope], 2)

    def connection(self, alpha) -> np.ndarray:
        """Return A (..., 3, d) at shapes (..., d), whether the data reach them or
        not."""
        w, terms = self.terms(self.loop.nearest(alpha), alpha, np.ones(np.shape(alpha)))
        return np.einsum("ijmk,...k,...jm->...ij", self.combined, w, terms)

    def connection_within_reach(self, alpha) -> np.ndarray:
        """Return A (..., 3, d) at shapes (..., d); nan where the data do not reach."""
        within = self.reach(alpha) <= 1
        A = np.full((*within.shape, *self.A.shape[:2]), np.nan)
        A[within] = self.connection(alpha[within])
        return A

    def connection_error(self, alpha) -> np.ndarray:
        """Return the errors (..., 3, d) of `connection`."""
        t = self.loop.nearest(alpha)
        w, terms = self.terms(t, alpha, np.ones(np.shape(alpha)))
        variance = 0
        for error in self.errors:
            change = np.einsum("ijmk,...k,...jm->...ij", error, w, terms)
            variance = variance + change**2
        return self.factor * np.sqrt(variance + self.standard_error_at(t) ** 2)

    def along(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return A (T, 3, d) at phases t of the gait, and half widths of its
        interval."""
        errors = series(self.errors[:, :, :, 0], t)
        variance = (errors**2).sum(-3) + self.standard_error_at(t) ** 2
        return series(self.A, t), self.factor * np.sqrt(variance)

    def ccf(self, alpha) -> np.ndarray:
        """Return the CCF (..., 3) of two joints at shapes (..., 2)."""
        return self._ccf_at(alpha)(self.combined)

    def ccf_error(self, alpha) -> np.ndarray:
        """Return the errors (..., 3) of `ccf`."""
        ccf = self._ccf_at(alpha)
        value = ccf(self.combined)
        variance = sum((ccf(self.combined + x) - value) ** 2 for x in self.errors)
        return self.factor * np.sqrt(variance)

    def _ccf_at(self, alpha) -> Callable:
        """Return a function of coefficients as `combined`: the CCF (..., 3) at shapes
        (..., 2) of the connection with these coefficients.

        alpha = theta(phi) + s n(phi) has d alpha / d phi = theta' (1 - curvature s),
        and dA/ds is the slope."""
        t, delta = self._deviation(alpha)
        rate = self.loop.shape(t, 1)
        bend = self.loop.shape(t, 2)
        n = self.loop.normals(t)[..., 0]
        speed = np.linalg.norm(rate, axis=-1)
        tangent = rate / speed[..., None]
        s = (n * delta).sum(-1)
        alpha_by_phi = speed - s * (bend * n).sum(-1) / speed
        s = s[..., None, None]
        harmonics = self.A.shape[-1] // 2
        w = waves(t, harmonics)
        dw = waves(t, harmonics, 1)

        def ccf(combined: np.ndarray) -> np.ndarray:
            A = np.tensordot(w, combined[:, :, 0], (-1, -1))
            slope = np.tensordot(w, combined[:, :, 1], (-1, -1))
            A_by_phi = np.tensordot(dw, combined[:, :, 0], (-1, -1))
            slope_by_phi = np.tensordot(dw, combined[:, :, 1], (-1, -1))

            along = (A_by_phi + slope_by_phi * s) / alpha_by_phi[..., None, None]
            derivative = np.einsum("...ij,...j->...i", along, n)
            derivative = derivative - np.einsum("...ij,...j->...i", slope, tangent)
            A = A + slope * s
            return derivative + se2.bracket(A[..., 0], A[..., 1])

        return ccf

    def error(self, alpha, alphadot) -> np.ndarray:
        """Return the errors (..., 3) of the net pose of gaits alpha, alphadot (..., N,
        d)."""
        w, terms = self.terms(self.loop.nearest(alpha), alpha, alphadot)

        def net(combined):
            xi = np.einsum("ijmk,...nk,...njm->...ni", combined, w, terms)
            return displacement(xi)

        net_pose = net(self.combined)
        changes = [net(self.combined + x) - net_pose for x in self.errors]
        deviation = np.sqrt(np.sum(np.square(changes), 0))
        return np.hypot(self.factor * deviation, self.beyond)


@dataclass(frozen=True, eq=False, repr=False)
class Tube(Connection):
    """A connection that is evaluated near a gait.

    Its grid, nan where the data do not reach, is for pictures and files."""

    taylor: TaylorSeries | None = None

    def reach(self, alpha: ArrayLike) -> np.ndarray:
        """Return the distances (...,) of shapes (..., d) from the gait
        (`TaylorSeries.reach`)."""
        return self.taylor.reach(alpha)

    def checked(self, alpha: ArrayLike) -> np.ndarray:
        """Return alpha; Refusal names the first shape that the data do not reach."""
        alpha = inside(self.axes, alpha)
        reach = self.reach(alpha)
        beyond = reach > 1 + 1e-9
        if beyond.any():
            shape = ", ".join(f"{x:.3g}" for x in alpha[beyond][0])
            raise Refusal(
                f"the data do not reach alpha = ({shape}), which is {reach.max():.2g} "
                "times as far from the mean gait as they extend",
                instead="stay near that gait, or measure cycles that vary more",
            )
        return alpha

    def on_grid(self, function: Callable) -> np.ndarray:
        """Return (..., N_1, ..., N_d): the values on the grid of a function of shapes
        (n, d), which returns (n, ...); nan where A is nan."""
        d = len(self.axes)
        shapes = np.stack(np.meshgrid(*self.axes, indexing="ij"), -1)
        reached = ~np.isnan(self.A[0, 0])
        values = function(shapes[reached])
        fields = np.full((*reached.shape, *values.shape[1:]), np.nan)
        fields[reached] = values
        return np.moveaxis(fields, range(d), range(-d, 0))

    def __call__(self, alpha) -> np.ndarray:
        """Return A (..., 3, d) at shapes alpha (..., d); ValueError where the data do
        not reach."""
        return self.taylor.connection(self.checked(alpha))


def covering_grid(taylor: TaylorSeries, points: int) -> tuple[np.ndarray, ...]:
    """Return axes of ``points`` points each that span all shapes that the data
    reach."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    shapes = taylor.loop.shape(t)
    # Between two places a curve may leave their chord by its bend.
    bend = np.abs(taylor.loop.shape(t, 2)).max(0)
    step = bend * (np.pi / PLACES) ** 2 / 2
    width = np.sqrt(np.einsum("tii->ti", taylor.spread_at(t))) + step
    low = (shapes - width).min(0)
    high = (shapes + width).max(0)
    return tuple(np.linspace(a, b, points) for a, b in zip(low, high))


def tube(
    taylor: TaylorSeries,
    axes: Sequence[np.ndarray],
    residual: np.ndarray,
    unit: str,
    length: float,
) -> Tube:
    """Return the connection on a grid, nan where the data do not reach.

    residual: (3,), of the fit of xi for |alphadot| = 1. unit, length: as in
    `Connection`."""
    axes = tuple(axes)
    shapes = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    A = np.moveaxis(taylor.connection_within_reach(shapes), (-2, -1), (0, 1))
    masked = np.isnan(A[:, 0])
    masked_residual = np.where(masked, np.nan, residual.reshape(3, *[1] * len(axes)))
    speed = np.sqrt((A**2).mean(1) + masked_residual**2)
    degree = min(3, min(map(len, axes)) - 1)
    return Tube(
        axes, A, masked_residual, speed, degree, taylor, unit=unit, length=length
    )
