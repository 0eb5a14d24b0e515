"""The command line: the commands of `geomech.commands`."""

from __future__ import annotations

import sys
from contextvars import copy_context
from importlib import import_module
from typing import Annotated

import typer

from geomech import __version__, terminal
from geomech.commands import COMMANDS
from geomech.commands.group import Group
from geomech.commands.options import PluginOption, load_plugins, with_plugins

app = typer.Typer(cls=Group, pretty_exceptions_enable=False, rich_markup_mode=None)
for heading, names in COMMANDS.items():
    for name in names:
        function = getattr(import_module(f"geomech.commands.{name}"), name)
        app.command(name.replace("_", "-"), rich_help_panel=heading)(
            with_plugins(function)
        )


def _version(requested: bool) -> None:
    if requested:
        print(f"geomech {__version__}")
        raise typer.Exit


@app.callback()
def geomech(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_version,
            is_eager=True,
            help="print the version and exit",
        ),
    ] = False,
    plugin: PluginOption = None,
):
    """Geometric mechanics of locomotion: from a force law to displacement."""
    from geomech.run.backend import prefer

    prefer(
        "numpy"
    )  # its first call takes half a second less; `commands.pipeline` knows who has much to do
    load_plugins(plugin)


def main(argv: list[str] | None = None) -> None:
    """Run a command and exit: one line on standard error and code 2 for a mistake, 128 + its number for a signal."""
    terminal.limit_threads()
    arguments = (sys.argv[1:] if argv is None else argv) or ["--help"]
    sys.exit(
        copy_context().run(terminal.exit_code, app, arguments)
    )  # what the command prefers ends with it
