"""The order of every command: check, cost, store, compute, write, print. It is decided here alone."""

from __future__ import annotations

import contextlib
import json
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geomech import terminal
from geomech.core.errors import Note
from geomech.io.files import atomic_file, atomic_folder, note, refuse_inputs
from rft.refusal import Refusal, in_line

if TYPE_CHECKING:  # commands start without NumPy
    from geomech.core.variables import Result
    from geomech.run.cost import Cost
    from geomech.studies.question import Question


@dataclass(frozen=True)
class Output:
    """A file that a command writes, or a folder that it fills.

    path: None where it is not requested. check: refuses a name that cannot be one, such as of another format. message: builds
    the line that is printed after the result."""

    path: Path | None
    write: Callable[[Result, Path], None]
    check: Callable[[Path], Any] = lambda path: None
    message: Callable[[Result, Path], str] | None = None
    folder: bool = False


def drawing(function: str, **options: Any) -> Callable:
    """Return a function of a module of `geomech.output`, such as "pictures.sweep", with some arguments by keyword, imported at
    its first call: a command without pictures loads nothing that draws."""
    module, name = function.split(".")

    def call(*arguments: Any) -> Any:
        return getattr(import_module(f"geomech.output.{module}"), name)(
            *arguments, **options
        )

    return call


def execute(
    question: Question,
    *outputs: Output,
    as_json: bool = False,
    yes: bool = False,
    everything: bool = False,
) -> None:
    """Answer a question as a command does: check, cost, compute, write, print.

    yes: whatever it costs. everything: all lines of a result are printed, not only those that fit a screen."""
    requested = [output for output in outputs if output.path is not None]
    for output in requested:
        output.check(output.path)
    inputs = question.inputs()
    question.check()
    _check_outputs(requested, inputs)
    with contextlib.ExitStack() as stack:
        bar = stack.enter_context(_computing(question, requested, inputs, yes))
        places = [_place(output, inputs, stack) for output in requested]
        result = question.answer(bar, lambda cost: allow(question, cost, yes))
        for output, place in zip(requested, places):
            output.write(result, place)
    for line in result.attributes.get("notes", ()):
        note(line)
    _print(result, requested, as_json, everything)


def show(lines: Iterable[str]) -> None:
    """Print lines as they come."""
    for line in lines:
        print(line, flush=True)


def allow(question: Question, cost: Cost, yes: bool) -> None:
    """Print the cost of a question if it takes long; Refusal, with what to do instead, if it takes too long to begin without
    --yes: here, or in its first second (`geomech.run.cost.decide`). From here on "auto" is the back end for that many
    balances."""
    from geomech.run.backend import prefer_for
    from geomech.run.cost import decide

    scene = question.scene

    def judge(cost: Cost) -> None:
        cost.check(scene.name, yes, question.less)
        if not cost.small or cost.seconds >= question.worth_saying:
            terminal.report(f"{scene.name}: {cost}")

    prefer_for(cost.as_balances)
    decide(cost, judge)
    _note(scene)


def _note(scene: Any) -> None:
    """Warn of what is likely not meant, once a command."""
    from geomech.text.system import notes

    for line in (
        notes(scene.system) if hasattr(scene, "system") else ()
    ):  # an intruder scene has no system
        warnings.warn(f"{scene.name}: {line}", Note, stacklevel=4)


def _check_outputs(outputs: list[Output], inputs: list[Path]) -> None:
    """Refusal unless all outputs can be written and none is an input, or another one."""
    files = [output.path for output in outputs if not output.folder]
    for k, path in enumerate(files):
        if path in files[:k]:
            raise Refusal(
                f"cannot write {path} twice",
                instead="give --plot, or another output, another name",
            )
    refuse_inputs(files, inputs)
    for k, path in enumerate(files):
        refuse_inputs([path], files[:k])
        with contextlib.suppress(_Unused), atomic_file(path):
            raise _Unused


class _Unused(Exception):
    """Leaves `atomic_file` without writing."""


@contextlib.contextmanager
def _computing(
    question: Question, outputs: list[Output], inputs: list[Path], yes: bool
) -> Iterator[Callable]:
    """Show the progress of a question, once its cost is allowed, and store finished tasks next to its first output or, of
    results that are only printed, in the user's cache folder; the same command resumes from there."""
    with contextlib.ExitStack() as stack:
        bar = (
            stack.enter_context(terminal.progress(question.title))
            if hasattr(question, "scene")
            else _quiet
        )
        cost = question.cost()
        if cost is None:
            _note(getattr(question, "scene", None))
        else:
            allow(question, cost, yes)
            stack.enter_context(
                storing(
                    question, next((output.path for output in outputs), None), inputs
                )
            )
        yield bar


def path_message(words: str) -> Callable[[Result, Path], str]:
    """Return the message of an output: some words before its path."""
    return lambda result, path: f"{words} {in_line(path)}"


def _quiet(fraction: float) -> None: ...


@contextlib.contextmanager
def storing(
    question: Question, output: Path | None, inputs: list[Path]
) -> Iterator[None]:
    """Store the results of tasks that run in the body of the statement; at its end they are removed. Refusal while another
    computation for the output is running."""
    from geomech.run import jobs, store
    from geomech.run.digest import digest

    context = jobs.context_of([x for x in inputs if x != Path(question.scene.name)])
    path = (
        store.in_cache(digest(context, question))
        if output is None
        else store.partial_file(output)
    )
    refuse_inputs([path] if path else [], inputs)
    with jobs.storing(path, context, output):
        yield


def _place(output: Output, inputs: list[Path], stack: contextlib.ExitStack) -> Path:
    """Return the path to write to: a folder is filled elsewhere, and appears whole or not at all."""
    return (
        stack.enter_context(atomic_folder(output.path, inputs))
        if output.folder
        else output.path
    )


def _print(
    result: Result, outputs: list[Output], as_json: bool, everything: bool
) -> None:
    from geomech import text
    from geomech.core.summary import wrapped

    if as_json:
        print(json.dumps(text.numbers(result)))
        return
    lines = (text.full if everything else text.text)(result).splitlines()
    lines += [more] if not everything and (more := text.more(result)) else []
    lines += [
        output.message(result, output.path) for output in outputs if output.message
    ]
    print("\n".join(lines if everything else wrapped(lines)))
