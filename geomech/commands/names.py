"""Names that a shell completes. What completes takes no arguments: typer passes what is typed so far to one that has any."""

from __future__ import annotations

from pathlib import Path


def _found(folder: str = "") -> list[str]:
    """Names of the built-in scenes there, without reading any."""
    return sorted(p.stem for p in (Path(__file__).parents[1] / "scene" / "builtin" / folder).glob("*.toml"))


def scene_names() -> list[str]:
    """Of the built-in scenes with a gait."""
    return _found()


def intruder_names() -> list[str]:
    """Of the built-in intruder scenes."""
    return _found("intruders")


def walker_names() -> list[str]:
    """Of the built-in scenes of walking robots."""
    return _found("walkers")


def medium_names() -> list[str]:
    """Of the media of intruder scenes."""
    from geomech.scene.stress import VERTICAL

    return [*VERTICAL]


def shown_names() -> list[str]:
    """Of all that 'geomech scenes --show' prints."""
    from geomech.systems.swimmer import MEDIA

    return [*scene_names(), *intruder_names(), *walker_names(), *MEDIA, *medium_names()]


def section_names() -> list[str]:
    """Of the tables of scene files."""
    from geomech.scene.keys import names

    return names()
