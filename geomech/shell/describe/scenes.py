"""geomech scenes: the scenes and media that ship with the toolkit, as a list, and the
TOML of each."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.questions.shared.names import printable_names
from geomech.shell import terminal


def scenes(
    show: Annotated[
        Optional[str],
        typer.Option(
            metavar="NAME",
            help="print the TOML of a scene or a medium",
            autocompletion=printable_names,
        ),
    ] = None,
) -> None:
    """List the built-in scenes and the named media."""
    # The mechanics of scenes takes longer to load than the help of this command.
    from geomech.shell.describe import builtin

    if show is None:
        terminal.show(builtin.listing())
    else:
        terminal.show([builtin.toml_of(show)])
