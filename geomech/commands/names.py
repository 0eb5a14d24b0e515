"""Names that a shell completes. What completes takes no arguments: typer passes what is typed so far to one that has any."""

from __future__ import annotations

from pathlib import Path


def _builtin_names(folder: str = "") -> list[str]:
    """Return the names of the built-in scenes in a folder, without reading any."""
    return sorted(p.stem for p in (Path(__file__).parents[1] / "scene" / "builtin" / folder).glob("*.toml"))


def scene_names() -> list[str]:
    """Return the names of the built-in scenes with a gait."""
    return _builtin_names()


def intruder_names() -> list[str]:
    """Return the names of the built-in intruder scenes."""
    return _builtin_names("intruders")


def walker_names() -> list[str]:
    """Return the names of the built-in scenes of walking robots."""
    return _builtin_names("walkers")


def medium_names() -> list[str]:
    """Return the names of the media of intruder scenes."""
    from geomech.scene.stress import VERTICAL

    return [*VERTICAL]


def printable_names() -> list[str]:
    """Return the names of all that 'geomech scenes --show' prints."""
    from geomech.systems.swimmer import MEDIA

    return [*scene_names(), *intruder_names(), *walker_names(), *MEDIA, *medium_names()]


def section_names() -> list[str]:
    """Return the names of the sections of scene files."""
    from geomech.scene.keys import names

    return names()
