"""The scenes and media that ship with the toolkit: a list of them, and the TOML of each."""

from __future__ import annotations

from collections.abc import Iterator

import rft
from geomech.core.errors import choose
from geomech.core.summary import wrapped
from geomech.scenes import builtin_names, intruder_names, walker_names
from geomech.scenes.read import builtin_text
from geomech.scenes.write import medium_toml, vertical_toml
from rft.terradynamics.plates import VERTICAL


def lines(name: str | None) -> Iterator[str]:
    """Yield the TOML of a scene or medium; the list of all where no name is given."""
    return listing() if name is None else iter([toml_of(name)])


def listing() -> Iterator[str]:
    """Yield each scene and medium with what it is, in lines that fit a screen."""
    for title, names in (
        ("", builtin_names()),
        ("intruder scenes, for 'geomech intrude'", intruder_names()),
        ("scenes of walking robots, for 'geomech walk'", walker_names()),
    ):
        if title:
            yield f"\n{title}"
        for name in names:
            yield from _entry(name, builtin_text(name).splitlines()[0].lstrip("# "))
    for title, media in (
        ("media for [medium] name = ...", rft.CATALOGUE),
        ("media of intruder and walker scenes, and for 'geomech stress'", VERTICAL),
    ):
        yield f"\n{title}"
        for name, entry in media.items():
            yield from _entry(name, entry.source)


def _entry(name: str, about: str) -> list[str]:
    return wrapped([f"{name:24} {about}"], indent=25)


def toml_of(name: str) -> str:
    """Return the TOML of a scene or medium, without its last line's end."""
    known = [
        *builtin_names(),
        *intruder_names(),
        *walker_names(),
        *rft.CATALOGUE,
        *VERTICAL,
    ]
    name = choose("--show", name, known)
    if name in rft.CATALOGUE:
        text = medium_toml(name, rft.CATALOGUE[name])
    elif name in VERTICAL:
        text = vertical_toml(name, VERTICAL[name])
    else:
        text = builtin_text(name)
    return text.removesuffix("\n")
