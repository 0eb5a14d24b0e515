"""Options of the commands that are no questions yet, beside `geomech.options`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.options import MediumOption as MediumOption
from geomech.options import SceneArgument as SceneArgument
from geomech.options import YesOption as YesOption
from geomech.options import an_angle as an_angle
from geomech.options import with_workers as with_workers

PlotOption = Annotated[
    Optional[Path],
    typer.Option("--plot", metavar="FILE", help="draw a figure to .png, .pdf or .svg"),
]


def folder(text: str | Path) -> Path:
    """Return the folder of that name; an empty name is refused."""
    if not str(text):
        raise typer.BadParameter("an empty name: name a folder, '.' for this one")
    return Path(text)


FolderOption = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        metavar="DIR",
        help="folder to write the results to",
        parser=folder,
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON and nothing else")]
AllOption = Annotated[
    bool,
    typer.Option("--all", help="print all lines, not only those that fit a screen"),
]
ComponentOption = Annotated[
    Optional[str],
    typer.Option(
        "--component", metavar="NAMES", help="panels to draw, such as x or x,theta"
    ),
]
ClimOption = Annotated[
    Optional[str],
    typer.Option(
        "--clim",
        metavar="LIMIT",
        help="limit of the colours, a number or percentiles as 98% or 5%:95%",
    ),
]
DataOption = Annotated[
    Optional[Path],
    typer.Option(
        "--data",
        metavar="FILE.csv",
        help="draw points, of columns amplitude,value,error",
    ),
]
