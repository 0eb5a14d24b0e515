"""Scenes: what is simulated and how finely. `load` reads one by its name or from a TOML file, `write` gives its TOML."""

from importlib import import_module
from typing import TYPE_CHECKING

from geomech.scene.model import Numerics, Scene
from geomech.scene.read import builtin_names, from_tables, in_medium, inputs, intruder_names, load, parse, walker_names
from geomech.scene.write import tables, toml

if TYPE_CHECKING:
    from geomech.scene.intruder import IntruderScene
    from geomech.scene.intruding import Intruding
    from geomech.scene.solid import MeshScene
    from geomech.scene.walker import WalkerScene

__all__ = [
    "IntruderScene", "Intruding", "MeshScene", "Numerics", "Scene", "WalkerScene", "builtin_names", "from_tables", "in_medium",
    "inputs", "intruder_names", "load", "parse", "tables", "toml", "walker_names",
]  # fmt: skip

_OTHER = {"IntruderScene": "intruder", "Intruding": "intruding", "MeshScene": "solid", "WalkerScene": "walker"}


def __getattr__(name: str) -> type:
    """Return a class of scenes without a gait; its mechanics takes as long to load as that of all others, and is loaded
    here."""
    if name not in _OTHER:
        raise AttributeError(f"module 'geomech.scene' has no attribute {name!r}")
    globals()[name] = kind = getattr(import_module(f"geomech.scene.{_OTHER[name]}"), name)
    return kind
