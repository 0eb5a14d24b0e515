"""The order of every command: check, cost, store, compute, write, print. It is decided here alone."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geomech.io.files import atomic_folder, note
from geomech.pipeline import allow, computing, refuse_unwritable
from rft.core.refusal import in_line

if TYPE_CHECKING:  # commands start without NumPy
    from geomech.core.variables import Result
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
    refuse_unwritable(requested, inputs)
    with contextlib.ExitStack() as stack:
        bar = stack.enter_context(computing(question, requested, inputs, yes))
        places = [_place(output, inputs, stack) for output in requested]
        result = question.answer(bar, lambda cost: allow(question, cost, yes))
        for output, place in zip(requested, places):
            output.write(result, place)
    for line in result.attributes.get("notes", ()):
        note(line)
    _print(result, requested, as_json, everything)


def path_message(words: str) -> Callable[[Result, Path], str]:
    """Return the message of an output: some words before its path."""
    return lambda result, path: f"{words} {in_line(path)}"


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
