"""The command line: the commands of `geomech.commands`."""

from __future__ import annotations

import sys
from importlib import import_module

import typer

from geomech import terminal
from geomech.commands import COMMANDS

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="Geometric mechanics of locomotion in sand and fluid: from a force law to the displacement of a gait.",
)  # fmt: skip
for name in COMMANDS:
    app.command()(getattr(import_module(f"geomech.commands.{name}"), name))


def main(argv: list[str] | None = None) -> None:
    """Entry point: one line on standard error and exit code 2 for what the user can mend, 128 + its number for a signal."""
    sys.exit(terminal.ended(app, (sys.argv[1:] if argv is None else argv) or ["--help"]))
