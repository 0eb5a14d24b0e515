"""geomech accuracy."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from geomech.commands.options import (
    EitherArgument,
    FolderOption,
    JsonOption,
    YesOption,
    with_workers,
)
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_any
from rft.refusal import in_line

if TYPE_CHECKING:
    from geomech.core.variables import Result


@with_workers
def accuracy(
    name: EitherArgument,
    out: FolderOption = Path("accuracy"),
    as_json: JsonOption = False,
    yes: YesOption = False,
):
    """Measure error against time for every tier and setting. The cheapest settings that meet an error are
    listed. The settings of an intruder scene are numbers of elements or triangles; of a robot, steps, elements and rounding."""
    from geomech.studies.accuracy import Accuracy

    folder = Output(out, write, message=files, folder=True)
    execute(Accuracy(load_any(name)), folder, as_json=as_json, yes=yes)


def write(result: Result, folder: Path) -> None:
    """Write an accuracy study into a folder."""
    from geomech import plots, text
    from geomech.studies.accuracy import table

    numbers = table(result)
    (folder / "accuracy.json").write_text(json.dumps(numbers, indent=1) + "\n")
    (folder / "accuracy.txt").write_text(
        text.text(result) + "\n", encoding="utf-8", errors="backslashreplace"
    )
    draw: Callable = getattr(plots, result.subject.picture)
    stem = folder / "accuracy"
    plots.save(draw(numbers), *(stem.with_suffix(end) for end in (".png", ".pdf")))


def files(result: Result, folder: Path) -> str:
    """Return the names of the files in a folder."""
    names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    return f"files in {in_line(folder)}: {', '.join(map(in_line, names))}"
