"""A connection that is known near one gait: its first-order Taylor series in the shape's deviation from it.

With theta(phi) the gait, phi the phase of its point nearest to a shape and delta = alpha - theta(phi), which is normal to it,
A(alpha) = A(phi) + sum_k dA/dn_k(phi) (n_k . delta), n_k orthonormal along the gait (Bittner, Hatton and Revzen, Nonlinear
Dynamics 94, 1933 (2018), here with the phase of the nearest point). All are Fourier series in phi.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from geomech.geometry.connection import Connection
from geomech.geometry.field import inside
from geomech.geometry.reconstruct import displacement
from rft import se2
from rft.checks import real_array, unmasked
from rft.refusal import Refusal

BEYOND = "nan, where the data of the log do not reach"
PLACES = (
    512  # of the gait, at which the nearest one is looked for, and normals are kept
)
NEWTON = 6  # steps to the nearest point from there
SHAPES_TOGETHER = 256  # whose distances from all places, 1 MB, are held at a time: a fourth of the time that 4096 take


def waves(t, harmonics: int, order: int = 0) -> np.ndarray:
    """Return (..., 2 harmonics + 1): 1, cos t, sin t, cos 2t, sin 2t ... or their derivatives of that order."""
    turn = np.exp(1j * unmasked("t", t))[..., None]
    turns = np.cumprod(np.broadcast_to(turn, (*np.shape(t), harmonics)), -1)
    turns *= (1j * np.arange(1.0, harmonics + 1)) ** order
    found = np.empty((*np.shape(t), 2 * harmonics + 1))
    found[..., 0], found[..., 1::2], found[..., 2::2] = (
        float(order == 0),
        turns.real,
        turns.imag,
    )
    return found


def series(coefficients: np.ndarray, t, order: int = 0) -> np.ndarray:
    """Return (..., *lead): a Fourier series with coefficients (*lead, 2 K + 1) as in `waves`, or a derivative, at
    phases t (...)."""
    return np.tensordot(
        waves(t, coefficients.shape[-1] // 2, order), coefficients, (-1, -1)
    )


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed curve of shapes. coefficients: (d, 2 K + 1), rad, d >= 2."""

    coefficients: np.ndarray

    @property
    def harmonics(self) -> int:
        return self.coefficients.shape[1] // 2

    def shape(self, t, order: int = 0) -> np.ndarray:
        """Return (..., d) at phases t (...), or its derivative."""
        return series(self.coefficients, t, order)

    @cached_property
    def _twice_differentiated(self) -> np.ndarray:
        """Coefficients (3, d, 2 K + 1) of the shape and its first two derivatives."""
        found = [self.coefficients]
        for _ in range(2):
            cos, sin = found[-1][:, 1::2], found[-1][:, 2::2]
            k = np.arange(1, self.harmonics + 1)
            rate = np.zeros_like(self.coefficients, float)
            rate[:, 1::2], rate[:, 2::2] = k * sin, -k * cos
            found.append(rate)
        return np.array(found)

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Phases (P,) and shapes (P, d) at which the nearest point is first looked for."""
        t = 2 * np.pi * np.arange(PLACES) / PLACES
        return t, self.shape(t)

    @cached_property
    def _normals(self) -> np.ndarray:
        """Normals (P + 1, d, d - 1) of more than two joints, at the places and at the first once more. They rotate about
        the curve as little as they can and close after a cycle: parallel transport, whose holonomy is spread over all of
        it."""
        from scipy.linalg import expm, logm

        rate = self.shape(self._places[0], 1)
        tangent = rate / np.linalg.norm(rate, axis=1, keepdims=True)
        frames_along = [_complement(tangent[0])]
        for t in [*tangent[1:], tangent[0]]:
            u, _, v = np.linalg.svd(
                frames_along[-1] - np.outer(t, t @ frames_along[-1]),
                full_matrices=False,
            )
            frames_along.append(u @ v)
        holonomy = np.real(logm(frames_along[0].T @ frames_along[-1]))
        return np.array(
            [n @ expm(-k / PLACES * holonomy) for k, n in enumerate(frames_along)]
        )

    def normals(self, t) -> np.ndarray:
        """Return (..., d, d - 1): orthonormal, and normal to the curve, at phases t (...)."""
        rate = self.shape(t, 1)
        if rate.shape[-1] == 2:
            tangent = rate / np.linalg.norm(rate, axis=-1, keepdims=True)
            return np.stack([-tangent[..., 1], tangent[..., 0]], -1)[..., None]
        place = unmasked("t", t) % (2 * np.pi) * PLACES / (2 * np.pi)
        k = np.minimum(place.astype(int), PLACES - 1)
        part = (place - k)[..., None, None]
        return (1 - part) * self._normals[k] + part * self._normals[k + 1]

    def nearest(self, alpha) -> np.ndarray:
        """Return phases (...,) of the points of the curve nearest to shapes alpha (..., d)."""
        flat = np.reshape(alpha, (-1, np.shape(alpha)[-1]))
        t, places = self._places
        rows = [
            flat[k : k + SHAPES_TOGETHER] for k in range(0, len(flat), SHAPES_TOGETHER)
        ]
        half_square = (places**2).sum(
            1
        ) / 2  # of the distance, less that of the shape and its product with the place
        nearest_places = [
            t[(half_square - shapes @ places.T).argmin(1)] for shapes in rows
        ]
        start = np.concatenate(nearest_places) if rows else np.zeros(0)
        return self.projected(
            alpha, start.reshape(np.shape(alpha)[:-1]), np.pi / PLACES
        )

    def projected(self, alpha, t, step: float = 0.1) -> np.ndarray:
        """Return phases (...,) near t at which alpha - theta is normal to the curve: Newton, at most ``step`` rad at a
        time."""
        for _ in range(NEWTON):
            shape, rate, bend = np.moveaxis(
                series(self._twice_differentiated, t), -2, 0
            )
            deviation = alpha - shape
            square = (rate**2).sum(-1)
            slope = np.maximum(
                square - (deviation * bend).sum(-1), 0.2 * square
            )  # beyond the centre of curvature Gauss-Newton
            t = t + np.clip((deviation * rate).sum(-1) / slope, -step, step)
        return t


def _between(values: np.ndarray, t) -> np.ndarray:
    """Return (..., *lead): values (*lead, P) at equally spaced phases, at phases t (...) between them."""
    count = values.shape[-1]
    places = 2 * np.pi * np.arange(count + 1) / count
    closed = np.concatenate([values, values[..., :1]], -1).reshape(-1, count + 1)
    values_at = np.stack(
        [np.interp(np.asarray(t) % (2 * np.pi), places, row) for row in closed], -1
    )
    return values_at.reshape(*np.shape(t), *values.shape[:-1])


def _complement(unit: np.ndarray) -> np.ndarray:
    """Return (d, d - 1): orthonormal and normal to a unit vector, by a reflection that takes the first axis there."""
    first = np.zeros_like(unit)
    first[0] = -1.0 if unit[0] > 0 else 1.0
    v = unit - first
    return (np.eye(len(unit)) - 2 * np.outer(v, v) / (v @ v))[:, 1:]


@dataclass(frozen=True, eq=False)
class TaylorSeries:
    """The Taylor series of a connection about a gait, coefficients of Fourier series in its phase.

    A: (3, d, 2 K + 1). slope: (3, d, d - 1, 2 K + 1), dA/dn_k. errors: (E, 3, d, d, 2 K + 1), of A and then of its slopes,
    independent: the squares of what each does to a result add up to its variance. spread: (d, d, P), at equally spaced
    phases: the data reach a shape where delta . spread^-1 delta <= 1. beyond: (3,), of a net pose: what the variation of the
    cycles changes in it beyond the first order; where links begin and cease to stick, a Taylor series may be off by as much.
    standard_error: (3, 2, P), at equally spaced phases, of A along the gait and across it: for the residual of xi and for the
    harmonics that the series omit.
    factor: an error is this many standard deviations. level: share of cases in which it is meant to cover the truth."""

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
        """Return the phases (...,) of the nearest points and the deviations (..., d) of shapes (..., d)."""
        t = self.loop.nearest(alpha)
        return t, alpha - self.loop.shape(t)

    def spread_at(self, t) -> np.ndarray:
        """Return the spread (..., d, d) at phases t (...)."""
        return _between(self.spread, t)

    def standard_error_at(self, t) -> np.ndarray:
        """Return the standard errors (..., 3, d) of A at phases t (...), as `standard_error`."""
        rate = self.loop.shape(t, 1)
        along = rate**2 / (rate**2).sum(-1, keepdims=True)
        return np.sqrt(
            _between(self.standard_error**2, t) @ np.stack([along, 1 - along], -2)
        )

    def reach(self, alpha) -> np.ndarray:
        """Return the distances (...,) of shapes (..., d) from the gait, 1 where the data end."""
        t, delta = self._deviation(real_array("alpha", alpha))
        return np.sqrt(
            np.einsum(
                "...i,...ij,...j->...", delta, np.linalg.inv(self.spread_at(t)), delta
            )
        )

    def terms(self, t, alpha, alphadot) -> tuple[np.ndarray, np.ndarray]:
        """Return (waves (..., 2 K + 1), terms (..., d, d)), such that xi_i = sum of combined_i,j,m,k terms_j,m waves_k,
        at shapes and rates (..., d) whose nearest points of the gait have phases t (...)."""
        normal = np.einsum(
            "...ik,...i->...k", self.loop.normals(t), alpha - self.loop.shape(t)
        )
        one = np.concatenate([np.ones((*normal.shape[:-1], 1)), normal], -1)
        return waves(t, self.A.shape[-1] // 2), alphadot[..., :, None] * one[
            ..., None, :
        ]

    @cached_property
    def combined(self) -> np.ndarray:
        """Coefficients (3, d, d, 2 K + 1) of A and then of its slopes."""
        return np.concatenate([self.A[:, :, None], self.slope], 2)

    def connection(self, alpha) -> np.ndarray:
        """Return A (..., 3, d) at shapes (..., d), wherever these are."""
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
        squares = (
            np.einsum("ijmk,...k,...jm->...ij", x, w, terms) ** 2 for x in self.errors
        )
        return self.factor * np.sqrt(sum(squares) + self.standard_error_at(t) ** 2)

    def along(self, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return A (T, 3, d) at phases t of the gait, and half widths of its interval."""
        errors = series(self.errors[:, :, :, 0], t)
        variance = (errors**2).sum(-3) + self.standard_error_at(t) ** 2
        return series(self.A, t), self.factor * np.sqrt(variance)

    def ccf(self, alpha) -> np.ndarray:
        """Return the CCF (..., 3) of two joints at shapes (..., 2)."""
        return self._ccf_at(alpha)(self.combined)

    def ccf_error(self, alpha) -> np.ndarray:
        """Return the errors (..., 3) of `ccf`."""
        of = self._ccf_at(alpha)
        value = of(self.combined)
        return self.factor * np.sqrt(
            sum((of(self.combined + x) - value) ** 2 for x in self.errors)
        )

    def _ccf_at(self, alpha) -> Callable:
        """Return a function that gives the CCF (..., 3) at shapes (..., 2) of any connection along the gait, from its
        coefficients as `combined`.

        alpha = theta(phi) + s n(phi) has d alpha / d phi = theta' (1 - curvature s), and dA/ds is the slope."""
        t, delta = self._deviation(alpha)
        rate, bend, n = (
            self.loop.shape(t, 1),
            self.loop.shape(t, 2),
            self.loop.normals(t)[..., 0],
        )
        speed, s = np.linalg.norm(rate, axis=-1), (n * delta).sum(-1)
        ahead = speed - s * (bend * n).sum(-1) / speed  # |d alpha / d phi|
        waves_at, rates_at = (
            waves(t, self.A.shape[-1] // 2, order) for order in (0, 1)
        )

        def ccf(combined: np.ndarray) -> np.ndarray:
            (A, slope), (A_on, slope_on) = (
                [np.tensordot(w, combined[:, :, m], (-1, -1)) for m in (0, 1)]
                for w in (waves_at, rates_at)
            )
            along = (A_on + slope_on * s[..., None, None]) / ahead[..., None, None]
            derivative = np.einsum("...ij,...j->...i", along, n) - np.einsum(
                "...ij,...j->...i", slope, rate / speed[..., None]
            )
            A_here = A + slope * s[..., None, None]
            return derivative + se2.bracket(A_here[..., 0], A_here[..., 1])

        return ccf

    def error(self, alpha, alphadot) -> np.ndarray:
        """Return the errors (..., 3) of the net pose of gaits alpha, alphadot (..., N, d)."""
        w, terms = self.terms(self.loop.nearest(alpha), alpha, alphadot)
        velocity = lambda x: np.einsum("ijmk,...nk,...njm->...ni", x, w, terms)
        net = displacement(velocity(self.combined))
        differences = [
            displacement(velocity(self.combined + x)) - net for x in self.errors
        ]
        return np.hypot(
            self.factor * np.sqrt(np.sum(np.square(differences), 0)), self.beyond
        )


@dataclass(frozen=True, eq=False, repr=False)
class Tube(Connection):
    """A connection that is evaluated near a gait; its grid, nan where the data do not reach, is for pictures and
    files."""

    taylor: TaylorSeries | None = None

    def reach(self, alpha: ArrayLike) -> np.ndarray:
        """Return the distances (...,) of shapes from the gait, as `TaylorSeries.reach`."""
        return self.taylor.reach(alpha)

    def checked(self, alpha: ArrayLike) -> np.ndarray:
        """Return alpha; Refusal names the first shape that the data do not reach."""
        alpha = inside(self.axes, alpha)
        reach = self.reach(alpha)
        if (reach > 1 + 1e-9).any():
            shape = ", ".join(f"{x:.3g}" for x in alpha[reach > 1 + 1e-9][0])
            raise Refusal(
                f"the data do not reach alpha = ({shape}), {reach.max():.2g} times as far from the mean gait as they go",
                instead="keep near that gait, or measure more varied cycles",
            )
        return alpha

    def at_grid(self, function: Callable) -> np.ndarray:
        """Return (..., N_1, ..., N_d): a function of shapes (n, d), which gives (n, ...), on the grid; nan where A
        is."""
        shapes = np.stack(np.meshgrid(*self.axes, indexing="ij"), -1)
        reached, d = ~np.isnan(self.A[0, 0]), len(self.axes)
        values = function(shapes[reached])
        fields = np.full((*reached.shape, *values.shape[1:]), np.nan)
        fields[reached] = values
        return np.moveaxis(fields, range(d), range(-d, 0))

    def __call__(self, alpha) -> np.ndarray:
        """Return A (..., 3, d) at shapes alpha (..., d); ValueError where the data do not reach."""
        return self.taylor.connection(self.checked(alpha))


def covering_grid(taylor: TaylorSeries, points: int) -> tuple[np.ndarray, ...]:
    """Return axes of ``points`` points each that span all that the data reach."""
    t = 2 * np.pi * np.arange(PLACES) / PLACES
    step = (
        np.abs(taylor.loop.shape(t, 2)).max(0) * (np.pi / PLACES) ** 2 / 2
    )  # what a curve may do between two places
    wide = np.sqrt(np.einsum("tii->ti", taylor.spread_at(t))) + step
    low, high = (
        (taylor.loop.shape(t) - wide).min(0),
        (taylor.loop.shape(t) + wide).max(0),
    )
    return tuple(np.linspace(a, b, points) for a, b in zip(low, high))


def tube(
    taylor: TaylorSeries,
    axes: Sequence[np.ndarray],
    residual: np.ndarray,
    unit: str,
    length: float,
) -> Tube:
    """Return the connection on a grid, nan where the data do not reach. residual: (3,), of the fit of xi for |alphadot|
    = 1. unit, length: as of `Connection`."""
    axes = tuple(axes)
    shapes = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    A = np.moveaxis(taylor.connection_within_reach(shapes), (-2, -1), (0, 1))
    masked = np.isnan(A[:, 0])
    masked_residual = np.where(masked, np.nan, residual.reshape(3, *[1] * len(axes)))
    speed, degree = (
        np.sqrt((A**2).mean(1) + masked_residual**2),
        min(3, min(map(len, axes)) - 1),
    )
    return Tube(
        axes, A, masked_residual, speed, degree, taylor, unit=unit, length=length
    )
