"""geomech displacement."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.commands.loading import load_scene
from geomech.commands.options import (
    AllOption,
    ExtentOption,
    GridOption,
    JsonOption,
    PlotOption,
    SceneArgument,
    YesOption,
    amplitude_kind,
    spread,
    with_workers,
)
from geomech.commands.pipeline import Output, drawing, execute


@with_workers
def displacement(
    name: SceneArgument,
    amplitudes: Annotated[str, typer.Option(help="0.5,1.0,1.75 or START:STOP:COUNT; angles also as 30deg")],
    tiers: Annotated[Optional[str], typer.Option(help="any of area,adapted,path,harmonic,direct")] = None,
    grid: GridOption = None,
    extent: ExtentOption = None,
    tol: Annotated[Optional[float], typer.Option(help="error in body lengths that the cheapest tier must meet")] = None,
    effort: Annotated[bool, typer.Option("--effort", help="add path length, work and cost of transport")] = False,
    everything: AllOption = False,
    as_json: JsonOption = False,
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """Compute the displacement of a gait by each tier. x, y and theta after a cycle from phase t = 0, each with an
    estimated error."""
    from geomech.studies.displacement import displacement

    scene = load_scene(name, grid, extent)
    values = spread("--amplitudes", amplitudes, amplitude_kind(scene))
    question = displacement(scene, values, tiers, tol, effort)
    figure = Output(plot, drawing("pictures.displacement"), drawing("pictures.check"))
    execute(question, figure, as_json=as_json, yes=yes, everything=everything)
