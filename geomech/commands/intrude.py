"""geomech intrude."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.asked import allow, loaded_intruder
from geomech.commands.options import IntruderArgument, JsonOption, PlotOption, check_outputs
from geomech.core.errors import SceneError


def intrude(
    name: IntruderArgument,
    as_json: JsonOption = False,
    out: Annotated[Optional[Path], typer.Option("-o", "--output", metavar="FILE.csv", help="table to write")] = None,
    plot: PlotOption = None,
):
    """Force and moment of the grains on a body, an outline in the vertical plane or a mesh, along its motion. SI units."""
    from geomech.io.files import whole_file
    from geomech.output import intrusions, plots
    from geomech.study.intrusion import estimate, price

    scene = loaded_intruder(name)
    if out and out.suffix.lower() != ".csv":
        raise SceneError(f"cannot write {out}: end the name of a table in .csv")
    check_outputs(scene, out, plot)
    allow(scene, price(scene, sum((1, *scene.finer)) * scene.count), yes=True)
    found = scene.run()
    error = estimate(scene, found)
    columns = scene.table(found)
    if out:
        with whole_file(out) as part:
            part.write_text(intrusions.csv(columns), encoding="utf-8")
    if plot:
        plots.save(plots.intrusion_figure(scene, found), plot)
    print(intrusions.as_json(scene, columns, error) if as_json else intrusions.told(scene, columns, found, error))
