"""Bodies in Stokes flow whose parts feel each other's flow: a nonlocal alternative to
force laws, which give a force from the local velocity alone.

A model divides the links into sites and gives the mobility matrix, the velocities of
all sites under unit forces on each (`rft.hydrodynamics.base.FluidModel`);
`resistance` inverts it for one shape or many. All motion is in one
plane. Forces across that plane cause no velocity in it, so that each site has two
components.

Lengths are in body lengths, velocities and forces in units such that 8 pi mu = 1."""

from rft.hydrodynamics.balance import Resistance, axial_drag, resistance
from rft.hydrodynamics.base import FluidModel, Sites
from rft.hydrodynamics.beads import Beads, rotne_prager
from rft.hydrodynamics.gaps import clearance
from rft.hydrodynamics.stokeslets import Stokeslets

__all__ = [
    "Beads",
    "FluidModel",
    "Resistance",
    "Sites",
    "Stokeslets",
    "axial_drag",
    "clearance",
    "resistance",
    "rotne_prager",
]


def __dir__() -> list[str]:
    return __all__
