"""Registries: parts of scenes, tiers, pictures and file formats by the names that users give them.

A part is one file with one decorator, `Registry.register`. Its class has ``examples()``, a class method that returns parts by
name, or parameters that all have defaults; the tests hold every example to the laws of its family.
"""

from __future__ import annotations

import dataclasses
import importlib
import importlib.metadata
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import FunctionType
from typing import Any, TypeVar, overload

from geomech.core.errors import SceneError, choose

Part = TypeVar("Part")
REGISTRIES: dict[str, Registry] = {}  # all there are, by group
BUILT_IN = ("geomech", "rft")  # packages whose names nobody else may give


class Registry(Mapping[str, Any]):
    """Parts of one family by name, in the order in which they were registered.

    group: of entry points with which installed packages offer parts. key: attribute that holds a part's name. told: what a
    part is, in words, such as "a gait". admits: whether an object is one. parts: a dict to keep them in, which may have
    some.
    """

    def __init__(
        self, group: str, key: str, told: str, admits: Callable[[Any], bool], parts: dict[str, Any] | None = None
    ):
        self.group, self.key, self.told, self.admits = group, key, told, admits
        self._parts = {} if parts is None else parts
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
        return frozenset(name for name, part in self.items() if home(part).partition(".")[0] in BUILT_IN)

    @property
    def own(self) -> list[Any]:
        """Parts from elsewhere."""
        return [self[name] for name in self if name not in self.built_in]

    @overload
    def register(self, part: Part, /) -> Part: ...

    @overload
    def register(self, **members: Any) -> Callable[[Part], Part]: ...

    def register(self, part: Any = None, /, **members: Any) -> Any:
        """Add a part under its name and return it: a decorator. Of the same module and name it takes the place of the one
        before. members: attributes that a function is given. ValueError if it is no value, has no name, or its name is
        taken."""
        if part is None:
            return lambda function: self.register(function, **members)
        for name, value in members.items():
            setattr(part, name, value)
        self.put(part, getattr(part, self.key, None))
        return part

    def put(self, part: Any, name: object) -> None:
        """Add a part under a name; ValueError as `register`."""
        who = f"{self.told} of one's own, {getattr(part, '__name__', name)},"
        if isinstance(part, type):
            if not dataclasses.is_dataclass(part) or not part.__dataclass_params__.frozen:
                raise ValueError(f"{who} must be a value: put @dataclass(frozen=True) above it")
            if self.key in {f.name for f in dataclasses.fields(part)}:
                raise ValueError(f"{who} has {self.key} as a parameter: write {self.key} = {name!r} without a type")
        given = self.key in getattr(part, "__dict__", {}) or name in self
        if not isinstance(name, str) or not name.strip() or (isinstance(part, type) and not given):
            raise ValueError(f'{who} has no name: give the class {self.key} = "..."')
        there = self._parts.get(name, part)
        if place(there) != place(part):
            if name in self.built_in:
                raise ValueError(f"{who} is named {name!r}, as one that is built in: give it another name")
            raise ValueError(f"{who} is named {name!r}, as the {place(there)[1]} of {place(there)[0]}: rename one")
        self._parts[name] = part

    def restore(self, parts: Mapping[str, Any]) -> None:
        """Hold these parts and no others."""
        kept = dict(parts)
        self._parts.clear()
        self._parts.update(kept)

    def examples(self) -> dict[str, Any]:
        """Return parts of every class by name: those of its ``examples()``, else one without parameters."""
        found = {}
        for name, part in self.items():
            own = getattr(part, "examples", None)
            found |= own() if own else {name: part() if isinstance(part, type) else part}
        return found

    def offered(self) -> dict[str, list[importlib.metadata.EntryPoint]]:
        """Return what installed packages offer, by name, not loaded."""
        found: dict[str, list] = {}
        for entry in importlib.metadata.entry_points(group=self.group):
            found.setdefault(entry.name, []).append(entry)
        return found

    def unloaded(self) -> tuple[dict[str, str], dict[str, str]]:
        """Return names that installed packages offer and nobody has asked for yet, with their packages: new ones, and those
        that are refused because one of that name is built in."""
        packages = {name: " and ".join(map(_package, entries)) for name, entries in self.offered().items()}
        new = {name: package for name, package in packages.items() if name not in self}
        return new, {name: package for name, package in packages.items() if name in self.built_in}

    def choose(self, where: str, word: object) -> str:
        """Return word if it names a part, or one that an installed package offers, which is then loaded; else SceneError."""
        if isinstance(word, str) and word in self:
            return word
        packages = self.offered()
        try:
            name = choose(where, word, [*self, *packages])
        except SceneError as error:
            own = " (or add --plugin FILE.py, a file that has it)" if isinstance(word, str) else ""
            raise SceneError(f"{error}{own}") from None
        self._load(where, name, packages[name])
        return name

    def _load(self, where: str, name: str, entries: list[importlib.metadata.EntryPoint]) -> None:
        who = " and ".join(map(_package, entries))
        if len(entries) > 1:
            raise SceneError(f"{where}: {name!r} is offered by {who}: uninstall one")
        try:
            part = entries[0].load()
        except (Exception, SystemExit) as error:
            raise SceneError(f"{where}: {name!r} of {who} cannot be loaded: {type(error).__name__}: {error}") from error
        try:
            if not self.admits(part):
                raise ValueError(f"{getattr(part, '__name__', part)} is not {self.told}")
            if getattr(part, self.key, name) != name:
                raise ValueError(f"its {self.key} is {getattr(part, self.key)!r}: give both one name")
            self.put(part, name)
        except ValueError as error:
            raise SceneError(f"{where}: {name!r} of {who}: {error}") from None


def classes_with(member: str) -> Callable[[Any], bool]:
    """Return whether an object is a class that has a member, as a function of it."""
    return lambda part: isinstance(part, type) and hasattr(part, member)


def subclasses(base: type) -> Callable[[Any], bool]:
    """Return whether an object is a class derived from another, as a function of it."""
    return lambda part: isinstance(part, type) and issubclass(part, base)


def functions_with(member: str, value: str | None = None) -> Callable[[Any], bool]:
    """Return whether an object is a function that has an attribute, of one value if that is given, as a function of it."""

    def admits(part: Any) -> bool:
        return isinstance(part, FunctionType) and hasattr(part, member) and value in (None, getattr(part, member))

    return admits


def load_all(package: str, path: Iterable[str]) -> None:
    """Import all modules of a package, so that what is in its files is registered."""
    for module in pkgutil.iter_modules(path):
        importlib.import_module(f"{package}.{module.name}")


def home(part: Any) -> str:
    """Return the module that a part is of, an object as it says (``home``)."""
    return getattr(part, "home", None) or part.__module__


def place(part: Any) -> tuple[str, str]:
    """Return the module and the name of a part in it; of an object its own name."""
    return home(part), getattr(part, "__qualname__", "") or part.name


def _package(entry: importlib.metadata.EntryPoint) -> str:
    return f"the package {entry.dist.name} {entry.dist.version}" if entry.dist else f"the package of {entry.value}"
