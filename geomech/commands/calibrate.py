"""geomech calibrate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.options import JsonOption, PlotOption, check_files
from geomech.core.errors import SceneError, choose
from geomech.io.files import whole_file

Size = Optional[float]


def calibrate(
    drag: Annotated[str, typer.Argument(metavar="DRAG.csv", help="a CSV file, or dem-rod-drag, the sample that ships")],
    out: Annotated[
        Optional[Path], typer.Option("-o", "--output", metavar="MEDIUM.toml", help="medium to write")
    ] = None,
    plot: PlotOption = None,
    law: Annotated[
        Optional[str],
        typer.Option(help="granular, viscous or coulomb; stress-map or zeta; by the columns if left out"),
    ] = None,
    end_caps: Annotated[
        str, typer.Option(metavar="left-out|fitted|E", help="drag on the rod's ends; E = 1: one flat end")
    ] = "left-out",
    radius: Annotated[Size, typer.Option(help="of the rod in m, in place of the file's")] = None,
    length: Annotated[Size, typer.Option(help="of the rod in m, in place of the file's")] = None,
    depth: Annotated[Size, typer.Option(help="of its axis in m, in place of the file's")] = None,
    density: Annotated[
        Size, typer.Option(help="of the bed in kg/m^3, grains and voids, in place of the file's")
    ] = None,
    area: Annotated[Size, typer.Option(help="of the plate in m^2, in place of the file's")] = None,
    as_json: JsonOption = False,
):
    """A medium of one's own: fits a force law to the drag on a rod, columns psi_deg, F_parallel_N, F_perpendicular_N; or, of
    the vertical plane, nine coefficients to plate drags, columns beta, gamma, alpha_x, alpha_z (degrees, N/cm^3), or zeta to
    a plate pushed straight down, columns depth_m, force_N."""
    from geomech.io.files import note
    from geomech.output import plots
    from geomech.study.calibration import CALIBRATIONS
    from geomech.study.stress_calibration import law_of

    law = choose("--law", law_of(drag) if law is None else law, CALIBRATIONS)
    if out and out == plot:
        raise SceneError(f"cannot write {out} twice: give --plot another name")
    check_files([Path(drag)], out, plot)
    sizes = {"radius": radius, "length": length, "depth": depth, "density": density, "area": area}
    found = CALIBRATIONS[law](law, drag, {k: x for k, x in sizes.items() if x is not None}, caps(end_caps))
    if out:
        with whole_file(out) as part:
            part.write_text(found.toml(), encoding="utf-8")
    if plot:
        plots.save(getattr(plots, found.picture)(found.curves()), plot)
    for told in found.notes():
        note(told)
    print(json.dumps(found.numbers()) if as_json else found.text())
    if out and not as_json:
        print(f'medium in {out}: in {found.scene}, [medium] file = "{out.name}"')


def caps(text: str) -> float | str:
    """e of the rod's ends (`rft.EndCaps`), 0 to leave them out, or "fitted"."""
    if text in ("left-out", "fitted"):
        return 0.0 if text == "left-out" else text
    try:
        return float(text)
    except ValueError:
        raise SceneError(f"--end-caps {text!r} is neither left-out, fitted nor a number") from None
