"""geomech stress."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.commands.options import JsonOption, PlotOption
from geomech.commands.pipeline import Output, drawing, execute
from geomech.questions.names import medium_names


def stress(
    medium: Annotated[
        str,
        typer.Argument(
            metavar="MEDIUM",
            help="name (see 'geomech scenes'), TOML or CSV of plate drags",
            autocompletion=medium_names,
        ),
    ],
    beta: Annotated[
        Optional[float],
        typer.Option(
            metavar="ANGLE", help="tilt of the plate in degrees, 0 if it lies flat"
        ),
    ] = None,
    gamma: Annotated[
        Optional[float],
        typer.Option(
            metavar="ANGLE", help="direction of motion in degrees below the horizontal"
        ),
    ] = None,
    as_json: JsonOption = False,
    plot: PlotOption = None,
):
    """Compute the stress of grains on a plate per unit depth. In N/cm^3, backwards (alpha_x) and upwards (alpha_z), as
    in Fig. 7."""
    from geomech.studies.stress import Stress

    figure = Output(plot, drawing("pictures.stress"), drawing("pictures.check"))
    execute(Stress(medium, beta, gamma, plot is not None), figure, as_json=as_json)
