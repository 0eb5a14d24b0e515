"""geomech keys."""

from __future__ import annotations

from typing import Annotated, Optional

import typer

from geomech.commands.names import section_names
from geomech.commands.options import PluginOption, load_plugins
from geomech.commands.pipeline import show


def keys(
    section: Annotated[
        Optional[str],
        typer.Argument(metavar="[SECTION]", help="medium, body, gait, ... or all", autocompletion=section_names),
    ] = None,
    json_schema: Annotated[bool, typer.Option("--json-schema", help="print a JSON Schema of scene files")] = False,
    plugin: PluginOption = None,
):
    """Print every key of a scene file: type, unit, default and meaning; or a JSON Schema for editors."""
    from geomech.text.keys import reference

    load_plugins(plugin)
    show([reference(section, json_schema)])
