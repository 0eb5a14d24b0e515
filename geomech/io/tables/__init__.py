"""Tables of a connection in files: NetCDF, and MATLAB files in sysplotter's layout.

Each format has a module. Everything read from a file is checked.
"""

from geomech.io.tables.base import FORMATS, LAYOUTS, ORDERS, SIGNS, Stored, scaled
from geomech.io.tables.frames import in_frame
from geomech.io.tables.read import load
from rft.core.registry import load_all

load_all(__name__, __path__)

__all__ = [
    "FORMATS",
    "LAYOUTS",
    "ORDERS",
    "SIGNS",
    "Stored",
    "in_frame",
    "load",
    "scaled",
]


def __dir__() -> list[str]:
    return __all__
