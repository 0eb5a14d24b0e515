"""A function velocity(alpha, alphadot), or positions(alpha), as a class that a scene may name."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any

from geomech.geometry.traits import NOTHING
from geomech.systems.base import SYSTEMS
from rft.bodies import BODIES
from rft.bodies.base import Length
from rft.bodies.positions import PosedLinks
from rft.core.registry import REGISTRIES


def class_from_function(function: Callable) -> type:
    """Return a class from a function that has an attribute ``joints``: of bodies if it has ``lengths`` of links, whose poses
    it then returns for a shape alpha, else of systems, whose velocity it returns for alpha and alphadot. Further parameters
    are fields of the class."""
    return (
        _body_class(function)
        if hasattr(function, "lengths")
        else _system_class(function)
    )


def _system_class(function: Callable) -> type:
    _, _, *more = inspect.signature(function, eval_str=True).parameters.values()

    def velocity(self, alpha, alphadot):
        return function(alpha, alphadot, **_values(self, more))

    members = {
        "length": getattr(function, "length", 1.0),
        "traits": getattr(function, "traits", NOTHING),
        "velocity": velocity,
        "__reduce__": lambda self: (
            _rebuild,
            (SYSTEMS.group, self.kind, _values(self, more)),
        ),
    }
    return _built(function, _fields(more), members)


def _body_class(function: Callable) -> type:
    _, *more = inspect.signature(function, eval_str=True).parameters.values()
    of_bodies = [
        ("length", Length, dataclasses.field(default=1.0)),
        ("frame", str, dataclasses.field(default="mean")),
    ]
    fields = [
        *_fields(more),
        *(field for field in of_bodies if field[0] not in {p.name for p in more}),
    ]

    def positions(self, alpha):
        return function(alpha, **_values(self, more))

    members = {
        "lengths": tuple(function.lengths),
        "positions": positions,
        "__reduce__": lambda self: (
            _rebuild,
            (
                BODIES.group,
                self.kind,
                {name: getattr(self, name) for name, *_ in fields},
            ),
        ),
    }
    return _built(function, fields, members, PosedLinks)


def _fields(parameters: list[inspect.Parameter]) -> list[tuple]:
    """Return fields of a dataclass from parameters, with their annotations, else the types of their defaults."""
    unset = inspect.Parameter.empty
    return [
        (p.name, type(p.default) if p.annotation is unset else p.annotation)
        + (() if p.default is unset else (dataclasses.field(default=p.default),))
        for p in parameters
    ]


def _values(part: Any, parameters: list[inspect.Parameter]) -> dict[str, Any]:
    return {p.name: getattr(part, p.name) for p in parameters}


def _built(
    function: Callable, fields: list[tuple], members: dict[str, Any], *bases: type
) -> type:
    kind = getattr(function, "kind", function.__name__.replace("_", "-"))
    members |= {"kind": kind, "joints": function.joints, "__doc__": function.__doc__}
    built = dataclasses.make_dataclass(
        function.__name__, fields, bases=bases, namespace=members, frozen=True
    )
    built.__module__, built.__qualname__ = function.__module__, function.__qualname__
    return built


def _rebuild(group: str, kind: str, values: dict[str, Any]) -> Any:
    """Return a part that was sent to another process, in which its function is registered, too."""
    return REGISTRIES[group][kind](**values)
