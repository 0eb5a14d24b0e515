"""Low-Reynolds-number drag, the paper's comparison (Fig. 5(c)): linear in the
velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers, checked_covariance
from rft.core.refusal import Refusal
from rft.formulas.cylinders import SHORTEST, drag_ratio
from rft.laws.base import LAWS, TermLaw

LIMIT = 2.0  # ratio of an infinitely thin body


@LAWS.register
@dataclass(frozen=True)
class Viscous(TermLaw):
    """Linear drag: f_t = v_t, f_n = ratio v_n per unit length, in units of the axial
    drag coefficient.

    A ratio of 2 is the slender-body limit of Gray and Hancock, J. Exp. Biol. 32, 802
    (1955). ``slenderness`` sets the ratio of a straight cylinder as long as the body,
    which is less (`rft.formulas.cylinders`): 1.39 at 10, 1.57 at 50, 1.66 at 200. Parts
    of a bent body feel each other's flow, which no ratio describes
    (`rft.hydrodynamics`).

    covariance (-): variance of the ratio, a 1 x 1 matrix. It changes no force; it is
    the uncertainty that drag measurements leave (`rft.fits.rods`).

    Examples
    --------
    >>> from rft import Viscous
    >>> [float(f) for f in Viscous(2.0).traction(0.5, 0.5)]
    [0.5, 1.0]
    >>> round(Viscous(slenderness=50).ratio, 3)
    1.567
    """

    ratio: Annotated[float, Number(1e-8, 1e8, "-", "normal drag over axial drag")] = (
        LIMIT
    )
    covariance: tuple[tuple[float, ...], ...] | None = None
    slenderness: Annotated[
        float | None,
        Number(
            SHORTEST,
            1e6,
            "-",
            "length of the body over its diameter, 2 or more, in place of the ratio, "
            "which is then that of a straight cylinder",
        ),
    ] = None
    uncertain = ("ratio",)
    law = "viscous"

    def __post_init__(self):
        check_numbers(self)
        object.__setattr__(self, "covariance", checked_covariance(self.covariance, 1))
        if self.slenderness is None:
            return
        ratio = float(drag_ratio(self.slenderness))
        if self.ratio not in (LIMIT, ratio):
            raise Refusal(
                "ratio and slenderness both give the drag across over the drag along",
                instead="keep one of them",
            )
        if self.covariance is not None:
            raise Refusal(
                "covariance belongs to a measured ratio",
                instead="give ratio in place of slenderness",
            )
        object.__setattr__(self, "ratio", ratio)

    @property
    def viscous(self) -> tuple[float, float]:
        return 1.0, float(self.ratio)

    @classmethod
    def examples(cls) -> dict[str, Viscous]:
        return {"viscous-1": cls(1.0), "viscous-slippery": cls(1e4)}
