"""What commands share: options, and what they must be; a scene and its field, loaded and asked for."""

from __future__ import annotations

import contextlib
import math
import re
from pathlib import Path
from typing import Annotated, Optional

import typer

from geomech import terminal
from geomech.errors import SceneError, named
from geomech.files import refuse_inputs, whole_file

SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="a built-in name (see 'geomech scenes') or a TOML file")
]
GridOption = Annotated[Optional[int], typer.Option("--grid", help="points per joint, in place of the scene's")]
ExtentOption = Annotated[Optional[float], typer.Option("--extent", help="half width of the field in rad")]
PlotOption = Annotated[Optional[Path], typer.Option("--plot", metavar="FILE", help="figure: .png, .pdf or .svg")]


def folder(text: str | Path) -> Path:
    """The folder of that name; an empty one is refused."""
    if not str(text):
        raise typer.BadParameter("an empty name: name a folder, '.' for this one")
    return Path(text)


FolderOption = Annotated[
    Path, typer.Option("-o", "--output", metavar="DIR", help="folder for the results", parser=folder)
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON and nothing else")]
YesOption = Annotated[bool, typer.Option("--yes", help="compute even for more than a minute, or in more than 2 GB")]


def check_netcdf(path: Path) -> None:
    """SceneError for a name that does not end in .nc."""
    if path.suffix != ".nc":
        raise SceneError(f"cannot write {path}: end the name of a NetCDF file in .nc")


def check_outputs(scene, output: Path | None, plot: Path | None, *more: Path) -> None:
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


def numbers(option: str, text: str, count: int | None = None) -> list[float]:
    """0.5,0.3, as many as ``count`` if that is given."""
    try:
        values = [float(x) for x in text.split(",")]
        if count not in (None, len(values)):
            raise ValueError
    except ValueError:
        raise SceneError(
            f"{option}: {text!r} is not {'a number' if count else 'a list of numbers such as 0.5,0.3'}"
        ) from None
    return values


def spread(option: str, text: str) -> list[float]:
    """0.5,1.0 or START:STOP:COUNT, all finite."""
    parts = text.split(":")
    if len(parts) == 1:
        values = numbers(option, text)
    elif len(parts) == 3 and re.fullmatch(r"[1-9]\d{0,4}", parts[2]):
        (start,), (stop,), count = numbers(option, parts[0], 1), numbers(option, parts[1], 1), int(parts[2])
        values = [start + (stop - start) * k / max(1, count - 1) for k in range(count)]
    else:
        raise SceneError(f"{option}: {text!r} is neither a list such as 0.5,1.0 nor START:STOP:COUNT such as 0.2:2:10")
    if not all(map(math.isfinite, values)):
        raise SceneError(f"{option}: {text!r} must be finite")
    return values


def allow(scene, cost, yes: bool) -> None:
    """Say what is to come if it takes long; SceneError if it takes too long to be begun without --yes."""
    cost.check(scene.name, yes)
    if not cost.small:
        terminal.tell(f"{scene.name}: {cost}")


def loaded(name: str, grid: int | None = None, extent: float | None = None):
    """The scene of that name, with the options of its field."""
    from geomech.scene import load

    return load(name).with_numerics(grid=grid, extent=extent)


def field(name, grid, extent, output: Path, plot: Path | None, maps: bool, yes: bool):
    """The scene's study with its field computed, once its outputs are known to be writable. maps: they show shape space."""
    from geomech.study.bench import Study
    from geomech.study.cost import built, price
    from geomech.tiers import TIERS

    scene = loaded(name, grid, extent)
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
