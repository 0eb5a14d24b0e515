"""Inertia of the grains that a fast body pushes aside: a pressure on what leads, with the square of its speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.media.base import check_ranges
from rft.premise import Premise
from rft.vertical.effects.base import GroundEffect

POPPY_SEEDS = 638.0  # kg/m^3, loosely packed; Agarwal et al. (2021)


@dataclass(frozen=True)
class GrainInertia(GroundEffect):
    """A stress strength x density x v_n^2 against the normal of faces that lead with v_n across themselves, at any depth:
    the momentum of grains that are swept up (Agarwal et al. 2021; paper Sec. IV C).

    strength (-): lambda, 1 to 4 by grains and body, 1 assumed. density (kg/m^3): of the packed grains; that of loose poppy
    seeds if left out.

    The other half of that work, a surface that sinks behind a fast body, is left out.
    """

    strength: float = 1.0
    density: float = POPPY_SEEDS

    kind = "grain-inertia"
    breaks = Premise.RATE_INDEPENDENT
    limit = "strength = 0"  # of the rate of the motion = 0 the order is 2
    cost = "five operations an element"

    def __post_init__(self):
        check_ranges(self, strength=(0, 1e6), density=(0, 1e5))

    def pressure(self, v_n) -> np.ndarray:
        return self.strength * self.density * v_n * v_n

    @property
    def assumes(self) -> str:
        numbers = {"strength": self.strength == 1.0, "density": self.density == POPPY_SEEDS}
        told = {"strength": "lambda = 1 (1 to 4 are known)", "density": f"{POPPY_SEEDS:g} kg/m^3, of loose poppy seeds"}
        return ", ".join(told[name] for name, default in numbers.items() if default)
