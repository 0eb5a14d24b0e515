"""geomech optimize."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech import terminal
from geomech.commands.asked import allow, loaded, storing
from geomech.commands.options import (
    JsonOption,
    PlotOption,
    SceneArgument,
    YesOption,
    check_outputs,
    joint_limits,
    with_workers,
)
from geomech.core.errors import SceneError
from geomech.io.files import whole_file


@with_workers
def optimize(
    name: SceneArgument,
    aim: Annotated[str, typer.Option("--for", help="displacement, efficiency, turning or speed")],
    direction: Annotated[Optional[str], typer.Option(help="x or y: displacement along that axis of the body")] = None,
    harmonics: Annotated[Optional[int], typer.Option(help="of the Fourier series; 5 if left out")] = None,
    within: Annotated[
        Optional[str],
        typer.Option(metavar="EXTENT", help="of joints, in rad: 2.5, 120deg, -0.5:2, or 1,2 for each; else the field's"),
    ] = None,
    starts: Annotated[
        Optional[int], typer.Option(metavar="N", help="loops to begin with; the first is the scene's; 1, in sand 9")
    ] = None,
    rate: Annotated[Optional[float], typer.Option(help="rad/s that no joint exceeds, for speed")] = None,
    power: Annotated[Optional[float], typer.Option(help="mean, body's axial drag x BL/s, for speed")] = None,
    out: Annotated[Optional[Path], typer.Option("-o", "--output", metavar="BEST.toml", help="scene to write")] = None,
    plot: PlotOption = None,
    stretch: Annotated[bool, typer.Option("--stretch", help="draw it where equal lengths cost the same, too")] = False,
    as_json: JsonOption = False,
    yes: YesOption = False,
):  # fmt: skip
    """The best gait of a scene for an aim: its value with an error, as a scene, and its loop on the CCF map."""
    from geomech.optimise import checked, search
    from geomech.output import optima, plots

    scene = loaded(name)
    request = checked(scene, aim, direction, harmonics, joint_limits(within, scene), starts, rate, power)
    if out and out.suffix != ".toml":
        raise SceneError(f"cannot write {out}: end the name of a scene in .toml")
    if stretch:
        refuse_stretch(scene, plot)
    check_outputs(scene, out, plot)
    allow(scene, request.cost(), yes)
    asked = {"for": aim, "direction": direction, "harmonics": harmonics, "within": within, "starts": starts}
    with storing(scene, out or plot, command="optimize", **asked, rate=rate, power=power):
        with terminal.progress(f"{aim} of {scene.name}") as bar:
            found = search(request, bar)
        if plot:
            plots.save(plots.optimum_figure(found, stretch), plot)
        if out:
            with whole_file(out) as part:
                part.write_text(optima.scene_toml(found), encoding="utf-8")
    print(json.dumps(found.numbers()) if as_json else optima.text(found))


def refuse_stretch(scene, plot: Path | None) -> None:
    """SceneError where there is no picture to stretch, or no metric to stretch it by."""
    from geomech.study.effort import why_none

    if plot is None:
        raise SceneError("--stretch is a way to draw: say --plot FILE, too")
    if scene.system.joints != 2:
        raise SceneError(f"{scene.name}: --stretch takes two joints, this one has {scene.system.joints}: drop it")
    if reason := why_none(scene.system):
        raise SceneError(f"{scene.name}: {reason}: drop --stretch")
