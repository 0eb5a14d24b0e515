"""geomech accuracy."""

from __future__ import annotations

from pathlib import Path

from geomech.commands.options import (
    EitherArgument,
    FolderOption,
    JsonOption,
    YesOption,
    with_workers,
)
from geomech.commands.pipeline import Output, execute
from geomech.questions.loading import load_any


@with_workers
def accuracy(
    name: EitherArgument,
    out: FolderOption = Path("accuracy"),
    as_json: JsonOption = False,
    yes: YesOption = False,
):
    """Measure error against time for every tier and setting. The cheapest settings that meet an error are
    listed. The settings of an intruder scene are numbers of elements or triangles; of a robot, steps, elements and rounding."""
    from geomech.output import report
    from geomech.studies.accuracy import Accuracy

    folder = Output(out, report.write_accuracy, message=report.files, folder=True)
    execute(Accuracy(load_any(name)), folder, as_json=as_json, yes=yes)
