"""geomech fit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import JsonOption, PlotOption, an_angle, check_files, check_netcdf
from geomech.core.errors import SceneError
from geomech.io.files import whole_file


def fit(
    log: Annotated[
        Path, typer.Argument(metavar="LOG.csv", help="t, joint angles, x, y, heading of many cycles of a gait")
    ],
    out: Annotated[
        Optional[Path], typer.Option("-o", "--output", metavar="FIELD.nc", help="connection to write")
    ] = None,
    scene: Annotated[
        Optional[Path],
        typer.Option("--scene", metavar="FILE.toml", help="scene of the mean gait to write, with FIELD.nc"),
    ] = None,
    plot: PlotOption = None,
    columns: Annotated[
        Optional[str], typer.Option(metavar="T,A1,A2,...,X,Y,HEADING", help="names of the columns, in this order")
    ] = None,
    degrees: Annotated[bool, typer.Option("--degrees", help="joint angles and heading are in degrees")] = False,
    level: Annotated[float, typer.Option(help="share of cases in which intervals are to cover the truth")] = 0.95,
    harmonics: Annotated[
        Optional[int], typer.Option(help="of the connection in the phase; by cross-validation if left out")
    ] = None,
    within: Annotated[
        Optional[float],
        typer.Option(
            metavar="ANGLE",
            help="of the mean gait, in rad or as 5deg; as far as the data reach if left out",
            parser=an_angle,
        ),
    ] = None,
    body_length: Annotated[
        float, typer.Option(metavar="M", help="of the body in m, where x and y are; else they are in body lengths")
    ] = 1.0,
    as_json: JsonOption = False,
):
    """The connection near a measured gait: phase, mean gait, A by regression with intervals, and the displacement that it
    predicts beside the log's."""
    from geomech.measured import fit_log
    from geomech.output import measured, plots

    if out:
        check_netcdf(out)
    if scene and scene.suffix != ".toml":
        raise SceneError(f"cannot write {scene}: end the name of a scene in .toml")
    if scene and not out:
        raise SceneError("--scene names the field's file: say -o FIELD.nc, too")
    check_files([log], out, plot, *filter(None, [scene]))
    names = columns.split(",") if columns is not None else ()
    found = fit_log(
        log, columns=names, degrees=degrees, level=level, harmonics=harmonics, within=within, body_length=body_length
    )
    if out:
        measured.save_field(out, found)
    if scene:
        with whole_file(scene) as part:
            part.write_text(measured.scene_toml(found, out, scene), encoding="utf-8")
    if plot:
        plots.save(plots.measured_figure(found), plot)
    print(json.dumps(measured.numbers(found)) if as_json else measured.text(found))
