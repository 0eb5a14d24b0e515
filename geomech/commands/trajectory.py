"""geomech trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import SceneArgument, YesOption
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_scene


def trajectory(
    name: SceneArgument,
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="write a table (.csv), film (.gif, .mp4) or strip (.png)",
        ),
    ] = None,
    cycles: Annotated[
        Optional[int],
        typer.Option(
            metavar="N", help="cycles of the gait, 3 in a film and else 1 if left out"
        ),
    ] = None,
    yes: YesOption = False,
):
    """Follow the body through its gait: table, film or strip. A table has pose, joint angles and ends of all links at every
    phase; a film or a strip of pictures for a page shows the body on its track beside its shape on the CCF."""
    from geomech.output import trajectories

    question = trajectories.question(load_scene(name), out, cycles)
    execute(
        question,
        Output(
            out, trajectories.write, trajectories.check_format, trajectories.message
        ),
        yes=yes,
    )
