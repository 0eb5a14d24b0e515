"""Force laws, one file each, and the catalogue of named media."""

from rft.media.base import Medium, TermLaw, is_closed, is_linear, is_mirror, is_rate_independent, power_of
from rft.media.catalogue import CATALOGUE
from rft.media.coulomb import Coulomb
from rft.media.granular import Granular
from rft.media.surface import Surface
from rft.media.table import Table
from rft.media.viscous import Viscous

LAWS = {"granular": Granular, "surface": Surface, "viscous": Viscous, "coulomb": Coulomb, "table": Table}

__all__ = [
    "CATALOGUE",
    "LAWS",
    "Coulomb",
    "Granular",
    "Medium",
    "Surface",
    "Table",
    "TermLaw",
    "Viscous",
    "is_closed",
    "is_linear",
    "is_mirror",
    "is_rate_independent",
    "power_of",
]
