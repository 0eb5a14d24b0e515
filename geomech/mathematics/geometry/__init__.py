"""Connections, CCFs and metrics of any velocity(alpha, alphadot), over shape space and
along gaits."""

from geomech.core import modules as _modules

__getattr__, __dir__ = _modules.lazy_modules(__name__, __path__)
