"""Which tiers a system allows."""

from __future__ import annotations

from geomech.systems.base import System
from geomech.tiers import TIERS

METHODS = TIERS  # cheapest look-up first


def tiers(system: System) -> tuple[str, ...]:
    """All that say something of this system."""
    return tuple(name for name, tier in TIERS.items() if tier.is_offered(system))


def methods(system: System) -> tuple[str, ...]:
    """Those of a plain study: without tables that serve one family of gaits only."""
    return tuple(name for name in tiers(system) if TIERS[name].common)
