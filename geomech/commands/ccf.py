"""geomech ccf."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.asked import beside_field, field, loaded, planes, storing
from geomech.commands.options import (
    BesideOption,
    ExtentOption,
    GridOption,
    PairOption,
    SceneArgument,
    SliceOption,
    YesOption,
    check_outputs,
    with_workers,
)
from geomech.core.errors import SceneError, choose


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
    beside: BesideOption = None,
    yes: YesOption = False,
):
    """The CCF map with the scene's gait drawn on it. Of three and more joints: a slice for each pair, or for one, with the
    others held."""
    from geomech.output import plots

    if style is not None:
        choose("--style", style, plots.CCF_STYLES)
    if stretch and (metric or beside or style not in (None, "map")):
        raise SceneError("--stretch is a map of its own: drop --style, --metric and --beside")
    if metric and style not in (None, "map"):
        raise SceneError(f"--metric draws on a map: drop --style {style}")
    scene = loaded(name, grid, extent)
    sliced = scene.system.joints > 2 or pair is not None or slice_ is not None
    if sliced and (metric or stretch):
        raise SceneError("--metric and --stretch are those of two joints: drop them for slices")
    check_outputs(scene, None, plot)
    asked = {"metric": metric or stretch, "pair": pair, "slice": slice_, "beside": beside}
    with storing(scene, plot, command="ccf", **asked):
        if sliced:
            maps = _slices(scene, style or "map", (pair, slice_), beside, yes)
        else:
            study = field(scene, grid, extent, plot, plot, True, yes, with_gait=True, metric=metric or stretch)
            maps = _map(study, style, stretch, metric, beside, yes)
        plots.save(maps, plot)


def _map(study, style: str | None, stretch: bool, metric: bool, beside: str | None, yes: bool):
    """The figure of the CCF of two joints that a field has."""
    from geomech.output import plots
    from geomech.systems.base import shape_labels

    system, told = study.scene.system, {"gaits": [study.scene.gait]}
    told |= {"error": study.curvature_error, "labels": shape_labels(system)}
    if stretch:
        from geomech.geometry.stretch import stretch as redrawn

        plane, effort = redrawn(study.metric), "BL" if system.traits.power_degree == 1 else "path length"
        return plots.stretched_figure(study.curvature, plane, **told, effort=effort)
    told |= {"style": style or "map", "metric": study.metric if metric else None}
    if beside is not None:
        other = beside_field(study, beside, yes)
        told |= {"beside": (other.curvature, other.curvature_error), "names": [study.scene.frame, beside]}
    return plots.ccf_figure(study.curvature, **told)


def _slices(scene, style: str, asked: tuple, beside: str | None, yes: bool):
    """The figure of `planes_figure` that a scene is asked for."""
    from geomech.output import plots
    from geomech.study.bench import Study
    from geomech.systems.base import shape_labels

    study, system = Study(scene), scene.system
    found, told = planes(study, *asked, yes), {"labels": shape_labels(system), "style": style}
    if beside is not None:
        if len(found) > 1:
            raise SceneError("--beside draws one pair of joints: say which with --pair")
        (other,) = planes(study.in_frame(beside), *asked, yes)
        told |= {"beside": other, "names": [scene.frame, beside]}
    return plots.planes_figure(found, scene.gait, **told)
