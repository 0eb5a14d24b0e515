"""Air that rises through the grains: they bear less, up to where they are fluidised and bear nothing."""

from __future__ import annotations

from dataclasses import dataclass

from rft.media.base import check_ranges, require
from rft.vertical.effects.base import GroundEffect


@dataclass(frozen=True)
class Aeration(GroundEffect):
    """Strength times 1 - air_speed / fluidisation; the stress map keeps its shape.

    air_speed (m/s): of the air over the bed's whole cross section, upwards. fluidisation (m/s): the air speed from which the
    ground is fluidised; that, and anything faster, is refused, for no resistive force theory is known there.

    Strength that falls linearly with air speed is a finding about alpha_z(0, 90 degrees); that it holds for all angles alike,
    and that it falls to nothing, is assumed.
    """

    air_speed: float
    fluidisation: float

    kind = "aeration"
    limit = "air_speed = 0"
    cost = "one multiplication an element"

    def __post_init__(self):
        check_ranges(self, air_speed=(0, 1e3), fluidisation=(1e-6, 1e3))
        told = f"air_speed = {self.air_speed:g} m/s: the ground is fluidised from {self.fluidisation:g} m/s on, and no longer "
        require(self.air_speed < self.fluidisation, f"{told}bears as this law says; give less")

    def share(self, x, ahead=0.0) -> float:
        return 1.0 - self.air_speed / self.fluidisation

    @property
    def assumes(self) -> str:
        return "that strength falls to nothing at fluidisation, at all angles alike"
