"""geomech ccf."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.loading import load_scene
from geomech.commands.options import (
    ClimOption,
    ComponentOption,
    ExtentOption,
    GridOption,
    OtherFrameOption,
    PairOption,
    SceneArgument,
    SliceOption,
    YesOption,
    angles,
    colour_limit,
    components,
    with_workers,
)
from geomech.commands.pipeline import Output, execute


@with_workers
def ccf(
    name: SceneArgument,
    plot: Annotated[Path, typer.Option("--plot", metavar="FILE", help="figure: .png, .pdf or .svg")],
    grid: GridOption = None,
    extent: ExtentOption = None,
    style: Annotated[Optional[str], typer.Option(help="map (colours), contours or surface")] = None,
    metric: Annotated[bool, typer.Option("--metric", help="draw rings of joint rates that cost the same")] = False,
    stretch: Annotated[
        bool, typer.Option("--stretch", help="redraw shape space: equal lengths cost equal effort")
    ] = False,
    pair: PairOption = None,
    slice_: SliceOption = None,
    other_frame: OtherFrameOption = None,
    component: ComponentOption = None,
    clim: ClimOption = None,
    yes: YesOption = False,
):
    """Draw the CCF with the scene's gait on it. Of three and more joints: a slice for each pair, or for one, with the
    others fixed."""
    from geomech.output import pictures
    from geomech.studies.shape_space import ccf

    scene = load_scene(name, grid, extent)
    panels = components(component)
    drawn = pictures.Ccf(style, metric, stretch, other_frame, panels, colour_limit(clim, panels))
    question = ccf(scene, pair, angles(scene, "--slice", slice_), other_frame, metric, stretch)
    execute(question, Output(plot, drawn, pictures.check), yes=yes, silent=True)
