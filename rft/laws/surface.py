"""Drag of a shallow body at the surface of dry grains: the form of Eq. 3 across, its
own strength along."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers, checked_covariance
from rft.core.refusal import require
from rft.laws.base import LAWS, TermLaw


@LAWS.register
@dataclass(frozen=True)
class Surface(TermLaw):
    """Resistive force per unit length of a shallow body at the surface of dry grains,
    opposing the velocity.

        f_n = across (1 + C / sqrt(tan^2 gamma0 + (v.n)^2)) (v.n),     f_t = v.t,

    v the unit vector of the velocity, in units of the axial drag. With across = 1 the
    law is that of `Granular`. The form of f_n is the one that Schiebel et al. (eLife 9,
    e51412, 2020) fitted to the drag on a plate; that of f_t, Coulomb friction, is
    assumed.

    covariance (-): covariance of C, gamma0 (in rad) and across. It changes no force; it
    is the uncertainty that drag measurements leave.

    Examples
    --------
    >>> from rft.laws import Surface
    >>> f_t, f_n = Surface(C=1.8, gamma0=0.24, across=1.0).traction(0.0, 1.0)
    >>> round(float(f_n), 3)
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
    across: Annotated[
        float,
        Number(
            1e-6,
            1e6,
            "-",
            "strength of the drag across (A of the fit) over the axial drag",
        ),
    ]
    covariance: tuple[tuple[float, ...], ...] | None = None
    uncertain = ("C", "gamma0", "across")
    law = "surface"

    def __post_init__(self):
        check_numbers(self)
        require(
            0 < self.gamma0 < math.pi / 2,
            "gamma0 must lie between 0 and 90 degrees, got "
            f"{math.degrees(self.gamma0):g} degrees ({self.gamma0:g} rad)",
        )
        object.__setattr__(self, "covariance", checked_covariance(self.covariance, 3))

    @property
    def dry(self) -> tuple[tuple[float, float, float], ...]:
        # As in `Granular`: C (v.n) / sqrt(tan^2 g0 + (v.n)^2) = C cos g0 v_n /
        # sqrt(sin^2 g0 v_t^2 + v_n^2).
        extra = self.across * self.C * math.cos(self.gamma0)
        return (1.0, 1.0, float(self.across)), (math.sin(self.gamma0), 0.0, extra)

    @classmethod
    def examples(cls) -> dict[str, Surface]:
        return {"surface": cls(C=0.2, gamma0=0.06, across=9.0)}
