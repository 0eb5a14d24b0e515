"""Inertia of the grains that a fast body pushes away: a pressure on leading faces that
grows with the square of their speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers
from rft.core.premise import Premise
from rft.terradynamics.ground.base import GROUND_EFFECTS, Ground, GroundEffect

POPPY_SEEDS = 638.0  # kg/m^3, loosely packed; Agarwal et al. (2021)


@GROUND_EFFECTS.register
@dataclass(frozen=True)
class GrainInertia(GroundEffect):
    """A stress of strength x density x v_n^2 against the normal of leading faces, at
    any depth, where v_n is the speed of a face along its normal.

    It is the momentum that the face gives to the grains it sweeps up (Agarwal et al.
    2021; paper Sec. IV C). The other finding of that work, a surface that sinks behind
    a fast body, is not modelled.

    Examples
    --------
    >>> from rft.terradynamics.ground import GrainInertia, ground_of
    >>> ground_of([GrainInertia(strength=2.0)]).flux  # kg/m^3
    1276.0
    """

    strength: Annotated[
        float,
        Number(
            0,
            1e6,
            "-",
            "lambda, 1 to 4 depending on grains and body; the default 1 is assumed",
        ),
    ] = 1.0
    density: Annotated[
        float,
        Number(
            0,
            1e5,
            "kg/m^3",
            "density of the packed grains; the default is that of loose poppy seeds",
        ),
    ] = POPPY_SEEDS

    kind = "grain-inertia"
    breaks = Premise.RATE_INDEPENDENT
    limit = "strength = 0"  # in the rate of the motion the order is 2
    cost = "five operations per element"
    walks = True

    def __post_init__(self):
        check_numbers(self)

    def apply(self, ground: Ground) -> Ground:
        return ground._replace(flux=ground.flux + self.strength * self.density)

    @property
    def assumes(self) -> str:
        assumptions = []
        if self.strength == 1.0:
            assumptions.append("lambda = 1 (values of 1 to 4 are known)")
        if self.density == POPPY_SEEDS:
            assumptions.append(
                f"{POPPY_SEEDS:g} kg/m^3, the density of loose poppy seeds"
            )
        return ", ".join(assumptions)

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, GrainInertia]:
        return {"grain-inertia": cls(strength=2 * x, density=700.0)}
