"""Beyond the connection: the odd harmonics of xi in the direction of alphadot, of which A is the first.

In a rate-independent medium xi(alpha, alphadot) = |alphadot| f(alpha, beta), beta the direction of alphadot in the
plane of two joint rates, f odd under beta -> beta + pi. Its Fourier series has odd harmonics only,

    f = sum over k = 1, 3, 5 ... of a_k cos(k beta) + b_k sin(k beta),

and (a_1, b_1) is the uniform least-squares connection. Kept on a grid up to some k they give the velocity at the cost
of a look-up. Links that stick put kinks in f, so the coefficients fall off like 1/k^2 there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech import summary
from geomech.connection import Velocity, check_knobs, directions, sampled
from geomech.errors import is_whole, number, real_array, short
from geomech.field import Field, as_axes, half_of

VALUES_TOGETHER = 1 << 21  # coefficients of one component looked up in one call


@dataclass(frozen=True)
class Harmonics:
    """Coefficients on a grid. coefficients: (3, 2 K, N_1, N_2), a_1, b_1, a_3, b_3 ... of each component of xi, in the
    velocity's units and frame. residual: (3, N_1, N_2), rms over the sampled directions of what the series leaves."""

    axes: tuple[np.ndarray, ...]
    coefficients: np.ndarray
    residual: np.ndarray
    degree: int = 3

    def __repr__(self) -> str:
        speed = np.sqrt((self.coefficients**2).sum(1) / 2)
        return f"Harmonics({summary.grid(self.axes)}; odd, up to {self.highest}; {summary.left(self.residual, speed)})"

    @cached_property
    def field(self) -> Field:
        return Field(self.axes, self.coefficients, self.degree)

    @property
    def highest(self) -> int:
        return self.coefficients.shape[1] - 1

    def half(self, first: int) -> Harmonics:
        """As `Connection.half`."""
        axes, arrays, degree = half_of(self.axes, (self.coefficients, self.residual), self.degree, first)
        return Harmonics(axes, *arrays, degree)

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """xi (..., 3) at alpha, alphadot (..., 2); ValueError outside the grid."""
        alpha, alphadot = np.broadcast_arrays(self.field.inside(alpha), real_array("alphadot", alphadot))
        points = [x.reshape(-1, 2) for x in (alpha, alphadot)]
        step = max(1, VALUES_TOGETHER // self.coefficients.shape[1])
        parts = [self._at(*(x[k : k + step] for x in points)) for k in range(0, len(points[0]), step)]
        return np.concatenate(parts or [np.zeros((0, 3))]).reshape(*alpha.shape[:-1], 3)

    def _at(self, alpha, alphadot) -> np.ndarray:
        beta = np.arctan2(alphadot[..., 1], alphadot[..., 0])
        speed = np.hypot(alphadot[..., 0], alphadot[..., 1])
        return np.einsum("...ij,...j->...i", self.field(alpha), _basis(beta, self.highest)) * speed[..., None]


def _basis(beta: np.ndarray, highest: int) -> np.ndarray:
    """cos beta, sin beta, cos 3 beta, sin 3 beta ... up to ``highest``: (..., highest + 1)."""
    k = np.arange(1, highest + 1, 2)
    waves = np.exp(1j * k * np.asarray(beta)[..., None])
    return np.stack([waves.real, waves.imag], -1).reshape(*np.shape(beta), -1)


def fit(
    velocity: Velocity,
    axes,
    count: int = 24,
    degree: int = 3,
    progress: Callable | None = None,
    mirror: bool = False,
    *,
    highest: int = 9,
) -> Harmonics:
    """Odd harmonics up to ``highest`` from ``count`` uniform directions at each shape; other arguments, and their order,
    as in `connection.fit`.

    The series through ``count`` directions is exact up to the harmonic ``count`` - 1, and those above fold back onto
    it (k onto 2 count - k); so keep ``highest`` well below. ValueError if it is even or not below ``count``.
    """
    number("directions", count, 2, 1e6, whole=True)
    if not is_whole(highest) or highest % 2 == 0 or not 1 <= highest < count:
        raise ValueError(f"harmonics must be odd and below the number of directions ({count}), got {short(highest)}")
    axes = as_axes(axes)
    check_knobs(degree, progress)
    if len(axes) != 2:
        raise ValueError(f"harmonics are those of a plane of two joint rates, got {len(axes)} joints")
    unit = directions(2, count)
    basis = _basis(np.arctan2(unit[:, 1], unit[:, 0]), highest)

    def keep(xi):
        coefficients = np.einsum("cj,sci->ijs", basis * (2.0 / count), xi)
        return coefficients, np.sqrt(((xi - np.einsum("cj,ijs->sci", basis, coefficients)) ** 2).mean(1)).T

    return Harmonics(axes, *sampled(velocity, axes, unit, keep, degree, progress, mirror), degree)
