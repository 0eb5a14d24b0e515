"""Three-dimensional granular resistive force theory: the stress on a face from its
normal and its velocity.

Source: S. Agarwal, D. I. Goldman and K. Kamrin, PNAS 120, e2214017120 (2023). Here z is
up, n the outward unit normal of a face and v the unit vector of its velocity, and

    stress = xi_n alpha(n, v) |z|      on faces that lead (n . v >= 0), |z| deep,

with alpha a fit in three invariants. The fit is for a plate, not for one of its faces,
so it takes n' = n or -n, the one that points down. With r the horizontal direction of v
and theta = z x r,

    n' = (sin beta cos psi, sin beta sin psi, -cos beta),      along r, theta, z
    v = (cos gamma, 0, -sin gamma),
    x1 = sin gamma,   x2 = cos beta,   x3 = n' . v,
    alpha_r = f1 sin beta cos psi + f2 cos gamma,
    alpha_theta = f1 sin beta sin psi,
    alpha_z = -f1 cos beta - f2 sin gamma - f3,

so that alpha = f1 n' + f2 v - f3 z, with f1, f2, f3 polynomials of degree 3 in x1, x2,
x3. The code needs no angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers, in_range, unmasked
from rft.core.metres import GRAVITY
from rft.core.refusal import require
from rft.formulas.vectors import absolute, combinations, formula, minimum, sqrt, where
from rft.terradynamics.ground.lead import jump, smoothstep, smoothstep_slope
from rft.terradynamics.meshes.forces.triples import UP, dot, minus, plus, times

DOWN = (0.0, 0.0, -1.0)
TENSION = ("cut", "keep", "push")
UPRIGHT = 1e-9  # |n . z| of faces that are vertical but for roundoff

# Coefficients of f1, f2, f3 (rows) for 1 and the terms of `fit_terms`. Source: Agarwal
# et al. (2023), as in a public implementation. Invariance about the vertical, and no
# stress along theta where psi = 0, hold by the form of the law for any digits.
COEFFICIENTS = (
    (
        0.00212, -0.02320, -0.20890, -0.43083, -0.00259, 0.48872, -0.00415,
        0.07204, -0.02750, -0.08772, 0.01992, -0.45961, 0.40799, -0.10107,
        -0.06576, 0.05664, -0.09269, 0.01892, 0.01033, 0.15120,
    ),
    (
        -0.06796, -0.10941, 0.04725, -0.06914, -0.05835, -0.65880, -0.11985,
        -0.25739, -0.26834, 0.02692, -0.00736, 0.63758, 0.08997, 0.21069,
        0.04748, 0.20406, 0.18589, 0.04934, 0.13527, -0.33207,
    ),
    (
        -0.02634, -0.03436, 0.45256, 0.00835, 0.02553, -1.31290, -0.05532,
        0.06790, -0.16404, 0.02287, 0.02927, 0.95406, -0.00131, -0.11028,
        0.01487, -0.02730, 0.10911, -0.04097, 0.07881, -0.27519,
    ),
)  # fmt: skip


@formula
def sign_downwards(n, v, up):
    """Return the factor, 1 or -1, of normals n that makes them point down; of the two
    normals of a vertical face, the one that leads counts."""
    height = dot(up, n)
    is_vertical = absolute(height) <= UPRIGHT
    return where((height > UPRIGHT) | (is_vertical & (dot(n, v) < 0.0)), -1.0, 1.0)


@formula
def fit_terms(n, v, up, down):
    """Return the 19 terms in x1, x2, x3 of the polynomials f1, f2, f3, of degree 2 and
    less first; ``down`` is `sign_downwards`."""
    x1 = -dot(up, v)
    x2 = -(down * dot(up, n))
    x3 = down * dot(n, v)
    a = x1 * x1
    b = x2 * x2
    c = x3 * x3
    return (
        x1, x2, x3, a, b, c, x1 * x2, x2 * x3, x3 * x1,
        x1 * a, x2 * b, x3 * c, x1 * b, x2 * a, x2 * c, x3 * b, x3 * a, x1 * c,
        x1 * x2 * x3,
    )  # fmt: skip


@formula
def fitted_alpha(n, v, up=UP):
    """Return `alpha` for unit normals n and unit velocities v; ``up`` is the unit
    vector upwards."""
    down = sign_downwards(n, v, up)
    f1, f2, f3 = combinations(COEFFICIENTS, fit_terms(n, v, up, down))
    return minus(plus(times(f1 * down, n), times(f2, v)), times(f3, up))


# The slopes of f1, f2, f3 by x1 and by x3, as coefficients of 1, x1, x2, x3, x1^2,
# x2^2, x3^2, x1 x2, x2 x3, x3 x1.
BY_X1 = tuple(
    (c[1], 2 * c[4], c[7], c[9], 3 * c[10], c[13], c[18], 2 * c[14], c[19], 2 * c[17])
    for c in COEFFICIENTS
)
BY_X3 = tuple(
    (c[3], c[9], c[8], 2 * c[6], c[17], c[16], 3 * c[12], c[19], 2 * c[15], 2 * c[18])
    for c in COEFFICIENTS
)


@formula
def fitted_alpha_slope(n, v, up, k):
    """Return the slope of `fitted_alpha` by the component of v along the unit vector
    k."""
    down = sign_downwards(n, v, up)
    terms = fit_terms(n, v, up, down)
    _, f2, _ = combinations(COEFFICIENTS, terms)
    f1_1, f2_1, f3_1 = combinations(BY_X1, terms[:9])
    f1_3, f2_3, f3_3 = combinations(BY_X3, terms[:9])
    dx1 = -dot(up, k)
    dx3 = down * dot(n, k)
    along_n = (f1_1 * dx1 + f1_3 * dx3) * down
    along_v = f2_1 * dx1 + f2_3 * dx3
    along_up = f3_1 * dx1 + f3_3 * dx3
    sideways = plus(times(along_v, v), times(f2, k))
    return minus(plus(times(along_n, n), sideways), times(along_up, up))


def alpha(n, v) -> np.ndarray:
    """Return the fitted stress over xi_n |z|, (..., 3) along x, y, z, on faces with
    unit normals n and unit velocities v (..., 3).

    It has no unit, leaves surface friction out, and does not depend on whether the face
    leads. The law is invariant under rotations of n and v about the vertical. It jumps,
    by 0.02 in the mean, where a face passes through the vertical and its other side
    begins to point down; a vertical face counts as one that leads.
    """
    return _by_rows(fitted_alpha, n, v)


def _by_rows(law, n, v) -> np.ndarray:
    """Return law(n, v), a function of triples of arrays (N,), for n and v (..., 3)."""
    n, v = np.broadcast_arrays(unmasked("n", n), unmasked("v", v))
    stress = np.stack(law(n.reshape(-1, 3).T, v.reshape(-1, 3).T), -1)
    return stress.reshape(n.shape)


@dataclass(frozen=True)
class Spatial:
    """A granular medium in three dimensions.

    tension (-): stress on faces on which the fit pulls: "cut" (none), "keep" (as
    fitted), or "push" (its component across the face reversed, as public codes do).

    `Spatial.from_grains` computes xi_n from density and friction. The law holds for
    slow motion in undisturbed ground. It jumps where a face begins to lead. The jump is
    rounded over the grazing angle, so that faces along which the body slides bear
    nothing by roundoff, and forces converge with the mesh.

    The fit pulls in 5 % of all directions of faces that lead. It dissipates in all but
    two regions, both of faces that look up. A face within 10 degrees of level that is
    drawn out forwards, up to 20 degrees above the horizontal, drives the motion in 0.05
    % of directions, with at most 0.0052 xi_n |z| of stress. A face tilted by 56 to 64
    degrees that is drawn out against its tilt, 64 to 71 degrees above the horizontal,
    does so in 0.011 % of directions, with at most 8e-4 xi_n |z|; "cut" and "push" leave
    0.001 % and 4e-4 of this region.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Spatial
    >>> density, friction = 1500.0, 0.5  # kg/m^3, internal
    >>> sand = Spatial.from_grains(density, friction, surface_friction=0.4)
    >>> round(sand.xi_n / 1e6, 3)  # N/cm^3
    0.879
    """

    xi_n: Annotated[
        float,
        Number(
            1,
            1e12,
            "N/m^3",
            "strength, 1 to 1e12; a plate pushed straight down carries 0.875 xi_n |z|",
        ),
    ]
    surface_friction: Annotated[
        float,
        Number(
            0, 10, "-",
            "friction of grains on the intruder, 0 to 10; the stress along a face is "
            "at most this times the stress across it",
        ),
    ] = 0.4  # fmt: skip  # assumed: glass or plastic on grains
    tension: str = "cut"
    grazing: Annotated[
        float,
        Number(
            0, 0.5, "rad",
            "angle, 0 to 0.5, between velocity and face over which the stress grows "
            "from 0 to its full value; 0 for a jump",
        ),
    ] = math.radians(2.0)  # fmt: skip  # assumed

    def __post_init__(self):
        check_numbers(self)
        require(
            self.tension in TENSION,
            f"tension must be one of {', '.join(TENSION)}",
            value=self.tension,
        )

    @classmethod
    def from_grains(cls, density: float, friction: float, **more) -> Spatial:
        """Return the medium of grains with a critical density, kg/m^3, and an internal
        friction mu, the tangent of the angle of repose, 0.05 to 1.5: xi_n = density g
        (894 mu^3 - 386 mu^2 + 89 mu), the fit of Agarwal et al. (2023)."""
        in_range("density", density, 1, 1e5, unit="kg/m^3")
        in_range("friction", friction, 0.05, 1.5)
        mu = friction
        return cls(density * GRAVITY * (894 * mu**3 - 386 * mu**2 + 89 * mu), **more)

    @property
    def plate(self) -> float:
        """Stress on a plate pushed straight down, over xi_n |z|, at any ``tension``."""
        return float(alpha(DOWN, DOWN)[2])

    @property
    def grazing_sine(self) -> float:
        """Sine of the grazing angle."""
        return math.sin(self.grazing)

    def stress(self, n, v) -> np.ndarray:
        """Return the force per area and depth (..., 3), N/m^3, of the grains on faces
        with outward unit normals n (..., 3) and velocities v (..., 3), of any size; 0
        on faces that trail or rest."""
        return _by_rows(self._stress, n, v)

    def _stress(self, n: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return `stress` (3, N) for n and v (3, N)."""
        speed = np.sqrt(dot(v, v))
        is_moving = speed > 0
        v = v / np.where(is_moving, speed, 1.0)
        share = self.lead(dot(n, v), self.grazing_sine) * is_moving
        return np.stack(self.traction(n, v)) * share

    @property
    def cut(self) -> float:
        """1.0 if faces on which the fit pulls have no stress across, else 0.0."""
        return float(self.tension == "cut")

    @property
    def pushed(self) -> float:
        """1.0 if the fit's pull across a face is reversed, else 0.0."""
        return float(self.tension == "push")

    @property
    def numbers(self) -> dict[str, float]:
        """Numbers that the formulas read (`rft.laws.records.law_numbers`)."""
        names = "xi_n", "surface_friction", "cut", "pushed"
        return {name: float(getattr(self, name)) for name in names}

    @formula
    def traction(self, n, v, up=UP):
        """Return the force per area and depth, N/m^3, for unit normals n and unit
        velocities v, whether or not faces lead; ``up`` is the unit vector upwards.
        Surface friction limits it, and ``tension`` on faces that are pulled."""
        a = fitted_alpha(n, v, up)
        across = dot(a, n)  # negative: a push against the face
        along = minus(a, times(across, n))
        if self.cut == 1.0:
            across = minimum(across, 0.0)
        elif self.pushed == 1.0:
            across = -absolute(across)
        size = sqrt(dot(along, along))
        most = self.surface_friction * absolute(across)
        share = minimum(1.0, most / where(size > 0.0, size, 1.0))
        return times(self.xi_n, plus(times(across, n), times(share, along)))

    @formula
    def traction_slope(self, n, v, up, k):
        """Return the slope of `traction` by the component of v along the unit vector
        k."""
        a = fitted_alpha(n, v, up)
        da = fitted_alpha_slope(n, v, up, k)
        across = dot(a, n)
        d_across = dot(da, n)
        along = minus(a, times(across, n))
        d_along = minus(da, times(d_across, n))
        if self.cut == 1.0:
            d_across = where(across < 0.0, d_across, 0.0)
            across = minimum(across, 0.0)
        elif self.pushed == 1.0:
            d_across = where(across < 0.0, d_across, -d_across)
            across = -absolute(across)

        size = sqrt(dot(along, along))
        size = where(size > 0.0, size, 1.0)
        most = self.surface_friction * absolute(across)
        share = minimum(1.0, most / size)
        d_most = -self.surface_friction * d_across  # across is at most 0 ...
        if self.cut == 0.0 and self.pushed == 0.0:
            d_most = where(across < 0.0, d_most, -d_most)  # ... but where tension stays
        d_share = (d_most - share * dot(along, d_along) / size) / size
        d_share = where(most < size, d_share, 0.0)
        shifted = plus(times(d_share, along), times(share, d_along))
        return times(self.xi_n, plus(times(d_across, n), shifted))

    @formula
    def lead_slope(self, n_dot_v, grazing_sine, sheet=False):
        """Return the slope of `lead` by n_dot_v."""
        size = where(sheet, absolute(n_dot_v), n_dot_v)
        if grazing_sine > 0.0:
            slope = smoothstep_slope(size, grazing_sine)
            return where(sheet & (n_dot_v < 0.0), -slope, slope)
        return 0.0 * n_dot_v

    @formula
    def lead(self, n_dot_v, grazing_sine, sheet=False):
        """Return the share of the traction that faces bear, 0 to 1; a sheet leads on
        either side."""
        n_dot_v = where(sheet, absolute(n_dot_v), n_dot_v)
        if grazing_sine > 0.0:
            return smoothstep(n_dot_v, grazing_sine)
        return jump(n_dot_v)


def alpha_of_angles(beta, gamma, psi) -> np.ndarray:
    """Return alpha (..., 3) along r, theta, z of a plate tilted by beta that moves
    gamma below the horizontal, with its normal at the angle psi from that direction
    about the vertical; rad."""
    angles = [unmasked("beta, gamma and psi", angle) for angle in (beta, gamma, psi)]
    beta, gamma, psi = np.broadcast_arrays(*angles)
    n_r = np.sin(beta) * np.cos(psi)
    n_theta = np.sin(beta) * np.sin(psi)
    n = np.stack([n_r, n_theta, -np.cos(beta)], -1)
    v = np.stack([np.cos(gamma), np.zeros_like(gamma), -np.sin(gamma)], -1)
    return alpha(n, v)
