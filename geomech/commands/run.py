"""geomech run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech.commands.loading import load_scene
from geomech.commands.names import scene_names
from geomech.commands.options import AllOption, FolderOption, MediumOption, YesOption, with_workers
from geomech.commands.pipeline import Output, execute

DEFAULT_SCENE = "three-link-glass"
SceneOrOurs = Annotated[
    str,
    typer.Argument(metavar="[SCENE]", help="a built-in name or a TOML file", autocompletion=scene_names),
]


@with_workers
def run(
    name: SceneOrOurs = DEFAULT_SCENE,
    out: FolderOption = Path("results"),
    medium: MediumOption = None,
    everything: AllOption = False,
    yes: YesOption = False,
):
    """Compute connection, CCF and displacements into a folder. Displacements are drawn against amplitude."""
    from geomech.output import report
    from geomech.studies.report import Report

    question = Report(load_scene(name, medium=medium))
    folder = Output(out, report.write, lambda path: report.refuse_folder(question.scene, path), report.files, True)
    execute(question, folder, yes=yes, everything=everything)
