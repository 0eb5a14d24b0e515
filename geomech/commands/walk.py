"""geomech walk."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import JsonOption, WalkerArgument, YesOption, folder
from geomech.commands.pipeline import Output, drawing, execute
from geomech.questions.loading import load_walker
from rft.refusal import Refusal


def walk(
    name: WalkerArgument,
    engine: Annotated[
        Optional[str],
        typer.Option(
            metavar="ENGINE", help="planar or mujoco, in place of the scene's"
        ),
    ] = None,
    as_json: JsonOption = False,
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="folder to write the results to",
            parser=folder,
        ),
    ] = None,
    animate: Annotated[
        Optional[Path],
        typer.Option(
            metavar="FILE",
            help="draw a film (.gif, .mp4) or a strip (.png, .pdf, .svg)",
        ),
    ] = None,
    follow: Annotated[
        bool,
        typer.Option("--follow", help="the camera of the film goes with the robot"),
    ] = False,
    yes: YesOption = False,
):
    """Compute how a robot walks on grains. The mean speed has an error; the motion begins at rest. SI units, pitch in rad, nose
    down."""
    from geomech.studies.walking import Walking

    if follow and (animate is None or animate.suffix.lower() not in (".gif", ".mp4")):
        raise Refusal(
            "--follow is for a film", instead="say --animate FILE.gif or FILE.mp4, too"
        )
    question = Walking(load_walker(name), engine, limited=not yes)
    results = Output(out, drawing("walks.write"), folder=True)
    picture = Output(
        animate, drawing("walks.film", follow=follow), drawing("animate.check_format")
    )
    execute(question, results, picture, as_json=as_json, yes=yes)
