"""geomech displacement."""

from __future__ import annotations

import json
from typing import Annotated, Optional

import typer

from geomech import terminal
from geomech.commands.asked import allow, loaded, storing
from geomech.commands.options import (
    ExtentOption,
    GridOption,
    JsonOption,
    PlotOption,
    SceneArgument,
    YesOption,
    amplitude_kind,
    check_outputs,
    spread,
    with_workers,
)
from geomech.core.errors import SceneError, choose


@with_workers
def displacement(
    name: SceneArgument,
    amplitudes: Annotated[str, typer.Option(help="0.5,1.0,1.75 or START:STOP:COUNT; angles also as 30deg")],
    methods: Annotated[Optional[str], typer.Option(help="any of area,adapted,path,harmonic,direct")] = None,
    grid: GridOption = None,
    extent: ExtentOption = None,
    tol: Annotated[Optional[float], typer.Option(help="error in body lengths that the cheapest tier must meet")] = None,
    effort: Annotated[bool, typer.Option("--cost", help="add path length, work and cost of transport")] = False,
    as_json: JsonOption = False,
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """Net displacement per cycle (x, y, theta), from phase t = 0, by each tier, with an estimate of its error."""
    from geomech.output import plots, report
    from geomech.study import cost
    from geomech.study.bench import METHODS, Study
    from geomech.study.choose import cheapest
    from geomech.study.effort import add_effort, refuse_costless

    chosen = [choose("--methods", m.strip(), METHODS) for m in methods.split(",")] if methods is not None else None
    scene = loaded(name, grid, extent)
    values = spread("--amplitudes", amplitudes, amplitude_kind(scene))
    check_outputs(scene, None, plot)
    if effort:
        refuse_costless(scene)
    with terminal.progress(f"displacement of {scene.name}") as bar:
        more, study = cost.of_effort(scene, len(values)) if effort else [], Study(scene)
        if tol is None:
            allow(scene, study.cost(values, chosen or study.methods, more=more), yes)
        elif chosen:
            raise SceneError("--tol chooses the tier: drop --methods")
        asked = {"command": "displacement", "amplitudes": values, "methods": chosen, "tol": tol, "cost": effort}
        with storing(scene, plot, **asked):
            if tol is None:
                table = study.study(values, chosen or study.methods, progress=bar)
            else:
                ask = lambda jobs: allow(scene, cost.price([*jobs, *more]), yes)
                table = cheapest(scene, values, tol, ask=ask)
            if effort:
                add_effort(table)
            if plot:
                tables = {type(scene.gait).__name__.lower(): table}
                plots.save(plots.displacement_figure(tables, [scene.gait]), plot)
    print(json.dumps(table) if as_json else report.text_table(scene.name, table, scene))
