"""A function velocity(alpha, alphadot), or positions(alpha), as a class that a scene
may name."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any

from geomech.mathematics.geometry.traits import NOTHING
from geomech.mathematics.systems.base import SYSTEMS
from rft.bodies import BODIES
from rft.bodies.base import Length
from rft.bodies.positions import PosedLinks
from rft.core.registry import REGISTRIES


def class_from_function(function: Callable) -> type:
    """Return a class from a function that has an attribute ``joints``.

    With ``lengths`` of links it is a class of bodies, and the function returns the
    poses of links for a shape alpha. Else it is a class of systems, and the function
    returns the velocity for alpha and alphadot. Further parameters are fields of the
    class."""
    if hasattr(function, "lengths"):
        return _body_class(function)
    return _system_class(function)


def _system_class(function: Callable) -> type:
    """Return a class of systems from a velocity."""
    _, _, *more = inspect.signature(function, eval_str=True).parameters.values()

    def velocity(self, alpha, alphadot):
        return function(alpha, alphadot, **_values(self, more))

    def reduce(self):
        return _rebuild, (SYSTEMS.group, self.kind, _values(self, more))

    members = {
        "length": getattr(function, "length", 1.0),
        "traits": getattr(function, "traits", NOTHING),
        "velocity": velocity,
        "__reduce__": reduce,
    }
    return _built(function, _fields(more), members)


def _body_class(function: Callable) -> type:
    """Return a class of bodies from the poses of links."""
    _, *more = inspect.signature(function, eval_str=True).parameters.values()
    fields = _fields(more)
    names = [name for name, *_ in fields]
    if "length" not in names:
        fields.append(("length", Length, dataclasses.field(default=1.0)))
    if "frame" not in names:
        fields.append(("frame", str, dataclasses.field(default="mean")))

    def positions(self, alpha):
        return function(alpha, **_values(self, more))

    def reduce(self):
        values = {name: getattr(self, name) for name, *_ in fields}
        return _rebuild, (BODIES.group, self.kind, values)

    members = {
        "lengths": tuple(function.lengths),
        "positions": positions,
        "__reduce__": reduce,
    }
    return _built(function, fields, members, PosedLinks)


def _fields(parameters: list[inspect.Parameter]) -> list[tuple]:
    """Return fields of a dataclass from parameters, with their annotations, else the
    types of their defaults."""
    unset = inspect.Parameter.empty
    fields: list[tuple] = []
    for parameter in parameters:
        kind = parameter.annotation
        if kind is unset:
            kind = type(parameter.default)
        if parameter.default is unset:
            fields.append((parameter.name, kind))
        else:
            default = dataclasses.field(default=parameter.default)
            fields.append((parameter.name, kind, default))
    return fields


def _values(part: Any, parameters: list[inspect.Parameter]) -> dict[str, Any]:
    """Return the values of a part's fields with the names of parameters."""
    return {p.name: getattr(part, p.name) for p in parameters}


def _built(
    function: Callable, fields: list[tuple], members: dict[str, Any], *bases: type
) -> type:
    """Return the frozen dataclass with the name, module and docstring of the
    function."""
    kind = getattr(function, "kind", function.__name__.replace("_", "-"))
    members |= {"kind": kind, "joints": function.joints, "__doc__": function.__doc__}
    built = dataclasses.make_dataclass(
        function.__name__, fields, bases=bases, namespace=members, frozen=True
    )
    built.__module__ = function.__module__
    built.__qualname__ = function.__qualname__
    return built


def _rebuild(group: str, kind: str, values: dict[str, Any]) -> Any:
    """Return a part that was sent to another process, where its function is registered
    as well."""
    return REGISTRIES[group][kind](**values)
