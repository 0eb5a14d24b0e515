"""Options of commands besides the fields of their questions: plug-ins, workers, and
changes of a scene."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Optional

import typer

from geomech.questions.shared import texts
from geomech.questions.shared.base import SCENE_HELP
from geomech.questions.shared.names import scene_names

ADVANCED = "Advanced"  # heading, in a help, of the options that few need

SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help=SCENE_HELP, autocompletion=scene_names)
]
YesOption = Annotated[
    bool,
    typer.Option(
        "--yes",
        help="compute even if it takes over a minute or over 2 GB",
        rich_help_panel=ADVANCED,
    ),
]

# Changes of a scene


def parse_angle(text: str | float) -> float:
    """Return an option that is an angle, 2.5 or 120deg, in rad."""
    try:
        return texts.parse_number(str(text), None)
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is not an angle: write one such as 2.5 (rad) or 120deg"
        ) from None


GridOption = Annotated[
    Optional[int],
    typer.Option(
        "--grid",
        metavar="N",
        help="points of the grid per joint, instead of the scene's",
        rich_help_panel=ADVANCED,
    ),
]
ExtentOption = Annotated[
    Optional[float],
    typer.Option(
        "--extent",
        metavar="ANGLE",
        help="half width of the grid: 2.5 (rad) or 120deg",
        rich_help_panel=ADVANCED,
        parser=parse_angle,
    ),
]
MediumOption = Annotated[
    Optional[Path],
    typer.Option(
        "--medium",
        metavar="FILE",
        help="file of a medium or of drag, instead of the scene's",
    ),
]

# Plug-ins


PluginOption = Annotated[
    Optional[list[Path]],
    typer.Option(
        "--plugin",
        metavar="FILE.py",
        help="Python file with your own parts, such as laws",
        rich_help_panel=ADVANCED,
    ),
]
SUBJECTS = {"name", "subject"}  # first arguments of commands that take plug-ins


def load_plugins(files: list[Path] | None) -> None:
    """Let scenes name what is in the files; see `geomech.scenes.kinds.load_file`."""
    for path in files or ():
        from geomech.scenes.kinds import load_file

        load_file(path)


def with_plugins(command: Callable) -> Callable:
    """Return a command that also takes ``--plugin`` if it is about a scene; any other
    as it is."""
    names = {*inspect.signature(command).parameters}
    if not SUBJECTS & names or "plugin" in names:
        return command

    def run(plugin: list[Path] | None = None, **arguments: Any) -> Any:
        load_plugins(plugin)
        return command(**arguments)

    return extended(run, command, {"plugin": PluginOption})


# Processes

WorkersOption = Annotated[
    Optional[int],
    typer.Option(
        "--workers",
        metavar="N",
        help="processes for long computations (default one per core)",
        rich_help_panel=ADVANCED,
    ),
]
SchedulerOption = Annotated[
    Optional[str],
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask cluster, such as tcp://10.0.0.1:8786",
        rich_help_panel=ADVANCED,
    ),
]


def with_workers(command: Callable) -> Callable:
    """Return a command that also takes ``--workers`` and ``--scheduler``
    (`geomech.runs.workers`)."""

    def run(
        workers: int | None = None, scheduler: str | None = None, **arguments: Any
    ) -> Any:
        from geomech.runs.workers import using

        with using(workers, scheduler):
            return command(**arguments)

    more = {"workers": WorkersOption, "scheduler": SchedulerOption}
    return extended(run, command, more)


def extended(run: Callable, command: Callable, more: dict[str, Any]) -> Callable:
    """Return ``run`` as a command with the parameters of another one and more
    options."""
    functools.update_wrapper(run, command)
    signature = inspect.signature(command, eval_str=True)
    parameters = [*signature.parameters.values()]
    for name, annotation in more.items():
        parameters.append(
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=annotation,
            )
        )
    run.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=parameters
    )
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run
