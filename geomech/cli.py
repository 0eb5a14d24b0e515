"""The command line: geomech run, velocity, connection, ccf, displacement, accuracy, sweep, explain, scenes."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech import terminal
from geomech.errors import SceneError, choose, named
from geomech.files import whole_folder
from geomech.options import (
    ExtentOption,
    FolderOption,
    GridOption,
    JsonOption,
    PlotOption,
    SceneArgument,
    YesOption,
    check_netcdf,
    check_outputs,
    numbers,
    spread,
)

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="Geometric mechanics of locomotion in sand and fluid: from a force law to the displacement of a gait.",
)  # fmt: skip

DEFAULT_SCENE = "three-link-glass"


@app.command()
def run(
    name: Annotated[str, typer.Argument(metavar="[SCENE]", help="a built-in name or a TOML file")] = DEFAULT_SCENE,
    out: FolderOption = Path("results"),
    yes: YesOption = False,
):
    """Everything: connection, CCF map and displacement against amplitude, as figures and numbers, into DIR."""
    from geomech.output import report
    from geomech.scene import inputs, load
    from geomech.study.bench import Study

    scene = load(name)
    report.refuse_folder(scene, out, inputs(scene))
    with whole_folder(out, inputs(scene)) as folder, terminal.progress(f"field of {scene.name}") as bar:
        allow(scene, report.cost(scene), yes)
        tables = report.write(Study(scene), folder, bar)
    for title, table in tables.items():
        print(report.text_table(title, table, scene))
    print(f"files in {out}: {', '.join(sorted(p.name for p in out.iterdir() if not p.name.startswith('.')))}")


@app.command()
def velocity(
    name: SceneArgument,
    alpha: Annotated[str, typer.Option(help="joint angles in rad, such as 0.5,0.3")],
    alphadot: Annotated[str, typer.Option(help="joint rates in rad per unit time, such as 1,0")],
    as_json: JsonOption = False,
):
    """Body velocity for one shape and its rate of change, with its residual and status."""
    from geomech.scene import load

    scene = load(name)
    with named(scene.name):
        out = scene.system.single(numbers("--alpha", alpha), numbers("--alphadot", alphadot))
    if as_json:
        print(json.dumps({k: v for k, v in out.items() if k != "iterations"}))
        return
    unit = scene.system.unit
    print("xi = ({:.9g}, {:.9g}, {:.9g})".format(*out["xi"]), f"{unit}, {unit}, rad per unit time")
    steps = f", {out['iterations']} iterations" if "iterations" in out else ""
    print(f"{out['status']}, residual {out['residual']:.1e}{steps}")


@app.command()
def connection(
    name: SceneArgument,
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.nc", help="NetCDF file to write")],
    grid: GridOption = None,
    extent: ExtentOption = None,
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """The local connection on a grid, with its fit residual and CCF, as NetCDF."""
    from geomech.output import plots
    from geomech.output.netcdf import save_connection

    check_netcdf(out)
    study = _field(name, grid, extent, out, plot, plot is not None, yes)
    save_connection(out, study)
    if plot:
        plots.save(plots.connection_figure(study.fitted, study.scene.system.unit), plot)


@app.command()
def ccf(
    name: SceneArgument,
    plot: Annotated[Path, typer.Option("--plot", metavar="FILE", help="figure: .png, .pdf or .svg")],
    grid: GridOption = None,
    extent: ExtentOption = None,
    yes: YesOption = False,
):
    """The CCF map with the scene's gait drawn on it."""
    from geomech.output import plots

    study = _field(name, grid, extent, plot, plot, True, yes)
    gait, unit = study.scene.gait, study.scene.system.unit
    plots.save(plots.ccf_figure(study.curvature, [gait], unit, study.curvature_error), plot)


