"""geomech connection."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import (
    ClimOption,
    ComponentOption,
    ExtentOption,
    GridOption,
    OtherFrameOption,
    PairOption,
    PlotOption,
    SceneArgument,
    SliceOption,
    YesOption,
    with_workers,
)
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_scene
from geomech.questions.texts import angles, colour_limit, components


@with_workers
def connection(
    name: SceneArgument,
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="write the connection to .nc (NetCDF) or .mat",
        ),
    ] = None,
    grid: GridOption = None,
    extent: ExtentOption = None,
    plot: PlotOption = None,
    sign: Annotated[
        Optional[str],
        typer.Option(
            metavar="+|-", help="sign of A in a .mat file: + (the default) or -"
        ),
    ] = None,
    order: Annotated[
        Optional[str],
        typer.Option(
            metavar="ORDER",
            help="order of a .mat file: ndgrid (the default) or meshgrid",
        ),
    ] = None,
    layout: Annotated[
        Optional[str],
        typer.Option(
            metavar="LAYOUT",
            help="layout of a .mat file: arrays (the default) or struct, sysplotter's s",
        ),
    ] = None,
    style: Annotated[
        Optional[str],
        typer.Option(
            metavar="STYLE", help="draw arrows (quiver, the default) or streamlines"
        ),
    ] = None,
    pair: PairOption = None,
    slice_: SliceOption = None,
    other_frame: OtherFrameOption = None,
    component: ComponentOption = None,
    clim: ClimOption = None,
    yes: YesOption = False,
):
    """Compute the local connection on a grid. A NetCDF file has the fit residual and the CCF, too; a .mat file has A
    and the metric, in a layout of sysplotter's."""
    from geomech.output import parts, pictures
    from geomech.studies.shape_space import connection

    file = parts.Connection(out, sign, order, layout)
    panels = components(component)
    drawn = pictures.Connection(
        style, plot, pair, slice_, other_frame, panels, colour_limit(clim, panels)
    )
    scene = load_scene(name, grid, extent)
    held = angles(scene, "--slice", slice_)
    question = connection(
        scene, file.format, layout, plot is not None, pair, held, other_frame
    )
    execute(question, Output(out, file), Output(plot, drawn, pictures.check), yes=yes)
