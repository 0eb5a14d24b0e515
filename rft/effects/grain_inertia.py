"""Inertia of the grains that a fast body accelerates: drag that grows with the square
of the speed across the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.metres import GRAVITY
from rft.core.premise import Premise
from rft.core.refusal import require
from rft.effects.base import EFFECTS, Effect
from rft.effects.contact import Problem
from rft.laws.base import is_linear
from rft.laws.batch import for_samples

# k of Eq. 2 for loosely packed 0.3 mm glass (Zhang and Goldman 2014); assumed where k
# is unknown
ASSUMED_K = 2.5


@EFFECTS.register
@dataclass(frozen=True)
class GrainInertia(Effect):
    """A normal stress strength x rho v_n^2 on the body's width 2 r, added to Eqs. 2-3
    (paper Sec. IV C).

    The form is the momentum flux of grains that the body sweeps up, as in impact laws.
    In units of the axial drag 2 k rho g r |z| the force is strength v_n^2 / (k g |z|),
    without radius or density. Dry media only.

    Where neither the medium nor ``k`` gives k of Eq. 2 (2.5 for loose glass, 5.1 for
    close), that of loose glass is assumed.

    Examples
    --------
    >>> from rft.effects import GrainInertia
    >>> GrainInertia(frequency=2.0, length=0.3, depth=0.05).breaks
    <Premise.RATE_INDEPENDENT: 1>
    """

    frequency: Annotated[
        float,
        Number(
            0,
            1e4,
            "1/s",
            "cycles per second; the gait gives alphadot per radian of phase",
        ),
    ]
    length: Annotated[float, Number(1e-9, 1e6, "m", "length of the body")]
    depth: Annotated[float, Number(1e-9, 1e6, "m", "depth |z|")]
    strength: Annotated[
        float, Number(0, 1e6, "-", "lambda; the default 1 is assumed")
    ] = 1.0
    k: Annotated[
        float | None,
        Number(1e-3, 1e3, "-", "factor of Eq. 2, instead of the medium's"),
    ] = None

    kind = "grain-inertia"
    mixes_media = True
    odd = True
    breaks = Premise.RATE_INDEPENDENT
    limit = "frequency = 0"
    order = 2  # of strength = 0 it is 1
    cost = "a dozen operations per element"
    batched = ("frequency", "length", "depth", "strength", "k")

    def __post_init__(self):
        check_numbers(self)

    def _given_k(self, medium):
        """Return k as the effect or the medium gives it; None where neither does."""
        if self.k is None:
            return getattr(medium, "k", None)
        return self.k

    def assumes(self, medium: Any) -> str:
        if self._given_k(medium) is None:
            return f"k = {ASSUMED_K:g}, the value for loose glass"
        return ""

    def check(self, medium: Any) -> None:
        require(
            not is_linear(medium),
            f"grain inertia needs a granular medium, got {type(medium).__name__}",
        )

    def apply(self, problem: Problem, site: Any = None, state: Any = None) -> Problem:
        speed_per_rad = 2 * np.pi * self.frequency * self.length
        k = self.k
        if k is None:
            k = for_samples(problem.medium, _k_of)
        strength = self.strength * speed_per_rad**2 / (k * GRAVITY * self.depth)
        # The flux of momentum does not depend on the pressure of the ground, so the
        # factors of the drag leave it alone.
        quadratic_drag = problem.quadratic_drag + np.atleast_2d(strength)
        return problem._replace(quadratic_drag=quadratic_drag)

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, GrainInertia]:
        return {
            "grain-inertia": cls(frequency=x, length=0.7, depth=0.07, strength=1.5),
            "grain-inertia, strength": cls(
                frequency=1.2, length=0.4, depth=0.07, strength=x
            ),
        }


def _k_of(medium) -> float:
    """Return the k of a medium, or the assumed one."""
    k = getattr(medium, "k", None)
    return ASSUMED_K if k is None else k
