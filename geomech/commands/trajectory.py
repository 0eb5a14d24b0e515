"""geomech trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech.commands import formats
from geomech.commands.loading import load_scene
from geomech.commands.options import CyclesOption, SceneArgument, YesOption
from geomech.commands.pipeline import Output, execute, path_message


def trajectory(
    name: SceneArgument,
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.csv", help="table to write")],
    cycles: CyclesOption = 1,
    yes: YesOption = False,
):
    """Write pose, joint angles and ends of all links at every phase of the scene's gait, as CSV."""
    from geomech.output import trajectories
    from geomech.study.motion import Trajectory

    execute(
        Trajectory(load_scene(name), cycles),
        Output(out, trajectories.write, formats.csv, path_message("table in")),
        yes=yes,
    )
