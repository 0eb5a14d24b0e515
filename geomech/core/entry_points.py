"""Parts that installed packages offer to the registries (`rft.core.registry`) by entry points, loaded when first asked for."""

from __future__ import annotations

import importlib.metadata
from importlib.metadata import EntryPoint, EntryPoints

from geomech.core.errors import choose
from rft.core.refusal import Refusal, located
from rft.core.registry import Registry


def installed_entries(
    registry: Registry, entries: EntryPoints | None = None
) -> dict[str, list[EntryPoint]]:
    """Return the entry points that installed packages declare for a registry, by name, not loaded. entries: those of all
    packages, where they have been read already."""
    found: dict[str, list] = {}
    for entry in (
        importlib.metadata.entry_points() if entries is None else entries
    ).select(group=registry.group):
        found.setdefault(entry.name, []).append(entry)
    return found


def unloaded(
    registry: Registry, entries: EntryPoints | None = None
) -> tuple[dict[str, str], dict[str, str]]:
    """Return parts of installed packages that are not loaded yet, by name, with their packages: new ones, and those
    that are refused because a built-in part has their name. entries: as of `installed_entries`."""
    installed = installed_entries(registry, entries)
    packages = {
        name: " and ".join(map(_package, some)) for name, some in installed.items()
    }
    new = {name: package for name, package in packages.items() if name not in registry}
    return new, {
        name: package for name, package in packages.items() if name in registry.built_in
    }


def choose_part(registry: Registry, where: str, word: object) -> str:
    """Return word if it names a part, or one of an installed package, which is then loaded; else raise Refusal."""
    if isinstance(word, str) and word in registry:
        return word
    packages = installed_entries(registry)
    try:
        name = choose(where, word, [*registry, *packages])
    except Refusal as error:
        if isinstance(word, str):
            error.instead += " (or add one of your own by ``geomech.register``)"
        raise
    _load(registry, where, name, packages[name])
    return name


def _load(registry: Registry, where: str, name: str, entries: list[EntryPoint]) -> None:
    packages = " and ".join(map(_package, entries))
    if len(entries) > 1:
        raise Refusal(
            f"{name!r} is offered by {packages}", where=where, instead="uninstall one"
        )
    try:
        part = entries[0].load()
    except (Exception, SystemExit) as error:
        raise Refusal(
            f"{name!r} of {packages} cannot be loaded",
            where=where,
            because=f"{type(error).__name__}: {error}",
        ) from error
    with located(where), located(f"{name!r} of {packages}"):
        if not registry.admits(part):
            raise Refusal(f"{getattr(part, '__name__', part)} is not {registry.noun}")
        if getattr(part, registry.key, name) != name:
            raise Refusal(
                f"its {registry.key} is {getattr(part, registry.key)!r}",
                instead="give both one name",
            )
        registry.put(part, name)


def _package(entry: importlib.metadata.EntryPoint) -> str:
    return (
        f"the package {entry.dist.name} {entry.dist.version}"
        if entry.dist
        else f"the package of {entry.value}"
    )
