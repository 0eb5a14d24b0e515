"""Options that commands share, and their parsers."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech.questions import texts
from geomech.questions.names import intruder_names, scene_names, walker_names
from rft.core.refusal import Refusal


def _scene(names: Callable[[], list[str]]):
    text = "built-in name (see 'geomech scenes') or TOML file"
    return typer.Argument(metavar="SCENE", help=text, autocompletion=names)


SceneArgument = Annotated[str, _scene(scene_names)]
IntruderArgument = Annotated[str, _scene(intruder_names)]
WalkerArgument = Annotated[str, _scene(walker_names)]
EitherArgument = Annotated[str, _scene(lambda: scene_names() + intruder_names())]
GridOption = Annotated[
    Optional[int],
    typer.Option(
        "--grid",
        metavar="N",
        help="points of the grid per joint, in place of the scene's",
    ),
]
PlotOption = Annotated[
    Optional[Path],
    typer.Option("--plot", metavar="FILE", help="draw a figure to .png, .pdf or .svg"),
]
MediumOption = Annotated[
    Optional[Path],
    typer.Option(
        "--medium",
        metavar="FILE",
        help="file of a medium or of drag, in place of the scene's",
    ),
]


def folder(text: str | Path) -> Path:
    """Return the folder of that name; an empty name is refused."""
    if not str(text):
        raise typer.BadParameter("an empty name: name a folder, '.' for this one")
    return Path(text)


FolderOption = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        metavar="DIR",
        help="folder to write the results to",
        parser=folder,
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON and nothing else")]
AllOption = Annotated[
    bool,
    typer.Option("--all", help="print all lines, not only those that fit a screen"),
]
YesOption = Annotated[
    bool,
    typer.Option("--yes", help="compute even if it takes over a minute or over 2 GB"),
]


OtherFrameOption = Annotated[
    Optional[str],
    typer.Option(
        "--compare-frame",
        metavar="FRAME",
        help="draw another body frame below, on the same scales",
    ),
]
ComponentOption = Annotated[
    Optional[str],
    typer.Option(
        "--component", metavar="NAMES", help="panels to draw, such as x or x,theta"
    ),
]
ClimOption = Annotated[
    Optional[str],
    typer.Option(
        "--clim",
        metavar="LIMIT",
        help="limit of the colours, a number or percentiles as 98% or 5%:95%",
    ),
]
DataOption = Annotated[
    Optional[Path],
    typer.Option(
        "--data",
        metavar="FILE.csv",
        help="draw points, of columns amplitude,value,error",
    ),
]
PairOption = Annotated[
    Optional[str],
    typer.Option(
        "--pair",
        metavar="I,J",
        help="joints on the axes, as 1,3; all pairs if left out",
    ),
]
SliceOption = Annotated[
    Optional[str],
    typer.Option(
        "--slice",
        metavar="ANGLES",
        help="angles of the joints that are held, as 0.3 or 0.3,-20deg",
    ),
]
PluginOption = Annotated[
    Optional[list[Path]],
    typer.Option(
        "--plugin",
        metavar="FILE.py",
        help="Python file with parts of your own, such as laws",
    ),
]


def load_plugins(files: list[Path] | None) -> None:
    """Let scenes name what is in the files; see `geomech.scenes.kinds.load_file`."""
    for path in files or ():
        from geomech.scenes.kinds import load_file

        load_file(path)


def with_plugins(command: Callable) -> Callable:
    """Return a command that also takes ``--plugin`` if it takes a scene; any other as it
    is."""
    signature = inspect.signature(command, eval_str=True)
    if (
        not {"name", "subject", "plugins"} & {*signature.parameters}
        or "plugin" in signature.parameters
    ):
        return command

    @functools.wraps(command)
    def run(plugin=None, **arguments):
        load_plugins(plugin)
        return command(**arguments)

    more = inspect.Parameter(
        "plugin", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=PluginOption
    )
    run.__signature__ = signature.replace(
        parameters=[*signature.parameters.values(), more]
    )
    run.__annotations__ = {
        p.name: p.annotation for p in run.__signature__.parameters.values()
    }
    return run


WorkersOption = Annotated[
    Optional[int],
    typer.Option(
        "--workers",
        metavar="N",
        help="processes for long computations, one a core if left out",
    ),
]
SchedulerOption = Annotated[
    Optional[str],
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask cluster to compute on, as tcp://10.0.0.1:8786",
    ),
]


def with_workers(command: Callable) -> Callable:
    """Return a command that also takes ``--workers`` and ``--scheduler`` (`geomech.run.workers`)."""

    @functools.wraps(command)
    def run(workers=None, scheduler=None, **arguments):
        from geomech.run.workers import using

        with using(workers, scheduler):
            return command(**arguments)

    signature = inspect.signature(command, eval_str=True)
    more = {"workers": WorkersOption, "scheduler": SchedulerOption}
    last = [
        inspect.Parameter(k, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=a)
        for k, a in more.items()
    ]
    run.__signature__ = signature.replace(
        parameters=[*signature.parameters.values(), *last]
    )
    run.__annotations__ = {
        p.name: p.annotation for p in run.__signature__.parameters.values()
    }
    return run


def an_angle(text: str | float) -> float:
    """Return an option that is an angle, 2.5 or 120deg, in rad."""
    try:
        return texts.number(str(text), None)
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is no angle: give one such as 2.5 (rad) or 120deg"
        ) from None


ExtentOption = Annotated[
    Optional[float],
    typer.Option(
        "--extent",
        metavar="ANGLE",
        help="half width of the grid in rad, or as 120deg",
        parser=an_angle,
    ),
]


def refuse_without_figure(plot: Path | None, **options: object) -> None:
    """Refuse options of a figure where none is drawn."""
    if plot is None and (
        names := [f"--{name}" for name, value in options.items() if value is not None]
    ):
        what = (
            f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} for a figure"
        )
        raise Refusal(what, instead="say --plot FILE, too")
