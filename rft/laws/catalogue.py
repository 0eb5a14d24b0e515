"""Named media, each with the source of every number."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rft.core.metres import GRAVITY
from rft.laws.base import Medium
from rft.laws.coulomb import Coulomb
from rft.laws.granular import Granular
from rft.laws.surface import Surface
from rft.laws.viscous import Viscous


@dataclass(frozen=True)
class Entry:
    """A named medium. axial_stress: axial drag over projected area in Pa at 7.62 cm
    depth, or None if unknown."""

    medium: Medium
    source: str
    axial_stress: float | None = None


# From the paper's one datum: on a surface tilted by 20 degrees motion downhill has 50 %
# less drag (Sec. IV B).
REPOSE = math.atan(
    math.sin(math.radians(20.0)) / (math.cos(math.radians(20.0)) - 0.5)
)  # rad, 37.9 degrees
DEPTH = 0.0762  # m, of the rods whose drag gave the axial stresses of the catalogue
GLASS = 2500.0  # kg/m^3, soda-lime glass, assumed
PACKED = {
    "loose": 0.58,
    "close": 0.62,
}  # volume fractions, Zhang and Goldman (2014), caption of Fig. 9


def pressure_factor(axial_stress: float, packed: str) -> float:
    """Return k of Eq. 2 from an axial stress in Pa at DEPTH, k = stress / (rho g |z|),
    with rho the density of glass times the volume fraction."""
    return axial_stress / (GLASS * PACKED[packed] * GRAVITY * DEPTH)


# N, A of the drag across a plate 8 mm deep, Schiebel et al. (2020)
SURFACE_ACROSS = 0.15
# N, drag along that plate, of the assumed form cos psi: about 0.017 in their figure;
# their fit is not known here. Their snakes move at 0.81 of the speed along their own
# track (0.74 to 0.89), to which 0.010 (0.78) is nearer than 0.017 (0.74).
SURFACE_ALONG = 0.017  # assumed
SURFACE_ALONG_RANGE = (0.010, 0.017)  # assumed

ZHANG_GOLDMAN = "Zhang and Goldman, Phys. Fluids 26, 101308 (2014)"
FITTED = (
    "f_n = C_S sin(atan(cot g0 sin psi)) + C_F sin psi, f_t = C_F cos psi, fitted to "
    "rod drag at 7.62 cm depth, as written in third-party code; "
)

CATALOGUE = {
    "glass-0.3mm-loose": Entry(
        Granular(C=1.8, gamma0=math.radians(13.8), k=2.5),
        f"{ZHANG_GOLDMAN}, Eqs. 2 and 3: C = 1.8, gamma0 = 13.8 degrees, k = 2.5: 2710 "
        "Pa at 7.62 cm, where the third-party code of glass-0.3mm-loose-fitted has "
        "2770",
        2710.0,
    ),
    "glass-0.3mm-loose-fitted": Entry(
        Granular(
            C=0.5108 / 0.2770,
            gamma0=math.atan(1 / 4.0587),
            k=pressure_factor(2770.0, "loose"),
        ),
        FITTED + "C_S = 0.5108, C_F = 0.2770 (1e4 Pa), cot g0 = 4.0587; agrees with "
        "glass-0.3mm-loose",
        2770.0,
    ),
    "glass-0.3mm-close": Entry(
        Granular(
            C=0.77 / 0.59,
            gamma0=math.radians(12.21),
            k=pressure_factor(5900.0, "close"),
        ),
        FITTED
        + "C_S = 0.77, C_F = 0.59 (1e4 Pa), g0 = 12.21 degrees; the close packing is "
        "inferred",
        5900.0,
    ),
    "glass-0.3mm-surface": Entry(
        Surface(
            C=0.198,
            gamma0=math.atan(math.sqrt(0.00389)),
            across=SURFACE_ACROSS / SURFACE_ALONG,
        ),
        "Schiebel et al., eLife 9, e51412 (2020): plate 8 mm deep at the surface of "
        "0.3 mm glass; drag across 0.15 N, C = 0.198, tan^2 g0 = 0.00389; drag along "
        "of the form 0.017 N cos psi is assumed (0.010 to 0.017 N)",
    ),
    "viscous-2": Entry(
        Viscous(2.0),
        "Gray and Hancock, J. Exp. Biol. 32, 802 (1955): slender-body limit, 2 : 1",
    ),
    "coulomb": Entry(
        Coulomb(), "isotropic dry friction; a model without a measured constant"
    ),
}
