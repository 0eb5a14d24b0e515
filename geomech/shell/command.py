"""The command of a question, built from its declaration."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Optional

import typer

from geomech.questions.shared import base, looks
from geomech.questions.shared.base import Declared, Option, Question
from geomech.shell import pipeline
from geomech.shell.options import (
    ADVANCED,
    ExtentOption,
    GridOption,
    MediumOption,
)
from rft.core.refusal import Refusal

CHANGES = {"grid": GridOption, "extent": ExtentOption, "medium": MediumOption}
ENDINGS = (".nc", ".json", ".csv", ".mat", ".txt")  # of `geomech.results.files.WRITERS`
IN_FOLDER = (".json", ".csv", ".nc", ".txt")  # formats that fill a folder
PICTURES = (".png", ".pdf", ".svg")  # those of --plot
FOLDER = ""  # in place of an ending
FIGURE = "Figure, with --plot"  # heading of the options that pictures share
PRINTED = "unit"  # the shared option that changes what is printed as well
SUBJECT = "subject"  # name of the first argument in the function of a command


class Declaration(NamedTuple):
    """All that the command of a question takes.

    fields: its own options. picture: options of its picture. look: those that pictures
    share. files: options of its files by ending, and by FOLDER those of the folder that
    its command fills."""

    question: type[Question]
    subject: base.Subject | None
    fields: Declared
    picture: Declared
    look: Declared
    files: dict[str, Declared]

    @property
    def all_files(self) -> Declared:
        """Options of files of every ending."""
        found = {}
        for options in self.files.values():
            found.update(options)
        return found


def declaration(question: type[Question]) -> Declaration:
    """Return what the command of a question takes."""
    _, subject = base.subject_field(question)
    files = file_options(question, question.own_files())
    return Declaration(
        question,
        subject,
        base.options(question),
        base.keyword_options(question.draw),
        looks.look_options(question),
        files,
    )


def file_options(
    question: type[Question], writers: dict[str, Callable]
) -> dict[str, Declared]:
    """Return the options of functions that write files, by ending, and of the one that
    fills the question's folder."""
    found = {end: base.keyword_options(write) for end, write in writers.items()}
    if question.folder:
        found[FOLDER] = base.keyword_options(question.fill)
    return found


def command(question: type[Question]) -> Callable[..., None]:
    """Return the command of a question as a function that typer reads."""
    declared = declaration(question)

    def run(**given: Any) -> None:
        instance, outputs = request(declared, given)
        pipeline.execute(
            instance,
            outputs,
            as_json=given["as_json"],
            yes=given["yes"],
            everything=given["everything"],
            unit=given.get("unit"),
        )

    signature = inspect.Signature(parameters(declared))
    run.__name__ = question.name
    run.__doc__ = question.__doc__
    run.__signature__ = signature  # type: ignore[attr-defined]
    run.__annotations__ = {
        name: parameter.annotation for name, parameter in signature.parameters.items()
    }
    return run


# Parameters


def parameters(declared: Declaration) -> list[inspect.Parameter]:
    """Return the parameters of a command in the order of its help: the subject, the
    question's own, those that change the subject, those of pictures and files, and
    those of every command."""
    found = []
    changes: tuple[str, ...] = ()
    if declared.subject is not None:
        found.append(subject_parameter(declared.subject))
        changes = declared.subject.changes
    for name, declaration in declared.fields.items():
        found.append(option_parameter(name, *declaration))
    for name in changes:
        found.append(parameter(name, CHANGES[name], None))
    files_alone = without(declared.all_files, declared.picture)
    for name, declaration in {**declared.picture, **files_alone}.items():
        found.append(option_parameter(name, *declaration))
    found += common_parameters(declared.question)
    for name, declaration in without(declared.look, declared.picture).items():
        heading = None if name == PRINTED else FIGURE
        found.append(option_parameter(name, *declaration, heading=heading))
    return found


