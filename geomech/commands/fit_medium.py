"""geomech fit-medium."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Optional

import typer

from geomech.commands.options import AllOption, JsonOption, PlotOption
from geomech.commands.pipeline import Output, execute
from geomech.questions.texts import parse_end_caps

if TYPE_CHECKING:
    from geomech.core.variables import Result

Size = Optional[float]


def fit_medium(
    drag: Annotated[
        str,
        typer.Argument(
            metavar="DRAG.csv",
            help="CSV file, or short-rod-drag or flank-drag, samples that ship",
        ),
    ],
    out: Annotated[
        Optional[Path],
        typer.Option(
            "-o", "--output", metavar="FILE.toml", help="write the medium to .toml"
        ),
    ] = None,
    plot: PlotOption = None,
    law: Annotated[
        Optional[str],
        typer.Option(
            metavar="LAW", help="granular, viscous, coulomb, stress-map or zeta"
        ),
    ] = None,
    end_caps: Annotated[
        str,
        typer.Option(
            metavar="E", help="ends of the rod: left-out, fitted or 1 for a flat end"
        ),
    ] = "left-out",
    radius: Annotated[
        Size,
        typer.Option(
            metavar="SIZE", help="radius of the rod in m, in place of the file's"
        ),
    ] = None,
    length: Annotated[
        Size,
        typer.Option(
            metavar="SIZE", help="length of the rod in m, in place of the file's"
        ),
    ] = None,
    depth: Annotated[
        Size,
        typer.Option(
            metavar="SIZE", help="depth of the rod's axis in m, in place of the file's"
        ),
    ] = None,
    density: Annotated[
        Size,
        typer.Option(
            metavar="SIZE", help="density of the bed in kg/m^3, in place of the file's"
        ),
    ] = None,
    area: Annotated[
        Size,
        typer.Option(
            metavar="SIZE", help="area of the plate in m^2, in place of the file's"
        ),
    ] = None,
    everything: AllOption = False,
    as_json: JsonOption = False,
):
    """Fit a medium to your own drag data. Rods, with the columns psi_deg, F_parallel_N, F_perpendicular_N, give a force law;
    plates in the vertical plane, with beta, gamma, alpha_x, alpha_z (degrees, N/cm^3), nine coefficients; a plate that is
    pushed straight down, with depth_m, force_N, the factor zeta."""
    from geomech import plots
    from geomech.studies.calibration import Calibration

    sizes = {
        "radius": radius,
        "length": length,
        "depth": depth,
        "density": density,
        "area": area,
    }
    known = tuple((key, x) for key, x in sizes.items() if x is not None)
    file = Output(out, write_medium, message=about_medium)
    figure = Output(plot, draw, plots.check_format)
    execute(
        Calibration(drag, law, known, parse_end_caps(end_caps)),
        file,
        figure,
        as_json=as_json,
        everything=everything,
    )


def write_medium(result: Result, path: Path) -> None:
    """Write a medium that was calibrated."""
    from geomech import text
    from geomech.io.files import write_text

    write_text(path, text.medium(result))


def about_medium(result: Result, path: Path) -> str:
    """Return the line that says how a scene takes a medium."""
    scene = "an intruder scene"
    if result.kind == "rod_drag":
        scene = "a scene"
    return f'medium in {path}: in {scene}, [medium] file = "{path.name}"'


def draw(result: Result, path: Path) -> None:
    """Draw measurements and the law that was fitted to them."""
    from geomech import plots
    from geomech.app.results import CALIBRATIONS

    plots.save(CALIBRATIONS[result.kind](result), path)
