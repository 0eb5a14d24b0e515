"""geomech forces."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import (
    ClimOption,
    JsonOption,
    MediumOption,
    PlotOption,
    SceneArgument,
    YesOption,
    refuse_without_figure,
)
from geomech.commands.pipeline import Output, drawing, execute
from geomech.questions.loading import load_scene
from geomech.questions.texts import colour_limit, components

PANELS = ("forward", "normal", "tangential", "power", "moment", "phase", "place")


def forces(
    name: SceneArgument,
    length: Annotated[
        Optional[float], typer.Option(metavar="M", help="length of the body in m")
    ] = None,
    radius: Annotated[
        Optional[float], typer.Option(metavar="M", help="radius of the body in m")
    ] = None,
    depth: Annotated[
        Optional[float], typer.Option(metavar="M", help="depth of the body in m")
    ] = None,
    stress: Annotated[
        Optional[float],
        typer.Option(
            metavar="PA", help="axial drag over 2 radius x length at that depth, in Pa"
        ),
    ] = None,
    frequency: Annotated[
        Optional[float], typer.Option(metavar="HZ", help="cycles per second")
    ] = None,
    medium: MediumOption = None,
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="write the forces to .nc (NetCDF) or .csv",
        ),
    ] = None,
    as_json: JsonOption = False,
    plot: PlotOption = None,
    component: Annotated[
        Optional[str],
        typer.Option(
            "--component",
            metavar="NAMES",
            help=f"panels to draw, of {','.join(PANELS)}",
        ),
    ] = None,
    clim: ClimOption = None,
    yes: YesOption = False,
):
    """Compute force, power and bending moment along the body. Forces are in newtons where length, radius and
    depth of the body are known, and else in axial drags of the straight body."""
    from geomech.output import parts
    from geomech.studies.forces import Forces
    from geomech.studies.newtons import Sizes

    refuse_without_figure(plot, component=component, clim=clim)
    options = {"panels": components(component, PANELS), "clim": colour_limit(clim)}
    question = Forces(
        load_scene(name, medium=medium), Sizes(length, radius, depth, stress, frequency)
    )
    file = Output(out, parts.write_forces, parts.check_forces)
    figure = Output(
        plot, drawing("pictures.forces", **options), drawing("pictures.check")
    )
    execute(question, file, figure, as_json=as_json, yes=yes)
