"""geomech fit-gait."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands import formats
from geomech.commands.options import JsonOption, PlotOption, an_angle, column_names
from geomech.commands.pipeline import Output, drawing, execute


def fit_gait(
    log: Annotated[
        Path, typer.Argument(metavar="LOG.csv", help="table of t, joint angles, x, y, heading over many cycles")
    ],
    out: Annotated[
        Optional[Path], typer.Option("-o", "--output", metavar="FILE.nc", help="write the connection to .nc (NetCDF)")
    ] = None,
    scene: Annotated[
        Optional[Path],
        typer.Option("--scene", metavar="FILE.toml", help="write a scene of the mean gait, which takes FILE.nc"),
    ] = None,
    plot: PlotOption = None,
    columns: Annotated[
        Optional[str], typer.Option(metavar="LIST", help="names of the columns T,A1,A2,...,X,Y,HEADING, in order")
    ] = None,
    degrees: Annotated[bool, typer.Option("--degrees", help="read joint angles and heading in degrees")] = False,
    level: Annotated[
        float, typer.Option(metavar="SHARE", help="share of cases in which intervals cover the truth")
    ] = 0.95,
    harmonics: Annotated[
        Optional[int], typer.Option(metavar="N", help="harmonics of A in the phase, cross-validated if left out")
    ] = None,
    limits: Annotated[
        Optional[float],
        typer.Option(
            metavar="ANGLE",
            help="distance from the mean gait that the field covers",
            parser=an_angle,
        ),
    ] = None,
    body_length: Annotated[float, typer.Option(metavar="M", help="length of the body in m, if x and y are in m")] = 1.0,
    as_json: JsonOption = False,
):
    """Fit the connection near a measured gait. The regression gives phase, mean gait and A with intervals; the
    predicted displacement is compared with the log's."""
    from geomech.measured.results import Fit
    from geomech.output import parts

    question = Fit(log, column_names(columns), degrees, level, harmonics, limits, body_length)
    field = Output(out, parts.write_tube, formats.netcdf)
    figure = Output(plot, drawing("pictures.measured"), drawing("pictures.check"))
    execute(question, field, Output(scene, *parts.mean_gait(out)), figure, as_json=as_json)
