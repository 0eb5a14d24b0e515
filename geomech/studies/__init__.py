"""Questions about a scene, each with a check, a cost and a result: one module a question, and what they share."""

from geomech.core import modules as _modules

__getattr__, __dir__ = _modules.lazy_modules(__name__, __path__)
