"""geomech reference."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.commands.options import PluginOption, load_plugins
from geomech.commands.pipeline import show
from geomech.questions.names import section_names


def reference(
    section: Annotated[
        Optional[str],
        typer.Argument(
            metavar="[SECTION]",
            help="section such as medium, body or gait; all if left out",
            autocompletion=section_names,
        ),
    ] = None,
    json_schema: Annotated[
        bool, typer.Option("--json-schema", help="print a JSON Schema of scene files")
    ] = False,
    plugin: PluginOption = None,
):
    """Print every key of a scene file. Each has its type, unit, default and meaning."""
    from geomech.text import keys

    load_plugins(plugin)
    show([keys.reference(section, json_schema)])
