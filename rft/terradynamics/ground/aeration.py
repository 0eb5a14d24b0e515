"""Air that rises through the grains weakens the ground, down to nothing where it
fluidises them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from rft.core.checks import Number, check_numbers
from rft.core.refusal import require
from rft.terradynamics.ground.base import GROUND_EFFECTS, Ground, GroundEffect


@GROUND_EFFECTS.register
@dataclass(frozen=True)
class Aeration(GroundEffect):
    """Air through the ground, which multiplies its strength by
    1 - air_speed / fluidisation; the stress map keeps its shape.

    An air speed at or above ``fluidisation`` is refused: no resistive force theory is
    known there. Measured alpha_z(0, 90 degrees) falls linearly with the air speed. The
    same fall at all angles, down to nothing, is assumed.

    Examples
    --------
    >>> from rft.terradynamics.ground import Aeration, ground_of
    >>> ground_of([Aeration(air_speed=0.1, fluidisation=0.25)]).strength
    0.6
    """

    air_speed: Annotated[
        float,
        Number(
            0,
            1e3,
            "m/s",
            "upward speed of the air, averaged over the cross section of the bed",
        ),
    ]
    fluidisation: Annotated[
        float,
        Number(1e-6, 1e3, "m/s", "air speed at which the ground becomes fluidised"),
    ]

    kind = "aeration"
    limit = "air_speed = 0"
    cost = "one multiplication per element"
    walks = True

    def __post_init__(self):
        check_numbers(self)
        require(
            self.air_speed < self.fluidisation,
            f"air_speed = {self.air_speed:g} m/s: the ground is fluidised from "
            f"{self.fluidisation:g} m/s, where this law no longer holds",
            instead="give a lower speed",
        )

    def apply(self, ground: Ground) -> Ground:
        share = 1.0 - self.air_speed / self.fluidisation
        return ground._replace(strength=ground.strength * share)

    @property
    def assumes(self) -> str:
        return "a strength that falls to zero at fluidisation, equally at all angles"

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Aeration]:
        return {"aeration": cls(air_speed=0.03 * x, fluidisation=0.03)}