@app.command()
def displacement(
    name: SceneArgument,
    amplitudes: Annotated[str, typer.Option(help="0.5,1.0,1.75 or START:STOP:COUNT")],
    methods: Annotated[Optional[str], typer.Option(help="any of area,adapted,path,harmonic,direct")] = None,
    grid: GridOption = None,
    extent: ExtentOption = None,
    tol: Annotated[Optional[float], typer.Option(help="error in body lengths that the cheapest tier must meet")] = None,
    as_json: JsonOption = False,
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """Net displacement per cycle (x, y, theta), from phase t = 0, by each tier, with an estimate of its error."""
    from geomech.output import plots, report
    from geomech.study import cost
    from geomech.study.bench import METHODS, Study
    from geomech.study.choose import cheapest

    values = spread("--amplitudes", amplitudes)
    chosen = [choose("--methods", m.strip(), METHODS) for m in methods.split(",")] if methods is not None else None
    scene = _loaded(name, grid, extent)
    check_outputs(scene, None, plot)
    with terminal.progress(f"displacement of {scene.name}") as bar:
        if tol is None:
            study = Study(scene)
            allow(scene, study.cost(values, chosen or study.methods), yes)
            table = study.study(values, chosen or study.methods, progress=bar)
        elif chosen:
            raise SceneError("--tol chooses the tier: drop --methods")
        else:
            ask = lambda jobs: allow(scene, cost.price(jobs), yes)
            table = cheapest(scene, values, tol, ask=ask)
    if plot:
        fig, axes = plots.figure(3.6, 3.4)
        plots.displacement(table, scene.system.unit, axes[0, 0], gait=scene.gait, marker="o")
        plots.save(fig, plot)
    print(json.dumps(table) if as_json else report.text_table(scene.name, table, scene))


@app.command()
def accuracy(
    name: SceneArgument,
    out: FolderOption = Path("accuracy"),
    as_json: JsonOption = False,
    yes: YesOption = False,
):
    """What accuracy costs in this scene: error against time for every tier and knob, and the cheapest settings."""
    from geomech.output import plots
    from geomech.scene import inputs
    from geomech.study import accuracy as study

    scene = _loaded(name, None, None)
    with whole_folder(out, inputs(scene)) as folder, terminal.progress(f"accuracy of {scene.name}") as bar:
        allow(scene, study.cost(scene), yes)
        results = study.study(scene, bar)
        text = "\n".join([study.table(results), "", *study.sentences(results)])
        (folder / "accuracy.json").write_text(json.dumps(results, indent=1) + "\n")
        (folder / "accuracy.txt").write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
        fig = plots.work_precision_figure(results)
        for ending in ("png", "pdf"):
            plots.save(fig, folder / f"accuracy.{ending}")
    print(json.dumps(results) if as_json else f"{text}\nfiles in {out}: accuracy.json, .txt, .png, .pdf")


@app.command()
def sweep(
    name: SceneArgument,
    over: Annotated[list[str], typer.Option(help="PARAM=START:STOP:COUNT or PARAM=A,B,...; as often as wanted")],
    out: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.nc", help="NetCDF file to write")],
    plot: PlotOption = None,
    yes: YesOption = False,
):
    """Net displacement over a grid of the scene's parameters. What is done is kept if interrupted, and taken up again."""
    from geomech.output import plots, sweeps
    from geomech.study import kept
    from geomech.study import sweep as sweeping

    axes = {}
    for text in over:
        parameter, equals, values = text.partition("=")
        if not equals or parameter in axes:
            raise SceneError(f"--over {text!r}: give each parameter once, as PARAM=START:STOP:COUNT")
        axes[parameter] = spread(f"--over {parameter}", values)
    check_netcdf(out)
    if plot and len(axes) > 2:
        raise SceneError(f"cannot draw {len(axes)} parameters: sweep one or two, or leave --plot out")
    scene = _loaded(name, None, None)
    partial = kept.beside(out)
    check_outputs(scene, out, plot, partial)
    with terminal.progress(f"sweep of {scene.name}") as bar:
        allow(scene, sweeping.cost(scene, axes), yes)
        results = sweeping.sweep(scene, axes, partial, bar)
    try:
        sweeps.save(out, scene, results)
        if plot:
            plots.save(sweeps.draw(scene, results), plot)
    except BaseException as error:
        if partial.exists():
            error.add_note(f"what is done is kept in {partial}: the same command goes on from there")
        raise
    partial.unlink(missing_ok=True)
    net = plots.net(results["displacement"])
    print(f"{net.size} points, displacement {net.min():.6g} to {net.max():.6g} {scene.system.unit}, in {out}")


@app.command()
def explain(name: SceneArgument):
    """Which effects a scene asks for, the engine that follows, what each costs and what it takes away."""
    from geomech.output.explain import explain as told

    print(told(_loaded(name, None, None)))


@app.command()
def scenes(show: Annotated[Optional[str], typer.Option(metavar="NAME", help="print this scene's TOML")] = None):
    """The scenes that ship with the toolkit, and the named media."""
    import rft
    from geomech.scene import builtin_names, load

    if show is not None:
        print(load(choose("--show", show, builtin_names())).text, end="")
        return
    for scene_name in builtin_names():
        print(f"{scene_name:24} {load(scene_name).text.splitlines()[0].lstrip('# ')}")
    print("\nmedia for [medium] name = ...")
    for medium_name, entry in rft.CATALOGUE.items():
        print(f"{medium_name:24} {entry.source}")


def allow(scene, cost, yes: bool) -> None:
    """Say what is to come if it takes long; SceneError if it takes too long to be begun without --yes."""
    cost.check(scene.name, yes)
    if not cost.small:
        terminal.tell(f"{scene.name}: {cost}")


def _loaded(name: str, grid: int | None, extent: float | None):
    from geomech.scene import load

    return load(name).with_numerics(grid=grid, extent=extent)


def _field(name, grid, extent, output: Path, plot: Path | None, maps: bool, yes: bool):
    """The scene's study with its field computed, once its outputs are known to be writable. maps: they show shape space."""
    from geomech.study.bench import Study
    from geomech.study.cost import built, price
    from geomech.tiers import TIERS

    scene = _loaded(name, grid, extent)
    study, joints = Study(scene), scene.system.joints
    with named(scene.name):
        TIERS["path"].refuse(scene.system)
        if maps and joints != 2:
            raise SceneError(f"{scene.name}: maps of shape space take a body of two joints, this one has {joints}")
        check_outputs(scene, output, plot)
        allow(scene, price([built(scene, "path")]), yes)
    with terminal.progress(f"field of {scene.name}") as bar:
        study.compute_field(bar)
    return study


def main(argv: list[str] | None = None) -> None:
    """Entry point: one line on standard error and exit code 2 for what the user can mend, 128 + its number for a signal."""
    sys.exit(terminal.ended(app, (sys.argv[1:] if argv is None else argv) or ["--help"]))
