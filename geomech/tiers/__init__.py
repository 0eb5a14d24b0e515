"""Tiers: ways to predict the displacement of a gait, one a file, each nearer to the truth and dearer than the one before."""

from geomech.tiers.adapted import Adapted
from geomech.tiers.area import Area
from geomech.tiers.base import Numerics, Tier
from geomech.tiers.direct import Direct
from geomech.tiers.harmonic import Harmonic
from geomech.tiers.path import Path

TIERS = {tier.name: tier for tier in (Area(), Adapted(), Path(), Harmonic(), Direct())}  # cheapest look-up first

__all__ = ["TIERS", "Adapted", "Area", "Direct", "Harmonic", "Numerics", "Path", "Tier"]
