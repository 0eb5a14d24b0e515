"""geomech fit-gait."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from geomech.commands import formats
from geomech.commands.options import JsonOption, PlotOption, an_angle
from geomech.commands.pipeline import Output, execute
from geomech.questions.texts import column_names
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.core.variables import Result


def fit_gait(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE.csv",
            help="table of joint angles, x, y, heading, or points of midlines",
        ),
    ],
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o", "--output", metavar="FILE.nc", help="write the result to .nc (NetCDF)"
        ),
    ] = None,
    scene: Annotated[
        Optional[Path],
        typer.Option(
            "--scene",
            metavar="FILE.toml",
            help="write a scene of the mean gait, which takes FILE.nc",
        ),
    ] = None,
    plot: PlotOption = None,
    columns: Annotated[
        Optional[str],
        typer.Option(
            metavar="LIST",
            help="columns T,A1,A2,...,X,Y,HEADING, or points along the body",
        ),
    ] = None,
    degrees: Annotated[
        bool, typer.Option("--degrees", help="read joint angles and heading in degrees")
    ] = False,
    level: Annotated[
        float,
        typer.Option(
            metavar="SHARE", help="share of cases in which intervals cover the truth"
        ),
    ] = 0.95,
    harmonics: Annotated[
        Optional[int],
        typer.Option(
            metavar="N", help="harmonics of A in the phase, cross-validated if left out"
        ),
    ] = None,
    limits: Annotated[
        Optional[float],
        typer.Option(
            metavar="ANGLE",
            help="distance from the mean gait that the field covers",
            parser=an_angle,
        ),
    ] = None,
    body_length: Annotated[
        Optional[float],
        typer.Option(metavar="M", help="length of the body, in the unit of x and y"),
    ] = None,
    medium: Annotated[
        Optional[str],
        typer.Option(
            metavar="NAME", help="medium, or its file, in which midlines are predicted"
        ),
    ] = None,
    units: Annotated[
        Optional[str],
        typer.Option(
            metavar="UNIT", help="unit of x and y of midlines: m, cm, mm, px or BL"
        ),
    ] = None,
    scale: Annotated[
        Optional[float], typer.Option(metavar="MM", help="mm per pixel of midlines")
    ] = None,
    fps: Annotated[
        Optional[float], typer.Option(metavar="N", help="frames per second of midlines")
    ] = None,
    y: Annotated[
        Optional[str],
        typer.Option("--y", metavar="SENSE", help="y of midlines runs up or down"),
    ] = None,
    head: Annotated[
        Optional[str],
        typer.Option(
            metavar="END",
            help="the first or last point is the head, else by the motion",
        ),
    ] = None,
    least_score: Annotated[
        Optional[float],
        typer.Option(
            metavar="P",
            help="score from which on points are taken; of a likelihood 0.6 if left out",
        ),
    ] = None,
    individual: Annotated[
        Optional[str],
        typer.Option(metavar="NAME", help="animal to take, of several in the file"),
    ] = None,
    mend: Annotated[
        bool,
        typer.Option(
            "--mend",
            help="leave out points that jump or swap, turn reversed frames round",
        ),
    ] = False,
    as_json: JsonOption = False,
):
    """Fit a measured gait. A log of joint angles gives the connection near its mean gait, with intervals; tracked midlines
    give speed, heading, slip, wave efficiency, amplitude and wavelength, each with an interval, and in a medium the same as
    predicted."""
    from geomech.measured.ask import question

    request = question(
        file, scene, columns=column_names(columns), degrees=degrees, level=level, harmonics=harmonics, limits=limits,
        body_length=body_length, medium=medium, units=units, scale=scale, fps=fps, y=y, head=head, least_score=least_score,
        individual=individual, mend=mend,
    )  # fmt: skip
    field = Output(out, write_measured, formats.netcdf)
    figure = Output(plot, draw, check_figure)
    execute(request, field, Output(scene, *mean_gait(out)), figure, as_json=as_json)


def write_measured(result: Result, path: Path) -> None:
    """Write the connection near a measured gait, or the kinematics of midlines."""
    from geomech.io.results import write_netcdf
    from geomech.measured import results

    if result.kind == "midlines":
        write_netcdf(path, result)
    else:
        write_netcdf(path, results.of_fit(result.subject))


def mean_gait(field: Path | None) -> tuple[Callable, Callable]:
    """Return a function that writes a scene of a measured gait, whose connection is in the
    file ``field``, and a check of the name of that scene."""

    def check(path: Path) -> None:
        if path.suffix != ".toml":
            raise Refusal(
                f"cannot write {path}", instead="end the name of a scene in .toml"
            )
        if field is None:
            raise Refusal(
                "--scene names the field's file", instead="say -o FIELD.nc, too"
            )

    def write(result: Result, path: Path) -> None:
        from geomech.io.files import write_text
        from geomech.measured import results

        write_text(path, results.scene_toml(result.subject, field, path))

    return write, check


def draw(result: Result, path: Path) -> None:
    """Draw a measured gait, or midlines."""
    from geomech import plots

    if result.kind == "midlines":
        plots.save(plots.midlines_figure(result), path)
    else:
        plots.save(plots.measured_figure(result.subject), path)


def check_figure(path: Path) -> None:
    """Refuse the name of a figure that ends in no format."""
    from geomech import plots

    plots.check_format(path)
