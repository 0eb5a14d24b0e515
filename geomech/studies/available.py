"""The tiers that a system allows."""

from __future__ import annotations

from geomech.mathematics.systems.base import System
from geomech.mathematics.tiers import TIERS


def available_tiers(system: System) -> tuple[str, ...]:
    """Return the names of all tiers that can predict displacements of the system, the
    cheapest look-up first."""
    return tuple(name for name, tier in TIERS.items() if tier.is_offered(system))


def default_tiers(system: System) -> tuple[str, ...]:
    """Return the tiers of a plain study: without those whose tables serve one family of
    gaits only."""
    return tuple(name for name in available_tiers(system) if TIERS[name].common)
