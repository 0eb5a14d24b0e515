"""Tables of a connection read from files, whose contents are never believed: NetCDF as `geomech connection` writes it, and
MATLAB files in sysplotter's layout."""

from geomech.io.tables.base import ORDERS, SIGNS, Stored, scaled
from geomech.io.tables.read import load

__all__ = ["ORDERS", "SIGNS", "Stored", "load", "scaled"]
