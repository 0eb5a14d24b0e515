"""geomech scenes."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.commands.pipeline import show as print_lines
from geomech.questions.names import printable_names


def scenes(
    show: Annotated[
        Optional[str],
        typer.Option(
            metavar="NAME",
            help="print the TOML of a scene or a medium",
            autocompletion=printable_names,
        ),
    ] = None,
):
    """List the built-in scenes and the named media."""
    from geomech.text.scenes import lines

    print_lines(lines(show))
