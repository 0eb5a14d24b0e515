"""geomech optimize."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands import formats
from geomech.commands.options import (
    ClimOption,
    JsonOption,
    PlotOption,
    SceneArgument,
    YesOption,
    refuse_without_figure,
    with_workers,
)
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_scene
from geomech.questions.texts import colour_limit, joint_limits


@with_workers
def optimize(
    name: SceneArgument,
    objective: Annotated[
        str,
        typer.Option(
            "--objective",
            metavar="NAME",
            help="maximise displacement, efficiency, turning or speed",
        ),
    ],
    direction: Annotated[
        Optional[str],
        typer.Option(
            metavar="x|y", help="take the displacement along x or y of the body"
        ),
    ] = None,
    harmonics: Annotated[
        Optional[int],
        typer.Option(
            metavar="N", help="harmonics of the Fourier series, 5 if left out"
        ),
    ] = None,
    limits: Annotated[
        Optional[str],
        typer.Option(
            metavar="ANGLES",
            help="joint limits, as 2.5, 120deg, -0.5:2 or 1,2 for each",
        ),
    ] = None,
    starts: Annotated[
        Optional[int],
        typer.Option(
            metavar="N", help="number of starts, 9 in dry media and else 1 if left out"
        ),
    ] = None,
    rate: Annotated[
        Optional[float],
        typer.Option(metavar="RATE", help="largest joint rate in rad/s, for speed"),
    ] = None,
    power: Annotated[
        Optional[float],
        typer.Option(
            metavar="POWER", help="largest mean power in drag x BL/s, for speed"
        ),
    ] = None,
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE.toml",
            help="write the scene with the best gait to .toml",
        ),
    ] = None,
    plot: PlotOption = None,
    stretch: Annotated[
        bool,
        typer.Option(
            "--stretch", help="draw it also where equal lengths take equal effort"
        ),
    ] = False,
    clim: ClimOption = None,
    as_json: JsonOption = False,
    yes: YesOption = False,
):
    """Find the best gait for an objective. Its value has an error; -o writes it as a scene, --plot draws its loop on
    the CCF."""
    from geomech.optimisation.question import Optimize
    from geomech.output import parts, pictures

    refuse_without_figure(plot, clim=clim)
    scene = load_scene(name)
    drawn = pictures.Optimum(stretch, plot, colour_limit(clim))
    file, figure = (
        Output(out, parts.write_best, formats.toml),
        Output(plot, drawn, pictures.check),
    )
    question = Optimize(
        scene,
        objective,
        direction,
        harmonics,
        joint_limits(limits, scene),
        starts,
        rate,
        power,
        drawn=plot is not None,
        stretch=stretch,
    )
    execute(question, file, figure, as_json=as_json, yes=yes)
