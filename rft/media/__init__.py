"""Force laws, one file each, and the catalogue of named media."""

from rft.media.base import Medium, TermLaw, is_linear
from rft.media.catalogue import CATALOGUE
from rft.media.coulomb import Coulomb
from rft.media.granular import Granular
from rft.media.viscous import Viscous

LAWS = {"granular": Granular, "viscous": Viscous, "coulomb": Coulomb}

__all__ = ["CATALOGUE", "LAWS", "Coulomb", "Granular", "Medium", "TermLaw", "Viscous", "is_linear"]
