"""Tiers: methods to predict the displacement of a gait, one in each file.

Each is nearer to the truth than the one before, and costs more."""

from geomech.mathematics.tiers.adapted import ADAPTED
from geomech.mathematics.tiers.area import AREA
from geomech.mathematics.tiers.base import TIERS, Numerics, Plan, Table, Tier
from geomech.mathematics.tiers.direct import DIRECT
from geomech.mathematics.tiers.harmonic import HARMONIC
from geomech.mathematics.tiers.path import PATH

for _tier in (AREA, ADAPTED, PATH, HARMONIC, DIRECT):  # cheapest look-up first
    TIERS.register(_tier)

__all__ = ["TIERS", "Numerics", "Plan", "Table", "Tier"]


def __dir__() -> list[str]:
    return __all__
