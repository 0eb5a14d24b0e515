"""Odd harmonics of xi in the direction of alphadot, of which the connection is the
first.

In a rate-independent medium xi(alpha, alphadot) = |alphadot| f(alpha, beta), beta the
direction of alphadot in the plane of two joint rates, f odd under beta -> beta + pi.
Its Fourier series has odd harmonics only,

    f = sum over k = 1, 3, 5 ... of a_k cos(k beta) + b_k sin(k beta),

and (a_1, b_1) is the uniform least-squares connection. Stored on a grid up to some k
they give the velocity at the cost of an interpolation. Links that stick leave kinks in
f, so the coefficients fall off like 1/k^2 there.

With three and more joints directions are points of a sphere. The odd spherical
harmonics up to degree k on it are the homogeneous polynomials of degree k, of which
there are (k + d - 1 choose d - 1). The basis here is their products of powers, each
times the root of its multinomial coefficient, fitted by least squares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import cached_property, lru_cache
from itertools import combinations
from math import comb, factorial, prod

import numpy as np

from geomech.core import summary
from geomech.core.work import Map, each
from geomech.mathematics.geometry.connection import (
    Velocity,
    check_fit_options,
    directions,
    sampled,
)
from geomech.mathematics.geometry.periods import Periods
from geomech.mathematics.geometry.representations.field import Field, as_axes, half_grid
from geomech.mathematics.geometry.traits import NOTHING, Traits
from rft.core.checks import in_range, is_whole, real_array
from rft.core.refusal import Refusal

VALUES_TOGETHER = 1 << 21  # coefficients of one component interpolated in one call


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Coefficients on a grid.

    coefficients: (3, 2 K, N_1, N_2), a_1, b_1, a_3, b_3 ... of each component of xi, in
    the velocity's units and frame; for more joints (3, terms, N_1, ..., N_d), of
    `powers`. residual: (3, N_1, ..., N_d), rms over directions of the misfit of the
    series. periods: of the shape variables, as in `Field`."""

    axes: tuple[np.ndarray, ...]
    coefficients: np.ndarray
    residual: np.ndarray
    degree: int = 3
    _: KW_ONLY
    periods: Periods = ()

    def __repr__(self) -> str:
        speed = np.sqrt((self.coefficients**2).sum(1) / 2)
        grid = summary.grid(self.axes)
        residual = summary.fit_residual(self.residual, speed)
        return f"Harmonics({grid}; odd, up to {self.highest}; {residual})"

    @cached_property
    def field(self) -> Field:
        """The coefficients as a field."""
        return Field(self.axes, self.coefficients, self.degree, periods=self.periods)

    @property
    def highest(self) -> int:
        """Highest harmonic."""
        count = self.coefficients.shape[1]
        joints = len(self.axes)
        if joints == 2:
            return count - 1
        return next(k for k in range(1, count + 1) if terms(joints, k) == count)

    def half(self, first: int) -> Harmonics:
        """Return the harmonics on half of the grid, as `Connection.half` does."""
        arrays = (self.coefficients, self.residual)
        axes, arrays, degree = half_grid(self.axes, arrays, self.degree, first)
        return Harmonics(axes, *arrays, degree, periods=self.periods)

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """Return xi (..., 3) at alpha, alphadot (..., d); ValueError outside the
        grid."""
        alpha = self.field.inside(alpha)
        alphadot = real_array("alphadot", alphadot)
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        shapes = alpha.reshape(-1, len(self.axes))
        rates = alphadot.reshape(-1, len(self.axes))
        xi = np.empty((len(shapes), 3))
        step = max(1, VALUES_TOGETHER // self.coefficients.shape[1])
        for k in range(0, len(shapes), step):
            part = slice(k, k + step)
            xi[part] = self._velocity(shapes[part], rates[part])
        return xi.reshape(*alpha.shape[:-1], 3)

    def _velocity(self, alpha, alphadot) -> np.ndarray:
        """Return xi (n, 3) at shapes and rates (n, d)."""
        speed = np.linalg.norm(alphadot, axis=-1)
        unit = alphadot / np.where(speed > 0, speed, 1.0)[..., None]
        functions = basis(unit, self.highest)
        xi = np.einsum("...ij,...j->...i", self.field(alpha), functions)
        return xi * speed[..., None]


def terms(joints: int, highest: int) -> int:
    """Return the number of coefficients of the odd harmonics up to ``highest``."""
    return comb(highest + joints - 1, joints - 1)


@lru_cache(maxsize=16)
def powers(joints: int, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the powers (terms, d) of the products, and the roots (terms,) of their
    multinomial coefficients."""
    bars = np.array(list(combinations(range(degree + joints - 1), joints - 1)))
    ends = np.full((len(bars), 1), degree + joints - 1)
    exponents = np.diff(np.concatenate([-np.ones_like(ends), bars, ends], 1)) - 1
    counts = [prod(map(factorial, row)) for row in exponents.tolist()]
    roots = [np.sqrt(factorial(degree) / count) for count in counts]
    return exponents, np.array(roots)


def basis(unit: np.ndarray, highest: int) -> np.ndarray:
    """Return the basis functions (..., terms) at directions (..., d)."""
    if unit.shape[-1] == 2:
        return _basis(np.arctan2(unit[..., 1], unit[..., 0]), highest)
    exponents, roots = powers(unit.shape[-1], highest)
    ones = np.ones((1, *unit.shape))
    repeated = np.repeat(unit[None], highest, 0)
    powers_of_unit = np.cumprod(np.concatenate([ones, repeated]), 0)
    products = roots
    for k in range(unit.shape[-1]):
        powers_of_k = powers_of_unit[exponents[:, k], ..., k]
        products = products * np.moveaxis(powers_of_k, 0, -1)
    return products


def _basis(beta: np.ndarray, highest: int) -> np.ndarray:
    """Return cos beta, sin beta, cos 3 beta, sin 3 beta ... up to ``highest``:
    (..., highest + 1)."""
    k = np.arange(1, highest + 1, 2)
    waves = np.exp(1j * k * np.asarray(beta)[..., None])
    return np.stack([waves.real, waves.imag], -1).reshape(*np.shape(beta), -1)


def fit(
    velocity: Velocity,
    axes,
    count: int = 24,
    degree: int = 3,
    progress: Callable | None = None,
    *,
    highest: int = 9,
    traits: Traits = NOTHING,
    map: Map = each,
) -> Harmonics:
    """Fit odd harmonics up to ``highest`` from ``count`` uniform directions at each
    shape.

    Other arguments, and their order, are those of `connection.fit`. The series through
    ``count`` directions is exact up to the harmonic ``count`` - 1, and those above fold
    back onto it (k onto 2 count - k), so keep ``highest`` well below. For more than two
    joints a fit takes as many directions as it has `terms`, and better twice as many.
    ValueError if ``highest`` is even or takes more directions."""
    in_range("directions", count, 2, 1e6, whole=True)
    if not is_whole(highest) or highest % 2 == 0 or not 1 <= highest < count:
        raise Refusal(
            f"harmonics must be odd and below the number of directions ({count})",
            value=highest,
        )
    axes = as_axes(axes)
    check_fit_options(degree, progress)
    d = len(axes)
    if d < 2:
        raise Refusal("harmonics need two or more joint rates, got 1 joint")
    if d > 2 and count < terms(d, highest):
        raise Refusal(
            f"harmonics of {d} joints up to {highest} need at least "
            f"{terms(d, highest)} directions, got {count}"
        )

    unit = directions(d, count)
    sampled_basis = basis(unit, highest)
    if d == 2:
        inverse = sampled_basis.T * (2.0 / count)
        residual_scale = 1.0
    else:
        inverse = np.linalg.pinv(sampled_basis)
        # The misfit in directions that the fit has not seen is larger.
        residual_scale = count / max(1, count - sampled_basis.shape[1])

    def reduce(xi):
        coefficients = np.einsum("jc,sci->ijs", inverse, xi)
        misfit = xi - np.einsum("cj,ijs->sci", sampled_basis, coefficients)
        return coefficients, residual_scale * np.sqrt((misfit**2).mean(1)).T

    fields = sampled(velocity, axes, unit, reduce, degree, progress, traits, map)
    return Harmonics(axes, *fields, degree, periods=traits.periods)
