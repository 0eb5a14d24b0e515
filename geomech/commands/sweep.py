"""geomech sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from geomech import terminal
from geomech.commands.asked import allow, loaded, storing
from geomech.commands.options import (
    PlotOption,
    SceneArgument,
    YesOption,
    check_netcdf,
    check_outputs,
    parameter_kind,
    spread,
    with_workers,
)
from geomech.core.errors import SceneError


@with_workers
def sweep(
    name: SceneArgument,
    over: Annotated[list[str], typer.Option(help="PARAM=START:STOP:COUNT or PARAM=A,B,...; as often as wanted")],
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.nc", help="NetCDF file to write")],
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """Net displacement, or speed of a robot that walks, over a grid of the scene's parameters. What is done is kept if
    interrupted, and taken up again."""
    from geomech.output import sweeps
    from geomech.scene import load
    from geomech.study import sweep as sweeping
    from geomech.study.tables import of_pose

    axes = {}
    for text in over:
        parameter, equals, values = text.partition("=")
        if not equals or parameter in axes:
            raise SceneError(f"--over {text!r}: give each parameter once, as PARAM=START:STOP:COUNT")
        axes[parameter] = values
    check_netcdf(out)
    if plot and len(axes) > 2:
        raise SceneError(f"cannot draw {len(axes)} parameters: sweep one or two, or leave --plot out")
    scene = load(name)  # once: it may come through a pipe
    walks = hasattr(scene, "robot")
    if not walks:
        scene = loaded(scene)
    else:
        from geomech.output import walk_sweeps as sweeps
        from geomech.study import walking as sweeping
    axes = {p: spread(f"--over {p}", values, parameter_kind(scene, p)) for p, values in axes.items()}
    check_outputs(scene, out, plot)
    with storing(scene, out, command="sweep"):
        with terminal.progress(f"sweep of {scene.name}") as bar:
            cost = (sweeping.cost_of_sweep if walks else sweeping.cost)(scene, axes)
            allow(scene, cost, yes)
            results = sweeping.sweep(scene, axes, progress=bar, seconds=cost.seconds)
        sweeps.save(out, scene, results)
        if plot:
            from geomech.output import plots

            plots.save(sweeps.draw(scene, results), plot)
    if walks:
        print(f"{sweeps.told(results)}, in {out}")
        return
    net, unit = of_pose(results["displacement"])["net_distance"], results["units"]["estimate"]
    told = f"{net.size} points, net distance per cycle {net.min():.6g} to {net.max():.6g} {unit}"
    if (speed := results.get("speed")) is not None:
        told += f", speed {speed.min():.6g} to {speed.max():.6g} {unit}/s"
    print(f"{told}, in {out}")
