"""The order of every command: check, cost, store, compute, write, print. It is decided here alone."""

from __future__ import annotations

import contextlib
import json
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geomech import terminal
from geomech.core.errors import Note
from geomech.io.files import atomic_file, atomic_folder, note, refuse_inputs
from rft.refusal import Refusal

if TYPE_CHECKING:  # commands start without NumPy
    from geomech.core.variables import Result
    from geomech.run.cost import Cost
    from geomech.study.question import Question


@dataclass(frozen=True)
class Output:
    """A file that a command writes, or a folder that it fills; path: None where it is not asked for.

    check: refuses a name that cannot be one, such as of another format. said: a line that is printed behind the result."""

    path: Path | None
    write: Callable[[Result, Path], None]
    check: Callable[[Path], Any] = lambda path: None
    said: Callable[[Result, Path], str] | None = None
    folder: bool = False


def execute(
    question: Question, *outputs: Output, as_json: bool = False, yes: bool = False, silent: bool = False
) -> None:
    """Answer a question as a command does. silent: what is asked for is in its outputs, nothing is printed."""
    wanted = [output for output in outputs if output.path is not None]
    for output in wanted:
        output.check(output.path)
    inputs = question.inputs()
    question.check()
    _check_outputs(wanted, inputs)
    with contextlib.ExitStack() as under:
        bar = under.enter_context(_course(question, wanted, inputs, yes))
        places = [_place(output, inputs, under) for output in wanted]
        result = question.answer(bar, lambda cost: allow(question, cost, yes))
        for output, place in zip(wanted, places):
            output.write(result, place)
    for line in result.attributes.get("notes", ()):
        note(line)
    if not silent:
        _print(result, wanted, as_json)


def show(lines: Iterable[str]) -> None:
    """Print lines as they come."""
    for line in lines:
        print(line, flush=True)


def allow(question: Question, cost: Cost, yes: bool) -> None:
    """Say what is to come if it takes long or otherwise than expected; Refusal, which says what to do else, if it takes
    too long to be begun without --yes: here, or in its first second (`geomech.run.cost.decide`). From here on "auto" is the
    back end for that many balances."""
    from geomech.run.backend import prefer_for
    from geomech.run.cost import decide

    scene = question.scene

    def judge(cost: Cost) -> None:
        cost.check(scene.name, yes, question.less)
        if not cost.small or cost.seconds >= question.worth_saying:
            terminal.tell(f"{scene.name}: {cost}")

    prefer_for(cost.as_balances)
    decide(cost, judge)
    _note(scene)


def _note(scene: Any) -> None:
    """Say what is likely not meant, once a command."""
    from geomech.text.system import notes

    for line in notes(scene.system) if hasattr(scene, "system") else ():  # an intruder scene has no system
        warnings.warn(f"{scene.name}: {line}", Note, stacklevel=4)


def _check_outputs(outputs: list[Output], inputs: list[Path]) -> None:
    """Refusal unless all outputs can be written and none is an input, or another one."""
    files = [output.path for output in outputs if not output.folder]
    for k, path in enumerate(files):
        if path in files[:k]:
            raise Refusal(f"cannot write {path} twice", instead="give --plot, or another output, another name")
    refuse_inputs(files, inputs)
    for k, path in enumerate(files):
        refuse_inputs([path], files[:k])
        with contextlib.suppress(_Unused), atomic_file(path):
            raise _Unused


class _Unused(Exception):
    """Leaves `atomic_file` without writing."""


@contextlib.contextmanager
def _course(question: Question, outputs: list[Output], inputs: list[Path], yes: bool) -> Iterator[Callable]:
    """Show how far a question is, once its cost is allowed, and store what is done of it beside its first output or, of what
    is only printed, in the user's cache folder; the same command resumes from there."""
    with contextlib.ExitStack() as under:
        bar = under.enter_context(terminal.progress(question.title)) if hasattr(question, "scene") else _quiet
        cost = question.cost()
        if cost is None:
            _note(getattr(question, "scene", None))
        else:
            allow(question, cost, yes)
            under.enter_context(storing(question, next((output.path for output in outputs), None), inputs))
        yield bar


def behind(words: str) -> Callable[[Result, Path], str]:
    """Return what prints some words before an output's path."""
    return lambda result, path: f"{words} {path}"


def _quiet(done: float) -> None: ...


@contextlib.contextmanager
def storing(question: Question, output: Path | None, inputs: list[Path]) -> Iterator[None]:
    """Store what is computed in the body of the statement; at its end nothing is stored any more. Refusal while another
    computation to the output is under way."""
    from geomech.run import jobs, store
    from geomech.run.digest import digest

    context = jobs.context_of([x for x in inputs if x != Path(question.scene.name)])
    path = store.in_cache(digest(context, question)) if output is None else store.partial_file(output)
    refuse_inputs([path] if path else [], inputs)
    with jobs.storing(path, context, output):
        yield


def _place(output: Output, inputs: list[Path], under: contextlib.ExitStack) -> Path:
    """Return where an output is written: a folder is filled elsewhere, and appears whole or not at all."""
    return under.enter_context(atomic_folder(output.path, inputs)) if output.folder else output.path


def _print(result: Result, outputs: list[Output], as_json: bool) -> None:
    from geomech import text

    if as_json:
        print(json.dumps(text.numbers(result)))
        return
    print(text.text(result))
    for output in outputs:
        if output.said:
            print(output.said(result, output.path))
