"""geomech ccf."""

from __future__ import annotations

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
    refuse_without_figure,
    with_workers,
)
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_scene
from geomech.questions.texts import angles, colour_limit, components


@with_workers
def ccf(
    name: SceneArgument,
    grid: GridOption = None,
    extent: ExtentOption = None,
    plot: PlotOption = None,
    style: Annotated[
        Optional[str],
        typer.Option(
            metavar="STYLE",
            help="draw a map (colours, the default), contours or a surface",
        ),
    ] = None,
    metric: Annotated[
        bool,
        typer.Option(
            "--metric", help="draw rings of joint rates that take the same effort"
        ),
    ] = False,
    stretch: Annotated[
        bool,
        typer.Option(
            "--stretch",
            help="redraw shape space so that equal lengths take equal effort",
        ),
    ] = False,
    pair: PairOption = None,
    slice_: SliceOption = None,
    other_frame: OtherFrameOption = None,
    component: ComponentOption = None,
    clim: ClimOption = None,
    yes: YesOption = False,
):
    """Compute the CCF and its integral over the scene's gait. --plot draws both. Of three and more joints: a slice for each
    pair, or for one, with the others fixed."""
    from geomech.output import pictures
    from geomech.studies.shape_space import ccf

    refuse_without_figure(
        plot, style=style, metric=metric or None, stretch=stretch or None, component=component, clim=clim,
        **{"compare-frame": other_frame},
    )  # fmt: skip
    scene = load_scene(name, grid, extent)
    panels = components(component)
    drawn = pictures.Ccf(
        style, metric, stretch, other_frame, panels, colour_limit(clim, panels)
    )
    question = ccf(
        scene, pair, angles(scene, "--slice", slice_), other_frame, metric, stretch
    )
    execute(question, Output(plot, drawn, pictures.check), yes=yes)
