"""geomech scenes: the scenes and media that ship with the toolkit, as a list, and the TOML
of each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Optional

import typer

from geomech import terminal
from geomech.questions.names import printable_names


def scenes(
    show: Annotated[
        Optional[str],
        typer.Option(
            metavar="NAME",
            help="print the TOML of a scene or a medium",
            autocompletion=printable_names,
        ),
    ] = None,
):
    """List the built-in scenes and the named media."""
    if show is None:
        terminal.show(listing())
    else:
        terminal.show([toml_of(show)])


def listing() -> Iterator[str]:
    """Yield each scene and medium with what it is, in lines that fit a screen."""
    import rft
    from geomech.scenes import builtin_names, intruder_names, walker_names
    from geomech.scenes.read import builtin_text
    from rft.terradynamics.plates import VERTICAL

    for title, names in (
        ("", builtin_names()),
        ("intruder scenes, for 'geomech intrude'", intruder_names()),
        ("scenes of walking robots, for 'geomech walk'", walker_names()),
    ):
        if title:
            yield f"\n{title}"
        for name in names:
            yield from entry(name, builtin_text(name).splitlines()[0].lstrip("# "))
    for title, media in (
        ("media for [medium] name = ...", rft.CATALOGUE),
        ("media of intruder and walker scenes, and for 'geomech stress'", VERTICAL),
    ):
        yield f"\n{title}"
        for name, medium in media.items():
            yield from entry(name, medium.source)


def entry(name: str, about: str) -> list[str]:
    from geomech.core.summary import wrapped

    return wrapped([f"{name:24} {about}"], indent=25)


def toml_of(name: str) -> str:
    """Return the TOML of a scene or medium, without its last line's end."""
    import rft
    from geomech.core.errors import choose
    from geomech.scenes import builtin_names, intruder_names, walker_names
    from geomech.scenes.read import builtin_text
    from geomech.scenes.write import medium_toml, vertical_toml
    from rft.terradynamics.plates import VERTICAL

    own = [*builtin_names(), *intruder_names(), *walker_names()]
    name = choose("--show", name, [*own, *rft.CATALOGUE, *VERTICAL])
    if name in rft.CATALOGUE:
        text = medium_toml(name, rft.CATALOGUE[name])
    elif name in VERTICAL:
        text = vertical_toml(name, VERTICAL[name])
    else:
        text = builtin_text(name)
    return text.removesuffix("\n")
