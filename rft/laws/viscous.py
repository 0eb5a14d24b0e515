"""Low-Reynolds-number drag, the paper's comparison (Fig. 5(c)): linear in the
velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers, checked_covariance
from rft.laws.base import LAWS, TermLaw


@LAWS.register
@dataclass(frozen=True)
class Viscous(TermLaw):
    """Linear drag: f_t = v_t, f_n = ratio v_n per unit length, in units of the axial
    drag coefficient.

    A ratio of 2 is the slender-body limit of Gray and Hancock, J. Exp. Biol. 32, 802
    (1955).

    covariance (-): variance of the ratio, a 1 x 1 matrix. It changes no force; it is
    the uncertainty that drag measurements leave (`rft.fits.rods`).

    Examples
    --------
    >>> from rft import Viscous
    >>> [float(f) for f in Viscous(2.0).traction(0.5, 0.5)]
    [0.5, 1.0]
    """

    ratio: Annotated[float, Number(1e-8, 1e8, "-", "normal drag over axial drag")] = 2.0
    covariance: tuple[tuple[float, ...], ...] | None = None
    uncertain = ("ratio",)
    law = "viscous"

    def __post_init__(self):
        check_numbers(self)
        object.__setattr__(self, "covariance", checked_covariance(self.covariance, 1))

    @property
    def viscous(self) -> tuple[float, float]:
        return 1.0, float(self.ratio)

    @classmethod
    def examples(cls) -> dict[str, Viscous]:
        return {"viscous-1": cls(1.0), "viscous-slippery": cls(1e4)}
