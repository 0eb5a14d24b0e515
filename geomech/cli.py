"""The command line: geomech run, velocity, connection, ccf, displacement, accuracy, sweep, explain, scenes."""

from __future__ import annotations

import contextlib
import json
import logging
import math
import os
import re
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.errors import SceneError, choose, named
from geomech.files import refuse_inputs, whole_file, whole_folder

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="Geometric mechanics of locomotion in sand and fluid: from a force law to the displacement of a gait.",
)  # fmt: skip

DEFAULT_SCENE = "three-link-glass"
SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="a built-in name (see 'geomech scenes') or a TOML file")
]
GridOption = Annotated[Optional[int], typer.Option("--grid", help="points per joint, in place of the scene's")]
ExtentOption = Annotated[Optional[float], typer.Option("--extent", help="half width of the field in rad")]
PlotOption = Annotated[Optional[Path], typer.Option("--plot", metavar="FILE", help="figure: .png, .pdf or .svg")]


def _folder(text: str | Path) -> Path:
    if not str(text):
        raise typer.BadParameter("an empty name: name a folder, '.' for this one")
    return Path(text)


FolderOption = Annotated[
    Path, typer.Option("-o", "--output", metavar="DIR", help="folder for the results", parser=_folder)
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON and nothing else")]
YesOption = Annotated[bool, typer.Option("--yes", help="compute even for more than a minute, or in more than 2 GB")]
PATIENCE = 2.0  # s after a signal in which further ones are not heeded: what is done is being kept


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
    with whole_folder(out, inputs(scene)) as folder, progress(f"field of {scene.name}") as bar:
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
        out = scene.system.single(_numbers("--alpha", alpha), _numbers("--alphadot", alphadot))
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

    _is_netcdf(out)
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

    values = _sweep("--amplitudes", amplitudes)
    chosen = [choose("--methods", m.strip(), METHODS) for m in methods.split(",")] if methods is not None else None
    scene = _loaded(name, grid, extent)
    _check_outputs(scene, None, plot)
    with progress(f"displacement of {scene.name}") as bar:
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
    with whole_folder(out, inputs(scene)) as folder, progress(f"accuracy of {scene.name}") as bar:
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
    from geomech.output import plots
    from geomech.study import kept
    from geomech.study import sweep as sweeping

    axes = {}
    for text in over:
        parameter, equals, values = text.partition("=")
        if not equals or parameter in axes:
            raise SceneError(f"--over {text!r}: give each parameter once, as PARAM=START:STOP:COUNT")
        axes[parameter] = _sweep(f"--over {parameter}", values)
    _is_netcdf(out)
    if plot and len(axes) > 2:
        raise SceneError(f"cannot draw {len(axes)} parameters: sweep one or two, or leave --plot out")
    scene = _loaded(name, None, None)
    partial = kept.beside(out)
    _check_outputs(scene, out, plot, partial)
    with progress(f"sweep of {scene.name}") as bar:
        allow(scene, sweeping.cost(scene, axes), yes)
        results = sweeping.sweep(scene, axes, partial, bar)
    try:
        sweeping.save(out, scene, results)
        if plot:
            plots.save(sweeping.draw(scene, results), plot)
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
        _tell(f"{scene.name}: {cost}")


@contextlib.contextmanager
def progress(title: str):
    """A function that takes the fraction done: a bar on a terminal, nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda fraction: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


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
        _check_outputs(scene, output, plot)
        allow(scene, price([built(scene, "path")]), yes)
    with progress(f"field of {scene.name}") as bar:
        study.compute_field(bar)
    return study


def _is_netcdf(path: Path) -> None:
    if path.suffix != ".nc":
        raise SceneError(f"cannot write {path}: end the name of a NetCDF file in .nc")


def _check_outputs(scene, output: Path | None, plot: Path | None, *more: Path) -> None:
    """SceneError unless the output and the plot can be written and are, like ``more``, no input of the scene."""
    from geomech.output import plots
    from geomech.scene import inputs

    if plot:
        plots.check_format(plot)
    outputs = list(filter(None, {output, plot}))
    refuse_inputs([*outputs, *more], inputs(scene))
    if len(outputs) == 2:
        refuse_inputs(outputs[:1], outputs[1:])
    for path in outputs:
        with contextlib.suppress(_Unused), whole_file(path):
            raise _Unused


class _Unused(Exception):
    """Leaves `whole_file` without writing."""


def _numbers(option: str, text: str, count: int | None = None) -> list[float]:
    try:
        values = [float(x) for x in text.split(",")]
        if count not in (None, len(values)):
            raise ValueError
    except ValueError:
        raise SceneError(
            f"{option}: {text!r} is not {'a number' if count else 'a list of numbers such as 0.5,0.3'}"
        ) from None
    return values


def _sweep(option: str, text: str) -> list[float]:
    """0.5,1.0 or START:STOP:COUNT, all finite."""
    parts = text.split(":")
    if len(parts) == 1:
        values = _numbers(option, text)
    elif len(parts) == 3 and re.fullmatch(r"[1-9]\d{0,4}", parts[2]):
        (start,), (stop,), count = _numbers(option, parts[0], 1), _numbers(option, parts[1], 1), int(parts[2])
        values = [start + (stop - start) * k / max(1, count - 1) for k in range(count)]
    else:
        raise SceneError(f"{option}: {text!r} is neither a list such as 0.5,1.0 nor START:STOP:COUNT such as 0.2:2:10")
    if not all(map(math.isfinite, values)):
        raise SceneError(f"{option}: {text!r} must be finite")
    return values


class Stopped(BaseException):
    """A signal asked to stop."""

    def __init__(self, number: int):
        self.name, self.code = signal.Signals(number).name, 128 + number


@contextlib.contextmanager
def stoppable():
    """INT, TERM and HUP raise `Stopped`, so that nothing half-written stays behind. Those that are ignored, as HUP is under
    nohup, stay so."""
    heard = [-math.inf]

    def stop(number, frame):
        if time.monotonic() > heard[0] + PATIENCE:
            heard[0] = time.monotonic()
            raise Stopped(number)

    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {n: signal.getsignal(n) for n in numbers if threading.current_thread() is threading.main_thread()}
    before = {n: handler for n, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    for n in before:
        signal.signal(n, stop)
    try:
        yield
    finally:
        for n, handler in before.items():
            signal.signal(n, handler)


def main(argv: list[str] | None = None) -> None:
    """Entry point: one line on standard error and exit code 2 for what the user can mend, 128 + its number for a signal."""
    with stoppable():
        _any_letters()
        code = _run(argv)
    sys.exit(code)


def _run(argv: list[str] | None) -> int:
    try:
        code = app(args=(sys.argv[1:] if argv is None else argv) or ["--help"], standalone_mode=False)
        if code == 130:  # an interrupt that typer caught
            raise KeyboardInterrupt
        if sys.stdout:
            sys.stdout.flush()
        return code or 0
    except SystemExit as ended:  # what typer makes of a closed pipe
        return _unheard() if isinstance(ended.__context__, BrokenPipeError) else ended.code
    except (Stopped, KeyboardInterrupt, typer.Abort) as stopped:
        return _stopped(stopped)
    except MemoryError:
        _tell("error: not enough memory: lower the grid, the phases or the number of amplitudes")
    except BrokenPipeError:
        return _unheard()
    except Exception as error:
        text = error.format_message() if hasattr(error, "format_message") else str(error)
        if not isinstance(error, (ValueError, OSError, RuntimeError)) and not hasattr(error, "format_message"):
            raise
        _tell("error: " + "; ".join([text, *getattr(error, "__notes__", ())]))
        if isinstance(error, OSError):
            _deaf(sys.stdout)
    return 2


def _stopped(by: BaseException) -> int:
    kept = " ".join(getattr(by, "__notes__", ())) or "nothing is kept"
    _tell(f"error: stopped by {getattr(by, 'name', 'SIGINT')}: {kept}")
    return getattr(by, "code", 130)


def _unheard() -> int:
    """What we said was not wanted to the end: `geomech scenes | head -1`. Files are written by then: no failure."""
    _deaf(sys.stdout)
    return 0


def _tell(text: str) -> None:
    """One line on standard error, if anybody listens."""
    try:
        print(" ".join(text.split()), file=sys.stderr, flush=True)
    except OSError:
        _deaf(sys.stderr)


def _deaf(stream) -> None:
    """Lead a stream that cannot be written to nowhere, so that Python does not complain of it at the end."""
    with contextlib.suppress(AttributeError, OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _any_letters() -> None:
    """What a terminal has no letters for is escaped, and matplotlib keeps its folders to itself: nothing fails for the sake
    of what is said beside the results."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="backslashreplace")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        Path.home()
    except RuntimeError:  # nowhere: matplotlib then takes a temporary folder if it is told of one that cannot be
        os.environ.setdefault("MPLCONFIGDIR", os.devnull)
