"""Scenes: what is simulated and how finely. `load` reads one by its name or from a TOML file, `write` gives its TOML."""

from geomech.scene.intruder import IntruderScene
from geomech.scene.intruding import Intruding
from geomech.scene.model import Numerics, Scene
from geomech.scene.read import builtin_names, from_tables, in_medium, inputs, intruder_names, load, parse, walker_names
from geomech.scene.solid import MeshScene
from geomech.scene.walker import WalkerScene
from geomech.scene.write import tables, toml

__all__ = [
    "IntruderScene", "Intruding", "MeshScene", "Numerics", "Scene", "WalkerScene", "builtin_names", "from_tables", "in_medium",
    "inputs", "intruder_names", "load", "parse", "tables", "toml", "walker_names",
]  # fmt: skip
