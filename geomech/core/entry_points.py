"""Parts that installed packages offer to the registries (`rft.registry`) by entry points, loaded when first asked for."""

from __future__ import annotations

import importlib.metadata
from importlib.metadata import EntryPoint

from geomech.core.errors import SceneError, choose
from rft.registry import Registry


def offered(registry: Registry) -> dict[str, list[EntryPoint]]:
    """Return what installed packages offer, by name, not loaded."""
    found: dict[str, list] = {}
    for entry in importlib.metadata.entry_points(group=registry.group):
        found.setdefault(entry.name, []).append(entry)
    return found


def unloaded(registry: Registry) -> tuple[dict[str, str], dict[str, str]]:
    """Return names that installed packages offer and nobody has asked for yet, with their packages: new ones, and those
    that are refused because one of that name is built in."""
    packages = {name: " and ".join(map(_package, entries)) for name, entries in offered(registry).items()}
    new = {name: package for name, package in packages.items() if name not in registry}
    return new, {name: package for name, package in packages.items() if name in registry.built_in}


def choose_part(registry: Registry, where: str, word: object) -> str:
    """Return word if it names a part, or one that an installed package offers, which is then loaded; else SceneError."""
    if isinstance(word, str) and word in registry:
        return word
    packages = offered(registry)
    try:
        name = choose(where, word, [*registry, *packages])
    except SceneError as error:
        own = " (or add --plugin FILE.py, a file that has it)" if isinstance(word, str) else ""
        raise SceneError(f"{error}{own}") from None
    _load(registry, where, name, packages[name])
    return name


def _load(registry: Registry, where: str, name: str, entries: list[EntryPoint]) -> None:
    who = " and ".join(map(_package, entries))
    if len(entries) > 1:
        raise SceneError(f"{where}: {name!r} is offered by {who}: uninstall one")
    try:
        part = entries[0].load()
    except (Exception, SystemExit) as error:
        raise SceneError(f"{where}: {name!r} of {who} cannot be loaded: {type(error).__name__}: {error}") from error
    try:
        if not registry.admits(part):
            raise ValueError(f"{getattr(part, '__name__', part)} is not {registry.told}")
        if getattr(part, registry.key, name) != name:
            raise ValueError(f"its {registry.key} is {getattr(part, registry.key)!r}: give both one name")
        registry.put(part, name)
    except ValueError as error:
        raise SceneError(f"{where}: {name!r} of {who}: {error}") from None


def _package(entry: importlib.metadata.EntryPoint) -> str:
    return f"the package {entry.dist.name} {entry.dist.version}" if entry.dist else f"the package of {entry.value}"
