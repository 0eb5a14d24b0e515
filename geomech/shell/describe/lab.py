"""geomech lab: the gait lab, a page in which loops are drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from geomech.core.summary import wrapped
from geomech.questions.shared.loading import load_scenes
from geomech.questions.shared.names import scene_names
from geomech.questions.shared.texts import parameters
from geomech.shell import pipeline, terminal
from geomech.shell.options import YesOption
from rft.core.refusal import in_line

if TYPE_CHECKING:
    from geomech.studies.maps.charts import Chart


def lab(
    names: Annotated[
        Optional[list[str]],
        typer.Argument(
            metavar="[SCENE]...",
            show_default=False,
            autocompletion=scene_names,
            help="built-in scenes or files; a gallery of six by default",
        ),
    ] = None,
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o",
            "--output",
            metavar="FILE.html",
            help="write the page to a file instead of opening it",
        ),
    ] = None,
    over: Annotated[
        Optional[list[str]],
        typer.Option(
            metavar="KEY=VALUES",
            help="add a slider for this parameter of the first scene",
        ),
    ] = None,
    yes: YesOption = False,
) -> None:
    """Write a page to draw loops on the CCF and watch the swimmer. The page is one
    file that needs no network and no installation; it shows the map, the swimmer, and
    the displacement per cycle by three tiers with their errors."""
    # The mechanics of scenes takes longer to load than the help of this command.
    from geomech.lab import check_format, page_path, write
    from geomech.studies.maps.lab import GALLERY, Lab

    if out is not None:
        check_format(out)
    scenes = load_scenes(names or GALLERY)
    request = Lab(scenes, parameters(over or (), scenes[0]))
    inputs = request.inputs()
    with page_path(out) as path:
        request.check()
        outputs = [pipeline.Output(path, write)]
        pipeline.refuse_unwritable(outputs, inputs)
        with pipeline.computing(request, outputs, inputs, yes) as progress:
            charts = request.charts(progress)
            write(charts, path)
        terminal.show(wrapped([*lines(charts), f"page in {in_line(path)}"]))


def lines(charts: list[Chart]) -> list[str]:
    """Return a line for each scene, and one for a family."""
    names = [in_line(chart.scene.name) for chart in charts]
    wide = max(map(len, names))
    found = []
    for name, chart in zip(names, charts):
        found.append(
            f"{name:{wide}}  {chart.shapes} shapes, harmonics to {chart.highest}"
        )
    family = charts[0].family
    if family is not None:
        found.append(
            f"{names[0]} over {family.key}: {len(family.values)} members, interpolated "
            f"between them to {family.error:.1e} BL"
        )
    return found