def common_parameters(question: type[Question]) -> list[inspect.Parameter]:
    """Return the parameters of every command."""
    found = [output_parameter(question)]
    if question.draw is not None:
        plot = typer.Option(
            "--plot", metavar="FILE", help="draw a figure in .png, .pdf or .svg"
        )
        found.append(parameter("plot", Annotated[Optional[Path], plot], None))
    json = typer.Option("--json", help="print only JSON")
    everything = typer.Option("--all", help="print all variables and rows")
    yes = typer.Option(
        "--yes",
        help=f"compute even if it takes over {question.consent_beyond}",
        rich_help_panel=ADVANCED,
    )
    return [
        *found,
        parameter("as_json", Annotated[bool, json], False),
        parameter("everything", Annotated[bool, everything], False),
        parameter("yes", Annotated[bool, yes], False),
    ]


def output_parameter(question: type[Question]) -> inspect.Parameter:
    """Return the parameter of -o: files, or the folder that some commands fill."""
    if question.folder:
        folder = typer.Option(
            "-o", "--output", metavar="DIR", help="folder to write the results to"
        )
        annotation = Annotated[list[str], folder]
        if question.default_folder:
            return parameter("out", annotation, [question.default_folder])
        return parameter("out", annotation)
    endings = ", ".join(dict.fromkeys((*question.own_files(), *ENDINGS)))
    file = typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help=f"write {endings}, or all into a folder; repeatable",
    )
    return parameter("out", Annotated[Optional[list[str]], file], None)


def parameter(
    name: str, annotation: Any, default: Any = inspect.Parameter.empty
) -> inspect.Parameter:
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
    )


def subject_parameter(subject: base.Subject) -> inspect.Parameter:
    """Return the first argument of a command."""
    shown = typer.Argument(
        metavar=subject.metavar, help=subject.help, autocompletion=subject.names
    )
    annotation = Annotated[str, shown]
    if subject.default:
        return parameter(SUBJECT, annotation, subject.default)
    return parameter(SUBJECT, annotation)


def option_parameter(
    name: str, option: Option, kind: Any, default: Any, heading: str | None = None
) -> inspect.Parameter:
    """Return the parameter of an option. heading: that it has in the help."""
    settings = typer.Option(
        base.flag(name, option),
        metavar=option.metavar or None,
        help=option.help,
        rich_help_panel=heading,
    )
    if kind is bool:
        return parameter(name, Annotated[bool, settings], False)
    if base.is_required(default):
        return parameter(name, Annotated[read_type(option, kind), settings])
    return parameter(name, Annotated[Optional[read_type(option, kind)], settings], None)


def read_type(option: Option, kind: Any) -> Any:
    """Return the type that typer reads of an option: a text, or a list of texts, for
    what is parsed here."""
    if option.repeated:
        return list[str]
    if option.parse is not None:
        return str
    kind = base.without_none(kind)
    if kind in (int, float, Path):
        return kind
    return str


# Requests


def request(
    declared: Declaration, given: dict[str, Any]
) -> tuple[Question, list[pipeline.Output]]:
    """Return the question and the outputs that the values of a command ask for."""
    kind = declared.question
    paths = [output_path(name) for name in given["out"] or ()]
    plot = given.get("plot")
    if paths:  # plug-ins may add formats
        declared = declared._replace(files=file_options(kind, kind.files()))
    refuse_unused(declared, given, paths)
    picture, look_values = picture_values(declared, given)

    subject = None
    if declared.subject is None:
        question = kind(**option_values(declared.fields, given, None))
    else:
        changes = {name: given[name] for name in declared.subject.changes}
        subject = declared.subject.load(given[SUBJECT], **changes)
        question = kind(subject, **option_values(declared.fields, given, subject))
    look = None
    if look_values:
        look = looks.checked_look(question, look_values)

    file_values = {}
    for ending, options in declared.files.items():
        file_values[ending] = option_values(options, given, subject)
    outputs = []
    for path in paths:
        values = file_values.get(path.suffix.lower(), {})
        if kind.folder:
            values = file_values[FOLDER]
        outputs.append(in_look(output(kind, path, values), look))
    picture = {
        **picture,
        **option_values(without(declared.picture, declared.look), given, subject),
    }
    all_values = option_values(declared.all_files, given, subject)
    question = question.for_files(paths, all_values)
    if kind.folder:
        question.check_draw(**file_values[FOLDER])
    if plot is not None:
        question.check_draw(**picture)
        outputs.append(in_look(figure(plot, picture), look))
        question = question.for_picture(**picture)
    return question, outputs


