"""geomech animate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.loading import load_scene
from geomech.commands.options import SceneArgument, YesOption
from geomech.commands.pipeline import Output, execute


def animate(
    name: SceneArgument,
    out: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="film: .gif, .mp4; strip: .png, .pdf, .svg")
    ],
    cycles: Annotated[Optional[int], typer.Option(metavar="N", help="of the gait; 3 in a film, 1 in a strip")] = None,
    yes: YesOption = False,
):
    """Draw the body moving over its own track next to its shape on the CCF map: a film, or a strip of pictures for a page."""
    from geomech.output import animate as film

    question = film.picture(load_scene(name), out, cycles)
    execute(question, Output(out, film.write, film.check_format), yes=yes, silent=True)
