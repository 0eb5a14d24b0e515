"""Parts that installed packages offer to the registries (`rft.core.registry`) by entry
points.

A part is loaded at its first use."""

from __future__ import annotations

import importlib.metadata
from importlib.metadata import EntryPoint, EntryPoints

from geomech.core.errors import choose
from rft.core.refusal import Refusal, located
from rft.core.registry import Registry


def installed_entries(
    registry: Registry, entries: EntryPoints | None = None
) -> dict[str, list[EntryPoint]]:
    """Return the entry points that installed packages declare for a registry, by name,
    not loaded. entries: those of all packages, if they have been read already."""
    group: EntryPoints
    if entries is None:
        group = importlib.metadata.entry_points(group=registry.group)
    else:
        group = entries.select(group=registry.group)
    by_name: dict[str, list[EntryPoint]] = {}
    for entry in group:
        by_name.setdefault(entry.name, []).append(entry)
    return by_name


def unloaded(
    registry: Registry, entries: EntryPoints | None = None
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the packages of parts that are not loaded yet, by the parts' names: of new
    parts, and of those that are refused because a built-in part has their name.

    entries: as in `installed_entries`."""
    new = {}
    refused = {}
    for name, found in installed_entries(registry, entries).items():
        packages = " and ".join(map(_package, found))
        if name not in registry:
            new[name] = packages
        if name in registry.built_in:
            refused[name] = packages
    return new, refused


def choose_part(registry: Registry, where: str, word: object) -> str:
    """Return word if it names a part; load the part if an installed package has it.
    Refusal for any other word."""
    if isinstance(word, str) and word in registry:
        return word
    packages = installed_entries(registry)
    try:
        name = choose(where, word, [*registry, *packages])
    except Refusal as error:
        if isinstance(word, str):
            error.instead += " (or register your own with ``geomech.register``)"
        raise
    _load(registry, where, name, packages[name])
    return name


def _load(registry: Registry, where: str, name: str, entries: list[EntryPoint]) -> None:
    """Load a part into its registry; Refusal if it is offered twice, or cannot be
    used."""
    packages = " and ".join(map(_package, entries))
    if len(entries) > 1:
        raise Refusal(
            f"{name!r} is offered by {packages}",
            where=where,
            instead=("uninstall one of them"),
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
                instead="give both the same name",
            )
        registry.put(part, name)


def _package(entry: EntryPoint) -> str:
    """Return the name and version of an entry point's package."""
    if entry.dist:
        return f"the package {entry.dist.name} {entry.dist.version}"
    return f"the package of {entry.value}"
