"""A function velocity(alpha, alphadot) as a class that a scene may name."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any

from geomech.geometry.traits import NOTHING
from geomech.systems.base import SYSTEMS


def class_from_function(function: Callable) -> type:
    """Return a class of systems from a function that has an attribute ``joints``. Parameters after alpha and alphadot
    are its fields."""
    _, _, *more = inspect.signature(function, eval_str=True).parameters.values()
    unset = inspect.Parameter.empty
    fields = [
        (p.name, type(p.default) if p.annotation is unset else p.annotation)
        + (() if p.default is unset else (dataclasses.field(default=p.default),))
        for p in more
    ]

    def velocity(self, alpha, alphadot):
        return function(alpha, alphadot, **{p.name: getattr(self, p.name) for p in more})

    members = {
        "kind": getattr(function, "kind", function.__name__.replace("_", "-")),
        "joints": function.joints,
        "length": getattr(function, "length", 1.0),
        "traits": getattr(function, "traits", NOTHING),
        "velocity": velocity,
        "__reduce__": lambda self: (_rebuild, (self.kind, {p.name: getattr(self, p.name) for p in more})),
        "__doc__": function.__doc__,
    }
    built = dataclasses.make_dataclass(function.__name__, fields, namespace=members, frozen=True)
    built.__module__, built.__qualname__ = function.__module__, function.__qualname__
    return built


def _rebuild(kind: str, values: dict[str, Any]) -> Any:
    """Return a system that was sent to another process, in which its function is registered, too."""
    return SYSTEMS[kind](**values)
