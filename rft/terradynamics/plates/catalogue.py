"""Named media of the vertical plane, each with the source of its numbers."""

from __future__ import annotations

from dataclasses import dataclass

from rft.terradynamics.plates.stress import StressMap

LI = "Li, Zhang and Goldman, Science 339, 1408 (2013), Table S2"


@dataclass(frozen=True)
class VerticalEntry:
    """A named medium of the vertical plane and the source of its numbers.

    Examples
    --------
    >>> from rft.terradynamics.plates import VERTICAL
    >>> VERTICAL["glass-3mm"].stress.zeta
    0.224
    """

    stress: StressMap
    source: str


def _scaled_entry(zeta: float, grains: str) -> VerticalEntry:
    """Return the entry of the generic set times zeta, which was fitted to
    ``grains``."""
    return VerticalEntry(
        StressMap(zeta=zeta),
        f"generic set M0 times zeta = {zeta:g}, fitted to {grains}; {LI}",
    )


LOOSE = StressMap(0.051, 0.047, 0.053, 0.083, 0.020, -0.026, 0.057, 0.0, 0.025)
CLOSE = StressMap(0.094, 0.092, 0.092, 0.151, 0.035, -0.039, 0.086, 0.018, 0.046)

# In three dimensions xi_n is chosen so that a level plate bears the same.
OWN = f"nine coefficients of its own; {LI}; a level plate carries"

VERTICAL = {
    "generic": VerticalEntry(
        StressMap(), f"the generic set M0, zeta = 1 (1 N/cm^3 straight down); {LI}"
    ),
    "poppy-seeds-loose": VerticalEntry(
        LOOSE,
        f"{OWN} 6 % more than by poppy-seeds-loose-scaled, also in three dimensions",
    ),
    "poppy-seeds-close": VerticalEntry(
        CLOSE,
        f"{OWN} 10 % more than by poppy-seeds-close-scaled, also in three dimensions",
    ),
    "glass-3mm": _scaled_entry(0.224, "3 mm glass spheres"),
    "poppy-seeds-loose-scaled": _scaled_entry(0.240, "loose poppy seeds"),
    "poppy-seeds-close-scaled": _scaled_entry(0.422, "close-packed poppy seeds"),
}
