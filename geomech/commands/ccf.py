"""geomech ccf."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.asked import beside_field, field
from geomech.commands.options import BesideOption, ExtentOption, GridOption, SceneArgument, YesOption
from geomech.errors import SceneError, choose


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
    beside: BesideOption = None,
    yes: YesOption = False,
):
    """The CCF map with the scene's gait drawn on it."""
    from geomech.output import plots

    if style is not None:
        choose("--style", style, plots.CCF_STYLES)
    if stretch and (metric or beside or style not in (None, "map")):
        raise SceneError("--stretch is a map of its own: drop --style, --metric and --beside")
    if metric and style not in (None, "map"):
        raise SceneError(f"--metric draws on a map: drop --style {style}")
    study = field(name, grid, extent, plot, plot, True, yes, with_gait=True, metric=metric or stretch)
    system, told = study.scene.system, {"gaits": [study.scene.gait], "unit": study.scene.system.unit}
    told |= {"error": study.curvature_error, "labels": system.shape_labels}
    if stretch:
        from geomech.stretch import stretch as redrawn

        plane, effort = redrawn(study.metric), "BL" if system.power_degree == 1 else "path length"
        maps = plots.stretched_figure(study.curvature, plane, **told, effort=effort)
    else:
        told |= {"style": style or "map", "metric": study.metric if metric else None}
        if beside is not None:
            other = beside_field(study, beside, yes)
            told |= {"beside": (other.curvature, other.curvature_error), "names": [study.scene.frame, beside]}
        maps = plots.ccf_figure(study.curvature, **told)
    plots.save(maps, plot)
