"""geomech velocity."""

from __future__ import annotations

import json
import warnings
from typing import Annotated

import typer

from geomech.commands.asked import scene_with_gait
from geomech.commands.options import JsonOption, SceneArgument, numbers
from geomech.core.errors import Note, named


def velocity(
    name: SceneArgument,
    alpha: Annotated[str, typer.Option(help="joint angles in rad, such as 0.5,0.3, or 30deg,20deg")],
    alphadot: Annotated[str, typer.Option(help="joint rates in rad per unit time, such as 1,0, or in deg")],
    as_json: JsonOption = False,
):
    """Body velocity for one shape and its rate of change, with its residual and status."""
    from geomech.output.system import notes
    from geomech.study.single import single
    from geomech.systems.base import length_unit

    scene, asked = scene_with_gait(name), (("--alpha", alpha), ("--alphadot", alphadot))
    for line in notes(scene.system):
        warnings.warn(f"{scene.name}: {line}", Note, stacklevel=2)
    with named(scene.name):
        out = single(scene.system, *(numbers(*x, angle=None) for x in asked))
    unit = length_unit(scene.system)
    if as_json:
        told = {k: v for k, v in out.items() if k != "iterations"}
        print(json.dumps({**told, "units": {"xi": [unit, unit, "rad"]}}))
        return
    print("xi = ({:.9g}, {:.9g}, {:.9g})".format(*out["xi"]), f"{unit}, {unit}, rad per unit time")
    steps = f", {out['iterations']} iterations" if "iterations" in out else ""
    residual = "unknown" if out["residual"] is None else f"{out['residual']:.1e}"
    print(f"{out['status']}, residual {residual}{steps}")
