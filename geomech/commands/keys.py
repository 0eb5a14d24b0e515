"""geomech keys."""

from __future__ import annotations

import json
from typing import Annotated, Optional

import typer

from geomech.commands.names import section_names
from geomech.commands.options import PluginOption, load_plugins
from rft.refusal import Refusal


def keys(
    section: Annotated[
        Optional[str],
        typer.Argument(metavar="[SECTION]", help="medium, body, gait, ... or all", autocompletion=section_names),
    ] = None,
    json_schema: Annotated[bool, typer.Option("--json-schema", help="print a JSON Schema of scene files")] = False,
    plugin: PluginOption = None,
):
    """Every key of a scene file: type, unit, default and meaning; or a JSON Schema for editors."""
    from geomech.scene.keys import text
    from geomech.scene.schema import schema

    load_plugins(plugin)
    if json_schema and section is not None:
        raise Refusal("--json-schema is that of whole scene files", instead="drop SECTION")
    print(json.dumps(schema(), indent=1) if json_schema else text(section), end="\n" if json_schema else "")
