"""The command line: the commands of `geomech.questions`, and those that ask no
question."""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterator, Mapping
from contextvars import copy_context
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from geomech import __version__, questions
from geomech.shell import describe, renamed, terminal
from geomech.shell.options import PluginOption, load_plugins, with_plugins, with_workers


class Commands(Mapping[str, Any]):
    """All commands by their names as they are typed; each is loaded at its first
    use."""

    def __iter__(self) -> Iterator[str]:
        for names in headings().values():
            yield from map(command_word, names)

    def __len__(self) -> int:
        return sum(map(len, headings().values()))

    def __getitem__(self, name: str) -> Any:
        if name not in iter(self):
            raise KeyError(name)
        return load_command(name.replace("-", "_"))


class Group(TyperGroup):
    """Commands that are loaded when they are called, listed under headings."""

    def __init__(self, **settings: Any):
        super().__init__(**settings)
        self.commands = Commands()  # type: ignore[assignment]

    def list_commands(self, ctx: Any) -> list[str]:
        return [*self.commands]

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        width = max(map(len, self.list_commands(ctx)))
        for heading, names in headings().items():
            rows = [(command_word(name).ljust(width), summary(name)) for name in names]
            with formatter.section(heading):
                formatter.write_dl(rows)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple:
        return super().resolve_command(ctx, renamed.current(args))


class Command(TyperCommand):
    """A command whose help lists the options of figures apart from its own."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        rows: dict[str, list] = {}
        for parameter in self.get_params(ctx):
            row = parameter.get_help_record(ctx)
            if row is not None:
                heading = getattr(parameter, "rich_help_panel", None)
                if parameter.param_type_name == "argument":
                    heading = "Arguments"
                rows.setdefault(heading or "Options", []).append(row)
        for heading, lines in rows.items():
            with formatter.section(heading):
                formatter.write_dl(lines)


def headings() -> dict[str, list[str]]:
    """Return the names of all commands by their headings."""
    found: dict[str, list[str]] = {}
    for groups in (questions.GROUPS, describe.GROUPS):
        for heading, names in groups.items():
            found.setdefault(heading, []).extend(map(questions.question_name, names))
    return found


def command_word(name: str) -> str:
    """Return the name of a command as it is typed."""
    return name.replace("_", "-")


def summary(name: str) -> str:
    """Return the line of a command in the list of all."""
    if name in questions.SUMMARIES:
        return questions.SUMMARIES[name]
    return describe.SUMMARIES[name]


@functools.cache
def load_command(name: str) -> Any:
    """Return a command by its name: of a question, or one that asks none."""
    single = typer.Typer(
        pretty_exceptions_enable=False, rich_markup_mode=None, add_completion=False
    )
    single.command(command_word(name), cls=Command)(with_plugins(function(name)))
    return typer.main.get_command(single)


def function(name: str) -> Any:
    """Return the function of a command."""
    if name in describe.SUMMARIES:
        return getattr(import_module(f"geomech.shell.describe.{name}"), name)
    from geomech.shell.command import command

    question = questions.question(name)
    if question.parallel:
        return with_workers(command(question))
    return command(question)


app = typer.Typer(cls=Group, pretty_exceptions_enable=False, rich_markup_mode=None)


def print_version(requested: bool) -> None:
    if requested:
        print(f"geomech {__version__}")
        raise typer.Exit


@app.callback()
def geomech(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=print_version,
            is_eager=True,
            help="print the version and exit",
        ),
    ] = False,
    plugin: PluginOption = None,
) -> None:
    """Geometric mechanics of locomotion: from a force law to displacement."""
    from geomech.run.backend import at_once, prefer

    # NumPy's first call takes half a second less; the pipeline knows who has much to
    # do.
    prefer(at_once())
    load_plugins(plugin)


def main(argv: list[str] | None = None) -> None:
    """Run a command and exit: one line on standard error and code 2 for a mistake, 128
    + its number for a signal."""
    terminal.limit_threads()
    arguments = (sys.argv[1:] if argv is None else argv) or ["--help"]
    # What the command prefers ends with its context.
    sys.exit(copy_context().run(terminal.exit_code, app, arguments))
