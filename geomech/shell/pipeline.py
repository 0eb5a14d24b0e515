"""The order of every command: check, cost, store, compute, write, print. It is decided
here alone."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geomech.core.summary import wrapped
from geomech.core.variables import Result
from geomech.io.files import atomic_file, atomic_folder, note, refuse_inputs
from geomech.questions.shared.base import Question, Run, ignore
from geomech.results import show
from geomech.results.lengths import in_lengths
from geomech.runs.backend import prefer_for
from geomech.runs.cost import Cost, decide
from geomech.shell import terminal
from rft.core.notes import warn
from rft.core.refusal import Refusal, in_line, spell_arguments

MORE = "--all prints all variables"


@dataclass(frozen=True)
class Output:
    """A file that a command writes, or a folder that it fills.

    write: a function of a result and a path."""

    path: Path
    write: Callable[[Result, Path], Any]
    folder: bool = False


def execute(
    question: Question,
    outputs: Sequence[Output],
    *,
    as_json: bool = False,
    yes: bool = False,
    everything: bool = False,
    unit: str | None = None,
) -> None:
    """Answer a question as a command does.

    yes: whatever it costs. everything: all of the result is printed, not only what its
    kind shows first. unit: of lengths in what is printed; JSON keeps the scene's."""
    yes = yes or question.unlimited
    inputs = question.inputs()
    question.check()
    refuse_unwritable(outputs, inputs)
    with contextlib.ExitStack() as stack:
        progress = stack.enter_context(computing(question, outputs, inputs, yes))
        places = [stack.enter_context(place(output, inputs)) for output in outputs]

        def allow_more(cost: Cost) -> None:
            allow(question, cost, yes)

        result = question.answer(Run(progress, allow_more, limited=not yes))
        for output, path in zip(outputs, places):
            output.write(result, path)
    for line in notes_of(result):
        note(line)
    shown = result
    if unit is not None and not as_json:
        shown = in_lengths(result, unit)
    print("\n".join(printed(shown, as_json, everything)))
    if question.folder and not as_json:
        print("\n".join(contents(output.path for output in outputs if output.folder)))


def notes_of(result: Result) -> list[str]:
    """Return the notes of a result, which a command prints on standard error."""
    if "note" not in result:
        return []
    return [
        spell_arguments(line, terminal.option)
        for line in result["note"].values.tolist()
    ]


def printed(result: Result, as_json: bool, everything: bool) -> list[str]:
    """Return the lines that a command prints."""
    if as_json:
        return [json.dumps(result.to_dict())]
    lines = show.lines(result, everything)
    if everything:
        return lines
    if show.leaves_out(result):
        lines.append(MORE)
    return wrapped(lines)


def contents(folders: Iterable[Path]) -> list[str]:
    """Return lines that name the files of folders."""
    lines = []
    for folder in folders:
        names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
        lines.append(f"files in {in_line(folder)}: {', '.join(map(in_line, names))}")
    return wrapped(lines)


# Cost and progress


@contextlib.contextmanager
def computing(
    question: Question, outputs: Sequence[Output], inputs: list[Path], yes: bool
) -> Iterator[Callable]:
    """Yield the function that shows the progress of a question, once its cost is
    allowed.

    Finished tasks are stored next to its first output or, of results that are only
    printed, in the user's cache folder; the same command resumes from there."""
    with contextlib.ExitStack() as stack:
        progress = ignore
        if takes_time(question):
            progress = stack.enter_context(terminal.progress(question.title))
        cost = question.cost()
        if cost is None:
            note_system(question)
        else:
            allow(question, cost, yes)
            first = next((output.path for output in outputs), None)
            stack.enter_context(storing(question, first, inputs))
        yield progress


def takes_time(question: Question) -> bool:
    """Return whether progress is shown; of questions about measurements and media it is
    not."""
    return hasattr(question, "scene") or question.subject is None


def allow(question: Question, cost: Cost, yes: bool) -> None:
    """Print the cost of a question if it takes long; Refusal, with what to do instead,
    if it takes too long to begin without --yes: here, or in its first second
    (`geomech.runs.cost.decide`). From here on "auto" is the back end that its balances
    are worth."""
    name = question.subject_name

    def judge(cost: Cost) -> None:
        cost.check(name, yes, question.cheaper_alternative)
        if not cost.small or cost.seconds >= question.report_above:
            terminal.report(f"{name}: {cost}")

    prefer_for(cost.numpy_seconds)
    decide(cost, judge)
    note_system(question)


def note_system(question: Question) -> None:
    """Warn of what is likely not meant, once per command. An intruder scene has no
    system."""
    from geomech.shell.describe.system import notes

    scene = question.subject
    if not hasattr(scene, "system"):
        return
    for line in notes(scene.system):
        warn(f"{scene.name}: {line}")


@contextlib.contextmanager
def storing(
    question: Question, output: Path | None, inputs: list[Path]
) -> Iterator[None]:
    """Store the results of tasks that run in the body of the statement; at its end they
    are removed. Refusal while another computation for the output is running."""
    from geomech.runs import runner, store
    from geomech.runs.digest import digest

    scene = Path(question.subject_name)
    context = runner.digest_context([x for x in inputs if x != scene])
    if output is None:
        path = store.cache_file(digest(context, question))
    else:
        path = store.partial_file(output)
    if path is not None:
        refuse_inputs([path], inputs)
    with runner.store_results(path, context, output):
        yield


# Outputs


def refuse_unwritable(outputs: Sequence[Output], inputs: list[Path]) -> None:
    """Refuse outputs that cannot be written, that are inputs, or that are named
    twice."""
    files = [output.path for output in outputs if not output.folder]
    # Links may lead to a file that is not there yet.
    real = [os.path.realpath(path) for path in files]
    for k, path in enumerate(files):
        if real[k] in real[:k]:
            raise Refusal(
                f"cannot write {path} twice",
                instead="give --plot or the other output another name",
            )
    refuse_inputs(files, inputs)
    for k, path in enumerate(files):
        refuse_inputs([path], files[:k])
        with contextlib.suppress(_Unused), atomic_file(path):
            raise _Unused


class _Unused(Exception):
    """Leaves `atomic_file` without writing."""


@contextlib.contextmanager
def place(output: Output, inputs: list[Path]) -> Iterator[Path]:
    """Yield the path to write to: a folder is filled elsewhere, and appears complete or
    not at all."""
    if not output.folder:
        yield output.path
        return
    with atomic_folder(output.path, inputs) as path:
        yield path
