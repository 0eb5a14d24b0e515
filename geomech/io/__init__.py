"""Files: read within limits, written atomically, and the formats of plain values."""

from geomech.core import modules as _modules

__getattr__, __dir__ = _modules.lazy_modules(__name__, __path__)
