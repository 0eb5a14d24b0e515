"""geomech sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech.commands import formats
from geomech.commands.asked import loaded_moving
from geomech.commands.options import PlotOption, SceneArgument, YesOption, parameters, with_workers
from geomech.commands.pipeline import Output, behind, drawing, execute


@with_workers
def sweep(
    name: SceneArgument,
    over: Annotated[list[str], typer.Option(help="PARAM=START:STOP:COUNT or PARAM=A,B,...; as often as wanted")],
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.nc", help="NetCDF file to write")],
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """Net displacement, or speed of a robot that walks, over a grid of the scene's parameters. What is done is kept if
    interrupted, and taken up again."""
    from geomech.io.results import write_netcdf
    from geomech.study.sweep import Sweep, as_stored

    scene = loaded_moving(name)
    axes = parameters(over, scene, 2 if plot else None)
    file = Output(out, lambda result, path: write_netcdf(path, as_stored(result)), formats.netcdf, behind("results in"))
    execute(Sweep(scene, axes), file, Output(plot, drawing("pictures.sweep"), drawing("pictures.check")), yes=yes)