def picture_values(
    declared: Declaration, given: dict[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the values of the shared options that are the picture's own after all,
    such as a style that is a way to draw, and those of its look."""
    shared = {name: given[name] for name in declared.look if given[name] is not None}
    look, own = looks.split(declared.question, shared)
    return own, look


def option_values(
    options: Declared, given: dict[str, Any], subject: Any
) -> dict[str, Any]:
    """Return the values of the options that are given."""
    values = {}
    for name, (option, _, default) in options.items():
        value = given[name]
        if value is None or (value is False and default is False):
            continue
        if option.parse is not None:
            value = option.parse(value, subject, base.flag(name, option))
        values[name] = value
    return values


def output_path(name: str) -> Path:
    """Return the path of an output; an empty name is refused."""
    if not name:
        raise Refusal(
            "the name is empty",
            where="``output``",
            instead="name a file or a folder, '.' for the current one",
        )
    return Path(name)


def refuse_unused(
    declared: Declaration, given: dict[str, Any], paths: list[Path]
) -> None:
    """Refuse options of figures and files that are not written."""
    if given.get("plot") is None:
        used = declared.files.get(FOLDER, {})
        unused = without(declared.picture, used)
        if not any(is_folder(declared.question, path) for path in paths):
            unused = {**unused, **declared.look}
            unused.pop(PRINTED, None)
        refuse_given(unused, given, "for a figure", "add --plot FILE")
    used = {}
    for path in paths:
        used.update(declared.files.get(path.suffix.lower(), {}))
    for ending, options in declared.files.items():
        if ending != FOLDER:
            unused = without(options, used)
            instead = f"add -o FILE{ending}"
            refuse_given(unused, given, f"for a {ending} file", instead)


def without(options: Declared, others: Declared) -> Declared:
    """Return the options that are not among others."""
    return {name: options[name] for name in options if name not in others}


def refuse_given(
    options: Declared, given: dict[str, Any], purpose: str, instead: str
) -> None:
    """Refuse those of the options that are given, with their purpose."""
    names = []
    for name, (option, _, _) in options.items():
        if given[name]:
            names.append(base.flag(name, option))
    if names:
        verb = "are"
        if len(names) == 1:
            verb = "is"
        raise Refusal(f"{' and '.join(names)} {verb} {purpose}", instead=instead)


def is_folder(question: type[Question], path: Path) -> bool:
    """Return whether an output is a folder, which has pictures."""
    from geomech.results.files import formats

    if question.folder:
        return True
    return path.is_dir() and path.suffix.lower() not in formats(question)


def in_look(output: pipeline.Output, look: Any) -> pipeline.Output:
    """Return an output whose pictures have a look."""
    if look is None:
        return output

    def write(result: Any, path: Path) -> None:
        from geomech import plots

        with plots.using(look):
            output.write(result, path)

    return dataclasses.replace(output, write=write)


def output(
    question: type[Question], path: Path, options: dict[str, Any]
) -> pipeline.Output:
    """Return the output of a name: a file by its ending, or a folder.

    Refusal for another ending, or without one, unless it is a folder or the question's
    command fills one."""
    from geomech.results.files import save, writer

    if question.folder:
        write = partial(question.fill, **options)
        return pipeline.Output(path, write, folder=True)
    if is_folder(question, path):
        return pipeline.Output(path, fill, folder=True)
    if path.suffix.lower() in PICTURES and question.draw is not None:
        raise Refusal(
            f"cannot write {path}", instead=f"use --plot {path} for a picture"
        )
    writer(path, question)  # refuses an ending that is no format
    return pipeline.Output(path, partial(save, **options))


def fill(result: Any, folder: Path) -> None:
    """Write a result into a folder in every format, and its picture."""
    from geomech.results.files import save

    for ending in IN_FOLDER:
        save(result, folder / f"{result.kind}{ending}")
    if result.question.draw is not None:
        from geomech import plots

        plots.save(result.plot(), folder / f"{result.kind}.png")


def figure(path: Path, options: dict[str, Any]) -> pipeline.Output:
    """Return the output of a picture."""
    from geomech import plots

    def write(result: Any, path: Path) -> None:
        plots.save(result.plot(**options), path)

    plots.check_format(path)
    return pipeline.Output(path, write)
