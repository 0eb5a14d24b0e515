"""geomech scenes."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.errors import choose


def scenes(show: Annotated[Optional[str], typer.Option(metavar="NAME", help="print this scene's TOML")] = None):
    """The scenes that ship with the toolkit, and the named media."""
    import rft
    from geomech.scene import builtin_names, load

    if show is not None:
        print(load(choose("--show", show, builtin_names())).text, end="")
        return
    for scene_name in builtin_names():
        print(f"{scene_name:24} {load(scene_name).text.splitlines()[0].lstrip('# ')}")
    print("\nmedia for [medium] name = ...")
    for medium_name, entry in rft.CATALOGUE.items():
        print(f"{medium_name:24} {entry.source}")
