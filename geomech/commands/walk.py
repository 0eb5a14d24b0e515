"""geomech walk."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech import terminal
from geomech.commands.asked import allow, loaded_walker, storing
from geomech.commands.options import JsonOption, WalkerArgument, YesOption, check_outputs, folder
from geomech.io.files import whole_folder


def walk(
    name: WalkerArgument,
    engine: Annotated[
        Optional[str], typer.Option(metavar="planar|mujoco", help="what computes the motion, in place of the scene's")
    ] = None,
    as_json: JsonOption = False,
    out: Annotated[
        Optional[Path], typer.Option("-o", "--output", metavar="DIR", help="folder for the results", parser=folder)
    ] = None,
    animate: Annotated[
        Optional[Path], typer.Option(metavar="FILE", help="film: .gif, .mp4; strip: .png, .pdf, .svg")
    ] = None,
    yes: YesOption = False,
):
    """How a robot walks on grains: mean speed with its error, and its way from rest. SI units, pitch in rad, nose down."""
    from geomech.output import animate as film
    from geomech.output import walks
    from geomech.run.cost import LONGEST
    from geomech.scene import inputs
    from geomech.study import walking

    scene = loaded_walker(name)
    walking.refuse_engine(scene, engine)
    if animate:
        film.check_format(animate)
    check_outputs(scene, animate, None)
    allow(scene, walking.price(scene, by=engine), yes)
    with storing(scene, out or animate, command="walk", engine=engine):
        with terminal.progress(f"walk of {scene.name}") as bar:
            found = walking.run(scene, engine, bar, math.inf if yes else LONGEST)
        if animate:
            walks.film(animate, scene, found)
        if out:
            with whole_folder(out, inputs(scene)) as place:
                walks.save(place, scene, found)
    print(walks.as_json(found) if as_json else walks.told(scene, found))
