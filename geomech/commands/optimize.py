"""geomech optimize."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands import formats
from geomech.commands.loading import load_scene
from geomech.commands.options import (
    ClimOption,
    JsonOption,
    PlotOption,
    SceneArgument,
    YesOption,
    colour_limit,
    joint_limits,
    refuse_without_figure,
    with_workers,
)
from geomech.commands.pipeline import Output, execute


@with_workers
def optimize(
    name: SceneArgument,
    objective: Annotated[str, typer.Option("--objective", help="displacement, efficiency, turning or speed")],
    direction: Annotated[Optional[str], typer.Option(help="x or y: displacement along that axis of the body")] = None,
    harmonics: Annotated[Optional[int], typer.Option(help="of the Fourier series; 5 if left out")] = None,
    limits: Annotated[
        Optional[str],
        typer.Option(metavar="EXTENT", help="of joints, in rad: 2.5, 120deg, -0.5:2, or 1,2 for each; else the field's"),
    ] = None,
    starts: Annotated[
        Optional[int], typer.Option(metavar="N", help="loops to begin with; the first is the scene's; 1, in sand 9")
    ] = None,
    rate: Annotated[Optional[float], typer.Option(help="rad/s that no joint exceeds, for speed")] = None,
    power: Annotated[Optional[float], typer.Option(help="mean, body's axial drag x BL/s, for speed")] = None,
    out: Annotated[Optional[Path], typer.Option("-o", "--output", metavar="BEST.toml", help="scene to write")] = None,
    plot: PlotOption = None,
    stretch: Annotated[bool, typer.Option("--stretch", help="draw it where equal lengths cost the same, too")] = False,
    clim: ClimOption = None,
    as_json: JsonOption = False,
    yes: YesOption = False,
):  # fmt: skip
    """Find the best gait for an objective. Its value has an error; -o writes it as a scene, --plot draws its loop on
    the CCF."""
    from geomech.optimisation.question import Optimize
    from geomech.output import parts, pictures

    refuse_without_figure(plot, clim=clim)
    scene = load_scene(name)
    drawn = pictures.Optimum(stretch, plot, colour_limit(clim))
    file, figure = Output(out, parts.write_best, formats.toml), Output(plot, drawn, pictures.check)
    question = Optimize(
        scene, objective, direction, harmonics, joint_limits(limits, scene), starts, rate, power, stretch
    )
    execute(question, file, figure, as_json=as_json, yes=yes)
