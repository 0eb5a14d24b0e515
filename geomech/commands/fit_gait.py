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
        Path, typer.Argument(metavar="LOG.csv", help="t, joint angles, x, y, heading of many cycles of a gait")
    ],
    out: Annotated[
        Optional[Path], typer.Option("-o", "--output", metavar="FIELD.nc", help="connection to write")
    ] = None,
    scene: Annotated[
        Optional[Path],
        typer.Option("--scene", metavar="FILE.toml", help="scene of the mean gait to write, with FIELD.nc"),
    ] = None,
    plot: PlotOption = None,
    columns: Annotated[
        Optional[str], typer.Option(metavar="T,A1,A2,...,X,Y,HEADING", help="names of the columns, in this order")
    ] = None,
    degrees: Annotated[bool, typer.Option("--degrees", help="joint angles and heading are in degrees")] = False,
    level: Annotated[float, typer.Option(help="share of cases in which intervals are to cover the truth")] = 0.95,
    harmonics: Annotated[
        Optional[int], typer.Option(help="of the connection in the phase; by cross-validation if left out")
    ] = None,
    limits: Annotated[
        Optional[float],
        typer.Option(
            metavar="ANGLE",
            help="of the mean gait, in rad or as 5deg; as far as the data reach if left out",
            parser=an_angle,
        ),
    ] = None,
    body_length: Annotated[
        float, typer.Option(metavar="M", help="of the body in m, where x and y are; else they are in body lengths")
    ] = 1.0,
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
