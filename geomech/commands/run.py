"""geomech run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech import terminal
from geomech.commands.asked import allow, loaded, storing
from geomech.commands.names import scene_names
from geomech.commands.options import FolderOption, MediumOption, YesOption, with_workers
from geomech.io.files import whole_folder

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
    yes: YesOption = False,
):
    """Everything: connection, CCF map and displacement against amplitude, as figures and numbers, into DIR."""
    from geomech.output import report
    from geomech.scene import inputs
    from geomech.study.bench import Study

    scene = loaded(name, medium=medium)
    report.refuse_folder(scene, out, inputs(scene))
    takes, told = report.cost(scene), terminal.progress(f"field of {scene.name}")
    allow(scene, takes, yes)
    kept = storing(scene, out, command="run")
    with kept, whole_folder(out, inputs(scene)) as folder, told as bar:
        tables = report.write(Study(scene), folder, bar)
    for title, table in tables.items():
        print(report.text_table(title, table, scene))
    print(f"files in {out}: {', '.join(sorted(p.name for p in out.iterdir() if not p.name.startswith('.')))}")
