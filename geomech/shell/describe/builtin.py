"""The scenes and media that ship with the toolkit, in lines, and the TOML of each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import rft
from geomech.core.errors import choose
from geomech.core.summary import wrapped
from geomech.scenes import builtin_names, intruder_names, walker_names
from geomech.scenes.read import builtin_text
from geomech.scenes.write import medium_toml, vertical_toml
from rft.terradynamics.plates import VERTICAL


def listing() -> Iterator[str]:
    """Yield each scene and medium with its description, in lines that fit a screen."""
    yield from scene_entries(builtin_names())
    yield "\nintruder scenes, for 'geomech intrude'"
    yield from scene_entries(intruder_names())
    yield "\nscenes of walking robots, for 'geomech walk'"
    yield from scene_entries(walker_names())
    yield "\nmedia for [medium] name = ..."
    for name, medium in rft.CATALOGUE.items():
        yield from entry(name, medium.source)
    yield "\nmedia of intruder and walker scenes, and for 'geomech stress'"
    for name, medium in VERTICAL.items():
        yield from entry(name, medium.source)


def scene_entries(names: Iterable[str]) -> Iterator[str]:
    """Yield the lines of scenes, described by the first line of their files."""
    for name in names:
        first_line = builtin_text(name).splitlines()[0]
        yield from entry(name, first_line.lstrip("# "))


def entry(name: str, about: str) -> list[str]:
    return wrapped([f"{name:24} {about}"], indent=25)


def toml_of(name: str) -> str:
    """Return the TOML of a scene or medium, without its last line's end."""
    scenes = [*builtin_names(), *intruder_names(), *walker_names()]
    name = choose("--show", name, [*scenes, *rft.CATALOGUE, *VERTICAL])
    if name in rft.CATALOGUE:
        text = medium_toml(name, rft.CATALOGUE[name])
    elif name in VERTICAL:
        text = vertical_toml(name, VERTICAL[name])
    else:
        text = builtin_text(name)
    return text.removesuffix("\n")
