"""What a question is: a frozen dataclass whose annotated fields are its options.

A module of a question imports what computes and what draws within its functions, and
quotes types that it does not need to run: the help of its command loads NumPy, but no
scenes, splines or figures. This module and those of the texts load no NumPy either, as
the list of all commands imports them. A module of a question has no
``from __future__ import annotations``: options are read from the annotations.
"""

import contextlib
import dataclasses
import inspect
from abc import abstractmethod
from collections.abc import Callable, Iterator
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, ClassVar, Union, get_args, get_origin

from geomech.results.kinds import Plain
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from geomech.core.variables import Result
    from geomech.runs.cost import Cost
    from geomech.studies.scene_tables import SceneTables

Progress = Callable[[float], None]
Allow = Callable[[Any], None]
# From a text, the subject of the question, and the option as it is typed.
Parse = Callable[[str, Any, str], Any]

SCENE_HELP = "built-in name (see 'geomech scenes') or TOML file"


@dataclasses.dataclass(frozen=True)
class Option:
    """What a field means, and how a command line gives it.

    help: a line. metavar: what stands for its value. parse: returns the value of a
    text; without it the type of the field is read. flag: its name there, if it is
    another.
    repeated: it may be given more than once, and a list of texts is parsed."""

    help: str
    metavar: str = ""
    parse: Parse | None = None
    flag: str = ""
    repeated: bool = False


@dataclasses.dataclass(frozen=True)
class Subject:
    """What a question is about, as its command's first argument: mostly a scene.

    load: returns it from its text and from the values of ``changes``, options of the
    command that change it (`geomech.shell.command.CHANGES`). names: returns those that
    a shell completes. default: what is taken where nothing is given; "" if it must
    be."""

    load: Callable[..., Any]
    names: Callable[[], list[str]] | None = None
    changes: tuple[str, ...] = ()
    metavar: str = "SCENE"
    help: str = SCENE_HELP
    default: str = ""


def ignore(_: Any) -> None:
    """Ignore progress, or a cost."""


@dataclasses.dataclass(frozen=True)
class Run:
    """The surroundings of a computation.

    progress: called with the fraction done. allow: called with a cost that was not
    known beforehand; raises where it is too much. limited: whether limits of cost hold,
    for a computation that can check them only on its way. tables: of the scene, if
    there are some already."""

    progress: Progress = ignore
    allow: Allow = ignore
    limited: bool = False
    tables: Any = None

    @property
    def shown_progress(self) -> Progress | None:
        """The progress that is shown; None where the computation shows its own."""
        if self.progress is ignore:
            return None
        return self.progress

    def tables_of(self, scene: Any) -> "SceneTables":
        """Return the tables of a scene: those that are given, or new ones."""
        from geomech.studies.scene_tables import SceneTables

        if self.tables is not None and self.tables.scene is scene:
            return self.tables
        return SceneTables(scene)


# By field: what it means, its type, its default.
Declared = dict[str, tuple[Option, Any, Any]]


@dataclasses.dataclass(frozen=True)
class Question(Plain):
    """A question. Subclasses are frozen dataclasses of all data on which their answers
    depend; the first of their fields is the question's `Subject`, if it has one.

    The class itself presents every result of its kind, computed or read from a file:
    `headline`, `summary`, `remarks`, `draw`, `files`.

    cheaper_alternative: advice where it costs too much. report_above: seconds of
    computing from which on a command prints the cost. parallel: whether other processes
    can take a part. folder: whether its command fills a folder by its function `fill`,
    whose keywords are options of the command; default_folder: its name where none is
    given. unlimited: whether it is computed whatever it costs. consent_beyond: what its
    command asks consent for."""

    name: ClassVar[str]
    cheaper_alternative: ClassVar[str] = "request less"
    report_above: ClassVar[float] = 5.0
    parallel: ClassVar[bool] = False
    folder: ClassVar[bool] = False
    default_folder: ClassVar[str] = ""
    unlimited: ClassVar[bool] = False
    consent_beyond: ClassVar[str] = "a minute or over 2 GB"

    @property
    def title(self) -> str:
        """Name of the computation, shown during it."""
        return f"{self.name} of {self.subject_name}"

    # Called with the fraction done; of Python alone, as a command shows its own.
    progress: Progress | None = dataclasses.field(
        default=None, kw_only=True, repr=False, compare=False
    )

    @property
    def subject(self) -> Any:
        """What the question is about: the value of its field marked `Subject`; None of
        a question that has none."""
        name, _ = subject_field(type(self))
        if not name:
            return None
        return getattr(self, name)

    @property
    def subject_name(self) -> str:
        if self.subject is None:
            return self.title
        return getattr(self.subject, "name", str(self.subject))

    def inputs(self) -> list[Path]:
        """Return the files that it reads, which no output may replace."""
        from geomech.scenes import inputs

        if self.subject is None:
            return []
        return inputs(self.subject)

    def for_files(self, paths: list[Path], options: dict[str, Any]) -> "Question":
        """Return the question that also computes what these files have besides; Refusal
        for files that cannot be written. options: those of the files."""
        return self

    def for_picture(self, **options: Any) -> "Question":
        """Return the question that also computes what its picture has besides."""
        return self

    def check(self) -> None:
        """Refuse a question that makes no sense, before anything is computed."""

    def check_draw(self, *args: Any, **options: Any) -> None:
        """Refuse options of `draw` that make no sense together, before anything is
        computed."""

    def check_unit(self, unit: str) -> None:
        """Refuse a unit of length that the answer's lengths cannot have."""
        from geomech.results.length_units import length_factor

        length_factor(self.subject, unit)

    def cost(self) -> "Cost | None":
        """Return the cost of the answer; None where it takes almost no time."""
        return None

    @abstractmethod
    def compute(self, run: Run) -> "Result":
        """Return the answer."""

    def answer(self, run: Run) -> "Result":
        """Return the answer, which knows its question and its scene."""
        result = self.compute(run)
        facts = {**subject_facts(self.subject), **result.attributes}
        return dataclasses.replace(result, attributes=facts, question=self)

    def ask(self, tables: Any = None) -> "Result":
        """Return the answer without limits of cost, as from Python. tables: of the
        scene, if there are some already.

        BLAS takes one thread meanwhile, as it does in a command."""
        from geomech.runs.threads import one_blas_thread

        self.check()
        with one_blas_thread():
            return self.answer(Run(self.progress or ignore, tables=tables))

    def _set(self, **values: Any) -> None:
        """Set fields in `__post_init__`."""
        for name, value in values.items():
            object.__setattr__(self, name, value)


