"""geomech run."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from geomech.commands.options import (
    AllOption,
    ClimOption,
    ComponentOption,
    DataOption,
    FolderOption,
    MediumOption,
    YesOption,
    with_workers,
)
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_scene
from geomech.questions.names import scene_names
from geomech.questions.texts import colour_limit, components, measurements

DEFAULT_SCENE = "three-link-glass"
SceneOrOurs = Annotated[
    str,
    typer.Argument(
        metavar="[SCENE]", help="built-in name or TOML file", autocompletion=scene_names
    ),
]


@with_workers
def run(
    name: SceneOrOurs = DEFAULT_SCENE,
    out: FolderOption = Path("results"),
    medium: MediumOption = None,
    component: ComponentOption = None,
    clim: ClimOption = None,
    data: DataOption = None,
    everything: AllOption = False,
    yes: YesOption = False,
):
    """Compute connection, CCF and displacements into a folder. Displacements are drawn against amplitude."""
    from geomech.output import report
    from geomech.studies.report import Report

    question, panels = Report(load_scene(name, medium=medium)), components(component)
    drawn = report.Drawn(
        panels, colour_limit(clim, panels), measurements(data, question.scene, panels)
    )
    write, check = (
        partial(report.write, drawn=drawn),
        partial(report.refuse_folder, question.scene),
    )
    execute(
        question,
        Output(out, write, check, report.files, True),
        yes=yes,
        everything=everything,
    )
