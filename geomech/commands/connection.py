"""geomech connection."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech.commands.options import ExtentOption, GridOption, PlotOption, SceneArgument, YesOption, check_netcdf, field


def connection(
    name: SceneArgument,
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.nc", help="NetCDF file to write")],
    grid: GridOption = None,
    extent: ExtentOption = None,
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """The local connection on a grid, with its fit residual and CCF, as NetCDF."""
    from geomech.output import plots
    from geomech.output.netcdf import save_connection

    check_netcdf(out)
    study = field(name, grid, extent, out, plot, plot is not None, yes)
    save_connection(out, study)
    if plot:
        plots.save(plots.connection_figure(study.fitted, study.scene.system.unit), plot)
