"""geomech scenes."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.commands.names import shown_names
from geomech.core.errors import choose


def scenes(
    show: Annotated[
        Optional[str],
        typer.Option(metavar="NAME", help="print this scene's or medium's TOML", autocompletion=shown_names),
    ] = None,
):
    """The scenes that ship with the toolkit, and the named media."""
    import rft
    from geomech.scene import builtin_names, intruder_names, walker_names
    from geomech.scene.read import builtin_text
    from geomech.scene.write import medium_toml, vertical_toml
    from rft.plates import VERTICAL

    if show is not None:
        shown = [*builtin_names(), *intruder_names(), *walker_names(), *rft.CATALOGUE, *VERTICAL]
        name = choose("--show", show, shown)
        if name in rft.CATALOGUE:
            print(medium_toml(name, rft.CATALOGUE[name]), end="")
        elif name in VERTICAL:
            print(vertical_toml(name, VERTICAL[name]), end="")
        else:
            print(builtin_text(name), end="")
        return
    for title, names in (
        ("", builtin_names()),
        ("\nintruder scenes, for 'geomech intrude'", intruder_names()),
        ("\nscenes of walking robots, for 'geomech walk'", walker_names()),
    ):
        if title:
            print(title)
        for scene_name in names:
            print(f"{scene_name:24} {builtin_text(scene_name).splitlines()[0].lstrip('# ')}")
    print("\nmedia for [medium] name = ...")
    for medium_name, entry in rft.CATALOGUE.items():
        print(f"{medium_name:24} {entry.source}")
    print("\nmedia of intruder and walker scenes, and for 'geomech stress'")
    for medium_name, entry in VERTICAL.items():
        print(f"{medium_name:24} {entry.source}")
