"""geomech sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands import formats
from geomech.commands.options import PlotOption, SceneArgument, YesOption, with_workers
from geomech.commands.pipeline import Output, drawing, execute, path_message
from geomech.questions.loading import load_moving
from geomech.questions.texts import parameters


@with_workers
def sweep(
    name: SceneArgument,
    over: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=VALUES", help="parameter and its values; may be repeated"
        ),
    ],
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE.nc",
            help="write the results to .nc (NetCDF)",
        ),
    ] = None,
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """Compute displacement or speed over a grid of parameters. Speeds are those of walking robots. A repeated
    command resumes an interrupted one."""
    from geomech.io.results import write_netcdf
    from geomech.studies.sweep import Sweep, as_stored

    scene = load_moving(name)
    axes = parameters(over, scene, drawn=plot is not None)
    file = Output(
        out,
        lambda result, path: write_netcdf(path, as_stored(result)),
        formats.netcdf,
        path_message("results in"),
    )
    execute(
        Sweep(scene, axes),
        file,
        Output(plot, drawing("pictures.sweep"), drawing("pictures.check")),
        yes=yes,
    )
