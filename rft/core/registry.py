"""Registries: parts of one family, such as force laws or gaits, by the names that users
give them.

A part is one file with one decorator, `Registry.register`. Its class has
``examples()``, a class method that returns parts by name, or parameters that all have
defaults; the tests hold every example to the laws of its family.
"""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import FunctionType
from typing import Any, TypeVar, overload

from rft.core.refusal import Refusal

Part = TypeVar("Part")
REGISTRIES: dict[str, Registry] = {}  # all there are, by group
BUILT_IN = ("geomech", "rft")  # packages whose names nobody else may give


class Registry(Mapping[str, Any]):
    """Parts of one family by name, in the order in which they were registered.

    group: of entry points with which installed packages offer parts. key: attribute
    that holds a part's name. noun: what a part is, in words, such as "a gait". admits:
    whether an object is one.
    """

    def __init__(self, group: str, key: str, noun: str, admits: Callable[[Any], bool]):
        self.group = group
        self.key = key
        self.noun = noun
        self.admits = admits
        self._parts: dict[str, Any] = {}
        REGISTRIES[group] = self

    def __repr__(self) -> str:
        return f"Registry({self.group}: {', '.join(self)})"

    def __getitem__(self, name: str) -> Any:
        return self._parts[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)

    @property
    def built_in(self) -> frozenset[str]:
        """Names of the parts that ship with the toolkit."""
        return frozenset(
            name
            for name, part in self.items()
            if home(part).partition(".")[0] in BUILT_IN
        )

    @property
    def own(self) -> list[Any]:
        """Parts from elsewhere."""
        return [self[name] for name in self if name not in self.built_in]

    @overload
    def register(self, part: Part, /, **members: Any) -> Part: ...

    @overload
    def register(
        self, part: None = None, /, **members: Any
    ) -> Callable[[Part], Part]: ...

    def register(self, part: Any = None, /, **members: Any) -> Any:
        """Add a part under its name and return it: a decorator. It replaces a part of
        the same module and name. members: attributes that a function
        is given. ValueError if it is no value, has no name, or its name is taken."""
        if part is None:
            return lambda function: self.register(function, **members)
        for name, value in members.items():
            setattr(part, name, value)
        self.put(part, getattr(part, self.key, None))
        return part

    def put(self, part: Any, name: object) -> None:
        """Add a part under a name; ValueError as `register`."""
        who = f"{self.noun} of your own, {getattr(part, '__name__', name)},"
        if isinstance(part, type):
            parameters = getattr(part, "__dataclass_params__", None)
            if parameters is None or not parameters.frozen:
                raise Refusal(
                    f"{who} must be a frozen dataclass",
                    instead="put @dataclass(frozen=True) above it",
                )
            if self.key in {f.name for f in dataclasses.fields(part)}:
                raise Refusal(
                    f"{who} has {self.key} as a field",
                    instead=f"write {self.key} = {name!r} without a type annotation",
                )
        given = self.key in getattr(part, "__dict__", {}) or name in self
        if (
            not isinstance(name, str)
            or not name.strip()
            or (isinstance(part, type) and not given)
        ):
            raise Refusal(
                f"{who} has no name", instead=f'give the class {self.key} = "..."'
            )
        registered = self._parts.get(name, part)
        if place(registered) != place(part):
            if name in self.built_in:
                raise Refusal(
                    f"{who} has the name {name!r} of a built-in part",
                    instead="give it another name",
                )
            module, other = place(registered)
            raise Refusal(
                f"{who} has the name {name!r} of the {other} in {module}",
                instead="rename one of them",
            )
        self._parts[name] = part

    def restore(self, parts: Mapping[str, Any]) -> None:
        """Hold these parts and no others."""
        accepted = dict(parts)
        self._parts.clear()
        self._parts.update(accepted)

    def examples(self) -> dict[str, Any]:
        """Return parts of every class by name: those of its ``examples()``, else one
        without parameters."""
        parts: dict[str, Any] = {}
        for name, part in self.items():
            if hasattr(part, "examples"):
                parts |= part.examples()
            elif isinstance(part, type):
                parts[name] = part()
            else:
                parts[name] = part
        return parts


def classes_with(member: str) -> Callable[[Any], bool]:
    """Return whether an object is a class that has a member, as a function of it."""
    return lambda part: isinstance(part, type) and hasattr(part, member)


def subclasses(base: type) -> Callable[[Any], bool]:
    """Return whether an object is a class derived from another, as a function of it."""
    return lambda part: isinstance(part, type) and issubclass(part, base)


def functions_with(member: str, value: str | None = None) -> Callable[[Any], bool]:
    """Return whether an object is a function that has an attribute, of one value if
    that is given, as a function of it."""

    def admits(part: Any) -> bool:
        return (
            isinstance(part, FunctionType)
            and hasattr(part, member)
            and value in (None, getattr(part, member))
        )

    return admits


def load_all(package: str, path: Iterable[str]) -> None:
    """Import all modules of a package, so that what is in its files is registered."""
    for module in pkgutil.iter_modules(path):
        importlib.import_module(f"{package}.{module.name}")


def home(part: Any) -> str:
    """Return the module of a part: its ``home`` if it has one."""
    return getattr(part, "home", None) or part.__module__


def place(part: Any) -> tuple[str, str]:
    """Return the module of a part and its name there; for an object its own name."""
    return home(part), getattr(part, "__qualname__", "") or part.name
