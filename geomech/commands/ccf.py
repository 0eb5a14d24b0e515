"""geomech ccf."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech.commands.options import ExtentOption, GridOption, SceneArgument, YesOption, field


def ccf(
    name: SceneArgument,
    plot: Annotated[Path, typer.Option("--plot", metavar="FILE", help="figure: .png, .pdf or .svg")],
    grid: GridOption = None,
    extent: ExtentOption = None,
    yes: YesOption = False,
):
    """The CCF map with the scene's gait drawn on it."""
    from geomech.output import plots

    study = field(name, grid, extent, plot, plot, True, yes, with_gait=True)
    gait, system = study.scene.gait, study.scene.system
    maps = plots.ccf_figure(study.curvature, [gait], system.unit, study.curvature_error, system.shape_labels)
    plots.save(maps, plot)