def subject_facts(subject: Any) -> dict[str, str]:
    """Return what every result says of its subject: its name and, of a scene, its text,
    from which pictures are drawn again. A scene with parts of Python alone has none."""
    from geomech.scenes import toml

    if not hasattr(subject, "name"):
        return {}
    facts = {"scene": subject.name}
    with contextlib.suppress(Refusal):
        facts["scene_toml"] = toml(subject)
    return facts


def subject_field(question: type[Question]) -> tuple[str, Subject | None]:
    """Return the name of the field that a question is about, and what it is; "" and
    None of a question that consists of options alone."""
    for field in dataclasses.fields(question):
        subject = mark_of(field.type, Subject)
        if subject is not None:
            return field.name, subject
    return "", None


def options(question: type[Question]) -> Declared:
    """Return the options of a question by field."""
    found = {}
    for field in dataclasses.fields(question):
        option = mark_of(field.type, Option)
        if option is not None:
            found[field.name] = (option, plain_type(field.type), field.default)
    return found


def keyword_options(function: Callable | None) -> Declared:
    """Return the options of a picture or a file: the annotated keywords of the function
    that draws or writes it."""
    found: Declared = {}
    if function is None:
        return found
    for parameter in inspect.signature(function).parameters.values():
        option = mark_of(parameter.annotation, Option)
        if option is not None:
            kind = plain_type(parameter.annotation)
            found[parameter.name] = (option, kind, parameter.default)
    return found


def mark_of(annotation: Any, kind: type) -> Any:
    """Return the mark of an annotation that is of a class; None without one."""
    for mark in getattr(annotation, "__metadata__", ()):
        if isinstance(mark, kind):
            return mark
    return None


def plain_type(annotation: Any) -> Any:
    """Return the type of an annotation without its marks."""
    return get_args(annotation)[0]


def without_none(kind: Any) -> Any:
    """Return the type of an optional value, without None."""
    if get_origin(kind) in (Union, UnionType):
        return next(part for part in get_args(kind) if part is not type(None))
    return kind


def is_required(default: Any) -> bool:
    return default is dataclasses.MISSING or default is inspect.Parameter.empty


def flag(name: str, option: Option) -> str:
    """Return an option as it is typed."""
    return "--" + (option.flag or name.replace("_", "-"))


JSON_TYPES = {
    int: "integer",
    float: "number",
    bool: "boolean",
    str: "string",
    tuple: "array",
    dict: "object",
}


def schema(question: type[Question]) -> dict[str, Any]:
    """Return the JSON Schema of a question's fields."""
    subject, about = subject_field(question)
    properties: dict[str, Any] = {}
    required = []
    if about is not None:
        properties[subject] = {"type": "string"}
        if not about.default:
            required.append(subject)
    for name, (option, kind, default) in options(question).items():
        properties[name] = {**json_type(kind), "description": option.help}
        if is_required(default):
            required.append(name)
    return {
        "title": question.name,
        "type": "object",
        "properties": properties,
        "required": required,
    }


def json_type(kind: Any) -> dict[str, Any]:
    """Return the JSON Schema of a type; {} for any value."""
    kind = without_none(kind)
    named = JSON_TYPES.get(get_origin(kind) or kind)
    if named is None:
        return {}
    return {"type": named}


def reference(question: type[Question]) -> Iterator[str]:
    """Yield a line for each option: as it is typed, its default and its meaning."""
    for name, (option, _, default) in options(question).items():
        typed = f"{flag(name, option)} {option.metavar}".strip()
        shown = f"default {default}"
        if is_required(default):
            shown = "required"
        yield f"{typed:<24} {shown:<16} {option.help}"
