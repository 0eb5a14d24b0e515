"""geomech displacement."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.commands.options import (
    AllOption,
    ComponentOption,
    DataOption,
    ExtentOption,
    GridOption,
    JsonOption,
    MediumOption,
    PlotOption,
    SceneArgument,
    YesOption,
    refuse_without_figure,
    with_workers,
)
from geomech.commands.pipeline import Output, drawing, execute
from geomech.questions.loading import load_scene
from geomech.questions.texts import (
    CURVES,
    amplitude_kind,
    components,
    measurements,
    spread,
)


@with_workers
def displacement(
    name: SceneArgument,
    amplitudes: Annotated[
        str,
        typer.Option(
            metavar="LIST", help="amplitudes, as 0.5,1,30deg or START:STOP:COUNT"
        ),
    ],
    tiers: Annotated[
        Optional[str],
        typer.Option(
            metavar="LIST", help="tiers, of area,adapted,path,harmonic,direct"
        ),
    ] = None,
    grid: GridOption = None,
    extent: ExtentOption = None,
    tol: Annotated[
        Optional[float],
        typer.Option(
            metavar="E", help="use the cheapest tier with an error of at most E BL"
        ),
    ] = None,
    effort: Annotated[
        bool,
        typer.Option("--effort", help="add path length, work and cost of transport"),
    ] = False,
    everything: AllOption = False,
    as_json: JsonOption = False,
    plot: PlotOption = None,
    component: ComponentOption = None,
    data: DataOption = None,
    medium: MediumOption = None,
    yes: YesOption = False,
):
    """Compute the displacement of a gait by each tier. x, y and theta after a cycle from phase t = 0, each with an
    estimated error."""
    from geomech.studies.displacement import displacement

    refuse_without_figure(plot, component=component, data=data)
    scene = load_scene(name, grid, extent, medium)
    values = spread("--amplitudes", amplitudes, amplitude_kind(scene))
    panels = components(component, CURVES)
    options = {"components": panels, "data": measurements(data, scene, panels)}
    question = displacement(scene, values, tiers, tol, effort)
    figure = Output(
        plot, drawing("pictures.displacement", **options), drawing("pictures.check")
    )
    execute(question, figure, as_json=as_json, yes=yes, everything=everything)
