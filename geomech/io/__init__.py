"""Files: read within limits, written atomically, and the formats of plain values."""

from geomech.core import modules as _modules

__getattr__, __dir__ = _modules.of_package(__name__, __path__)
