"""The command of a question, made from its declaration."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Optional

import typer

from geomech import pipeline
from geomech.options import ExtentOption, GridOption, MediumOption
from geomech.questions import base
from geomech.questions.base import Declared, Option, Question
from rft.core.refusal import Refusal

CHANGES = {"grid": GridOption, "extent": ExtentOption, "medium": MediumOption}
ENDINGS = (".nc", ".json", ".csv", ".mat", ".txt")  # of `geomech.results.files.WRITERS`
IN_FOLDER = (".json", ".csv", ".nc", ".txt")  # formats that fill a folder
PICTURES = (".png", ".pdf", ".svg")  # those of --plot
FOLDER = ""  # in place of an ending
SUBJECT = "subject"  # name of the first argument in the function of a command


class Declaration(NamedTuple):
    """All that the command of a question takes.

    files: options of the functions that write a file, by ending, FOLDER of the one that
    fills the question's folder."""

    question: type[Question]
    subject: base.Subject | None
    fields: Declared
    picture: Declared
    files: dict[str, Declared]

    @property
    def of_files(self) -> Declared:
        """Options of all files."""
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
        asked, outputs = request(declared, given)
        pipeline.execute(
            asked,
            outputs,
            as_json=given["as_json"],
            yes=given["yes"],
            everything=given["everything"],
        )

    taken = parameters(declared)
    run.__name__ = question.name
    run.__doc__ = question.__doc__
    run.__signature__ = inspect.Signature(taken)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in taken}
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
    found += [typed(name, *one) for name, one in declared.fields.items()]
    for name in changes:
        found.append(parameter(name, CHANGES[name], None))
    found += [typed(name, *one) for name, one in declared.picture.items()]
    for name, one in declared.of_files.items():
        if name not in declared.picture:
            found.append(typed(name, *one))
    return found + common(declared.question)


def common(question: type[Question]) -> list[inspect.Parameter]:
    """Return the parameters of every command."""
    found = [output_parameter(question)]
    if question.draw is not None:
        plot = typer.Option(
            "--plot", metavar="FILE", help="draw a figure to .png, .pdf or .svg"
        )
        found.append(parameter("plot", Annotated[Optional[Path], plot], None))
    json = typer.Option("--json", help="print JSON and nothing else")
    everything = typer.Option("--all", help="print all variables and rows")
    yes = typer.Option(
        "--yes", help=f"compute even if it takes over {question.consent_beyond}"
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


def typed(name: str, option: Option, kind: Any, default: Any) -> inspect.Parameter:
    """Return the parameter of an option."""
    settings = typer.Option(
        base.flag(name, option), metavar=option.metavar or None, help=option.help
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
    kind = base.of_union(kind)
    if kind in (int, float, Path):
        return kind
    return str


# Requests


def request(
    declared: Declaration, given: dict[str, Any]
) -> tuple[Question, list[pipeline.Output]]:
    """Return the question and the outputs that the values of a command ask for."""
    paths = [path_of(name) for name in given["out"] or ()]
    plot = given.get("plot")
    if paths:
        writers = declared.question.files()
        declared = declared._replace(files=file_options(declared.question, writers))
    refuse_unused(declared, given, paths)
    about = []
    if declared.subject is not None:
        changes = {name: given[name] for name in declared.subject.changes}
        about.append(declared.subject.load(given[SUBJECT], **changes))
    subject = about[0] if about else None
    question = declared.question(*about, **parsed(declared.fields, given, subject))
    of_files = {}
    for ending, options in declared.files.items():
        of_files[ending] = parsed(options, given, subject)
    outputs = []
    for path in paths:
        options = of_files.get(path.suffix.lower(), {})
        if declared.question.folder:
            options = of_files[FOLDER]
        outputs.append(output(declared.question, path, options))
    picture = parsed(declared.picture, given, subject)
    question = question.for_files(paths, parsed(declared.of_files, given, subject))
    if declared.question.folder:
        question.check_draw(**of_files[FOLDER])
    if plot is not None:
        question.check_draw(**picture)
        outputs.append(figure(plot, picture))
        question = question.for_picture(**picture)
    return question, outputs


def parsed(options: Declared, given: dict[str, Any], subject: Any) -> dict[str, Any]:
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


def path_of(name: str) -> Path:
    """Return the path of an output; an empty name is refused."""
    if not name:
        raise Refusal(
            "an empty name",
            where="``output``",
            instead="name a file or a folder, '.' for this one",
        )
    return Path(name)


def refuse_unused(
    declared: Declaration, given: dict[str, Any], paths: list[Path]
) -> None:
    """Refuse options of figures and files that are not written."""
    in_folder = declared.files.get(FOLDER, {})
    if given.get("plot") is None:
        unused = {k: one for k, one in declared.picture.items() if k not in in_folder}
        refuse_given(unused, given, "for a figure", "say --plot FILE, too")
    written = {path.suffix.lower() for path in paths}
    taken: set[str] = set()
    for ending in written:
        taken |= {*declared.files.get(ending, {})}
    for ending, options in declared.files.items():
        if ending == FOLDER:
            continue
        unused = {name: one for name, one in options.items() if name not in taken}
        refuse_given(unused, given, f"for a {ending} file", f"say -o FILE{ending}, too")


def refuse_given(
    options: Declared, given: dict[str, Any], what: str, instead: str
) -> None:
    """Refuse options that are given."""
    names = []
    for name, (option, _, _) in options.items():
        if given[name]:
            names.append(base.flag(name, option))
    if names:
        verb = "is" if len(names) == 1 else "are"
        raise Refusal(f"{' and '.join(names)} {verb} {what}", instead=instead)


def output(
    question: type[Question], path: Path, options: dict[str, Any]
) -> pipeline.Output:
    """Return the output of a name: a file by its ending, or a folder.

    Refusal for another ending, or without one, unless it is a folder or the question's
    command fills one."""
    from geomech.results.files import formats, save, writer

    if question.folder:
        write = partial(question.fill, **options)
        return pipeline.Output(path, write, folder=True)
    if path.is_dir() and path.suffix.lower() not in formats(question):
        return pipeline.Output(path, fill, folder=True)
    if path.suffix.lower() in PICTURES and question.draw is not None:
        raise Refusal(
            f"cannot write {path}", instead=f"say --plot {path} for a picture"
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
