"""Scenes: what is simulated and how finely. `load` reads one by its name or from a TOML file."""

from geomech.scene.model import METHODS, Numerics, Scene
from geomech.scene.read import builtin_names, from_tables, inputs, load, parse

__all__ = ["METHODS", "Numerics", "Scene", "builtin_names", "from_tables", "inputs", "load", "parse"]
