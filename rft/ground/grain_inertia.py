"""Inertia of the grains that a fast body pushes aside: a pressure on what leads, with the square of its speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from rft.checks import Number, check_numbers
from rft.ground.base import Ground, GroundEffect
from rft.premise import Premise

POPPY_SEEDS = 638.0  # kg/m^3, loosely packed; Agarwal et al. (2021)


@dataclass(frozen=True)
class GrainInertia(GroundEffect):
    """A stress strength x density x v_n^2 against the normal of faces that lead with v_n across themselves, at any depth:
    the momentum of grains that are swept up (Agarwal et al. 2021; paper Sec. IV C).

    The other half of that work, a surface that sinks behind a fast body, is left out.
    """

    strength: Annotated[float, Number(0, 1e6, "-", "lambda, 1 to 4 by grains and body; 1 is assumed")] = 1.0
    density: Annotated[
        float, Number(0, 1e5, "kg/m^3", "density of the packed grains; that of loose poppy seeds if left out")
    ] = POPPY_SEEDS

    kind = "grain-inertia"
    breaks = Premise.RATE_INDEPENDENT
    limit = "strength = 0"  # of the rate of the motion = 0 the order is 2
    cost = "five operations an element"
    walks = True

    def __post_init__(self):
        check_numbers(self)

    def apply(self, ground: Ground) -> Ground:
        return ground._replace(flux=ground.flux + self.strength * self.density)

    @property
    def assumes(self) -> str:
        numbers = {"strength": self.strength == 1.0, "density": self.density == POPPY_SEEDS}
        told = {"strength": "lambda = 1 (1 to 4 are known)", "density": f"{POPPY_SEEDS:g} kg/m^3, of loose poppy seeds"}
        return ", ".join(told[name] for name, default in numbers.items() if default)
