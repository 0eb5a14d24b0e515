"""geomech lab."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import YesOption
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_scenes
from geomech.questions.names import scene_names
from geomech.questions.texts import parameters


def lab(
    names: Annotated[
        Optional[list[str]],
        typer.Argument(
            metavar="[SCENE]...", show_default=False, autocompletion=scene_names,
            help="built-in scenes or files; a gallery of six if left out",
        ),
    ] = None,
    out: Annotated[
        Optional[Path],
        typer.Option("-o", "--output", metavar="FILE.html", help="write the page; if left out it opens in the browser"),
    ] = None,
    over: Annotated[
        Optional[list[str]],
        typer.Option(metavar="KEY=VALUES", help="vary this parameter of the first scene by a slider"),
    ] = None,
    yes: YesOption = False,
):  # fmt: skip
    """Make a page to draw loops on the CCF and watch the swimmer. It is one file, which needs no network and nothing installed:
    map, swimmer, and displacement of a cycle by three tiers with their errors."""
    from geomech.output import lab
    from geomech.studies.lab import GALLERY, Lab

    scenes = load_scenes(names or GALLERY)
    question = Lab(scenes, parameters(over or (), scenes[0]))
    with lab.opened(out) as path:
        execute(
            question, Output(path, lab.write, lab.check_format, lab.message), yes=yes
        )
