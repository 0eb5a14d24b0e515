"""Questions about a scene, one module each with a check, a cost and a result, and what
they share."""

from geomech.core import modules as _modules

__getattr__, __dir__ = _modules.lazy_modules(__name__, __path__)
