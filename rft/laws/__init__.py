"""Force laws, one a file, and the catalogue of named media.

A new file in this folder is found by itself (`rft.core.registry.load_all`); imports
here are the public names. `rft.laws.viscous` is a short example."""

from rft.core.registry import load_all
from rft.laws.base import (
    LAWS,
    Medium,
    TermLaw,
    is_closed,
    is_linear,
    is_mirror,
    is_rate_independent,
    speed_exponent,
)
from rft.laws.catalogue import CATALOGUE
from rft.laws.coulomb import Coulomb
from rft.laws.granular import Granular
from rft.laws.surface import Surface
from rft.laws.table import Table
from rft.laws.viscous import Viscous

load_all(__name__, __path__)

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
    "speed_exponent",
]


def __dir__() -> list[str]:
    return __all__
