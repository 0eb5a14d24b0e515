"""geomech stress."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.commands.names import medium_names
from geomech.commands.options import JsonOption, PlotOption
from geomech.core.errors import SceneError


def stress(
    medium: Annotated[
        str,
        typer.Argument(
            metavar="MEDIUM",
            help="a name (see 'geomech scenes'), a TOML file or a CSV file of plate drags",
            autocompletion=medium_names,
        ),
    ],
    beta: Annotated[Optional[float], typer.Option(help="tilt of the plate in degrees, 0 lying flat")] = None,
    gamma: Annotated[Optional[float], typer.Option(help="direction of motion in degrees below the horizontal")] = None,
    as_json: JsonOption = False,
    plot: PlotOption = None,
):
    """Stress of the grains on a plate per unit depth, N/cm^3: backwards (alpha_x) and upwards (alpha_z) (Fig. 7)."""
    from geomech.io import files
    from geomech.scene.stress import load_medium
    from rft.plates import survey

    if (beta is None) != (gamma is None) or (beta is None and plot is None):
        raise SceneError("give both --beta and --gamma, in degrees, or --plot for all angles")
    if not all(x is None or abs(x) <= 1e6 for x in (beta, gamma)):
        raise SceneError("--beta and --gamma must be finite angles in degrees, of at most 1e6")
    law = load_medium(medium)
    whole = survey(law)
    told = f"{medium} {whole.description()}" + (", which is cut" if law.tension == "cut" else "")
    if plot:
        from geomech.output import plots

        files.refuse_inputs([plot], [Path(medium)])
        plots.save(plots.stress_figure(whole, None if beta is None else (beta, gamma)), plot)
    if whole.pushing:
        files.note(told)
    if beta is None:
        print(json.dumps({"pulling": whole.pulling, "pushing": whole.pushing}) if as_json else told)
        return
    a_x, a_z = (round(float(x), 12) + 0.0 for x in law(math.radians(beta), math.radians(gamma)))
    if as_json:
        print(json.dumps({"alpha_x": a_x, "alpha_z": a_z}))
        return
    print(f"alpha_x = {a_x:.4g} N/cm^3, against the motion's x; alpha_z = {a_z:.4g} N/cm^3, upwards")
    print(told)
