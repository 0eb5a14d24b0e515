"""geomech velocity."""

from __future__ import annotations

from typing import Annotated

import typer

from geomech.commands.loading import load_with_gait
from geomech.commands.options import JsonOption, SceneArgument, angles
from geomech.commands.pipeline import execute


def velocity(
    name: SceneArgument,
    alpha: Annotated[
        str,
        typer.Option(
            metavar="ANGLES", help="joint angles in rad, as 0.5,0.3 or 30deg,20deg"
        ),
    ],
    alphadot: Annotated[
        str,
        typer.Option(
            metavar="RATES", help="joint rates in rad per unit of time, as 1,0"
        ),
    ],
    as_json: JsonOption = False,
):
    """Compute the body velocity of one shape and its rate. The answer has a residual and a status."""
    from geomech.studies.velocity import Velocity

    scene = load_with_gait(name)
    question = Velocity(
        scene, angles(scene, "--alpha", alpha), angles(scene, "--alphadot", alphadot)
    )
    execute(question, as_json=as_json)
