"""Scenes: what is simulated, and how finely. `load` reads one by its name or from a
TOML file, `toml` returns its text."""

from importlib import import_module
from typing import TYPE_CHECKING

from geomech.scenes.model import Numerics, Scene
from geomech.scenes.read import (
    builtin_names,
    from_tables,
    in_medium,
    inputs,
    intruder_names,
    load,
    parse,
    walker_names,
)
from geomech.scenes.write import tables, toml

if TYPE_CHECKING:
    from geomech.scenes.terradynamics.intruder import IntruderScene
    from geomech.scenes.terradynamics.intruding import Intruding
    from geomech.scenes.terradynamics.solid import MeshScene
    from geomech.scenes.terradynamics.walker import WalkerScene

__all__ = [
    "IntruderScene",
    "Intruding",
    "MeshScene",
    "Numerics",
    "Scene",
    "WalkerScene",
    "builtin_names",
    "from_tables",
    "in_medium",
    "inputs",
    "intruder_names",
    "load",
    "parse",
    "tables",
    "toml",
    "walker_names",
]

_MODULES = {  # of scenes without a gait, by class
    "IntruderScene": "intruder",
    "Intruding": "intruding",
    "MeshScene": "solid",
    "WalkerScene": "walker",
}


def __getattr__(name: str) -> type:
    """Return a class of scenes without a gait."""
    # Its mechanics takes as long to import as that of all other scenes together, so it
    # is imported when first used.
    if name not in _MODULES:
        raise AttributeError(f"module 'geomech.scenes' has no attribute {name!r}")
    kind = getattr(
        import_module(f"geomech.scenes.terradynamics.{_MODULES[name]}"), name
    )
    globals()[name] = kind
    return kind


def __dir__() -> list[str]:
    return __all__
