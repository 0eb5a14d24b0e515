"""Dry granular media in the horizontal plane: Eqs. 2 and 3 of Zhang and Goldman
(2014)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers, checked_covariance
from rft.core.refusal import require
from rft.laws.base import LAWS, TermLaw


@LAWS.register
@dataclass(frozen=True)
class Granular(TermLaw):
    """Resistive force per unit length of a slender body in dry grains, opposing the
    velocity.

        f_n = (1 + C / sqrt(tan^2 gamma0 + (v.n)^2)) (v.n),     f_t = v.t,

    v the unit vector of the velocity, both times 2 k rho g r |z| (the axial drag, our
    unit of force).
    Source: Zhang and Goldman, Phys. Fluids 26, 101308 (2014), Eqs. 2-3.

    k is part of the unit of force; only effects measured against the weight of grains
    use it (grain inertia).

    covariance (-): covariance of C and gamma0 (in rad), and of k as a third parameter
    if k is given and uncertain. It changes no force; it is the uncertainty that drag
    measurements leave (`rft.fits.rods`).

    Examples
    --------
    >>> from rft import Granular
    >>> f_t, f_n = Granular(C=1.8, gamma0=0.24).traction(0.0, 1.0)
    >>> round(float(f_n), 3)  # broadside, over the axial drag
    2.748
    """

    C: Annotated[float, Number(0, 1e6, "-", "strength of the additional normal force")]
    gamma0: Annotated[
        float,
        Number(
            -1e6,
            1e6,
            "rad",
            "angle at which the additional force saturates, strictly between 0 "
            "and pi/2",
        ),
    ]
    k: Annotated[
        float | None,
        Number(
            1e-3,
            1e3,
            "-",
            "pressure on the body moving across, over the weight of the grains above "
            "it",
        ),
    ] = None
    covariance: tuple[tuple[float, ...], ...] | None = None
    law = "granular"

    def __post_init__(self):
        check_numbers(self)
        require(
            0 < self.gamma0 < math.pi / 2,
            "gamma0 must lie between 0 and 90 degrees, got "
            f"{math.degrees(self.gamma0):g} degrees ({self.gamma0:g} rad)",
        )
        sizes = (2,) if self.k is None else (2, 3)
        object.__setattr__(
            self, "covariance", checked_covariance(self.covariance, *sizes)
        )

    @property
    def uncertain(self) -> tuple[str, ...]:
        """Names of the parameters of ``covariance``, in their order."""
        return ("C", "gamma0", "k")[: len(self.covariance or (0, 0))]

    @property
    def dry(self) -> tuple[tuple[float, float, float], ...]:
        # With v_t^2 + v_n^2 written out, C (v.n) / sqrt(tan^2 g0 + (v.n)^2)
        # = C cos g0 v_n / sqrt(sin^2 g0 v_t^2 + v_n^2): a second dry term.
        return (1.0, 1.0, 1.0), (
            math.sin(self.gamma0),
            0.0,
            self.C * math.cos(self.gamma0),
        )

    @classmethod
    def examples(cls) -> dict[str, Granular]:
        return {
            "sharp": cls(C=1.8, gamma0=math.radians(0.1)),
            "blunt": cls(C=1.8, gamma0=math.radians(89.9)),
            "no-extra": cls(C=0.0, gamma0=0.3),
            "strong": cls(C=1e3, gamma0=0.24),
        }
