"""geomech intrude."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands import formats
from geomech.commands.options import IntruderArgument, JsonOption, PlotOption
from geomech.commands.pipeline import Output, drawing, execute
from geomech.questions.loading import load_intruder


def intrude(
    name: IntruderArgument,
    as_json: JsonOption = False,
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o", "--output", metavar="FILE.csv", help="write the table to .csv"
        ),
    ] = None,
    plot: PlotOption = None,
):
    """Compute force and moment of grains on a moving body. The body is an outline in the vertical plane or a
    mesh. SI units."""
    from geomech.io.results import write_csv
    from geomech.studies.intrusion import Intrusion

    table = Output(out, lambda result, path: write_csv(path, result), formats.csv)
    figure = Output(plot, drawing("pictures.intrusion"), drawing("pictures.check"))
    execute(Intrusion(load_intruder(name)), table, figure, as_json=as_json, yes=True)
