"""geomech reference: the keys of scene files, in lines or as a JSON Schema."""

from __future__ import annotations

import json
from typing import Annotated, Optional

import typer

from geomech.questions.shared.names import section_names
from geomech.shell import terminal
from geomech.shell.options import PluginOption, load_plugins
from rft.core.refusal import Refusal


def reference(
    section: Annotated[
        Optional[str],
        typer.Argument(
            metavar="[SECTION]",
            help="section such as medium, body or gait (default all)",
            autocompletion=section_names,
        ),
    ] = None,
    json_schema: Annotated[
        bool, typer.Option("--json-schema", help="print a JSON Schema of scene files")
    ] = False,
    plugin: PluginOption = None,
) -> None:
    """Print every key of a scene file. Each has its type, unit, default and meaning."""
    load_plugins(plugin)
    terminal.show([keys(section, json_schema)])


def keys(section: str | None, json_schema: bool) -> str:
    """Return all keys of scene files, those of one section, or a JSON Schema of whole
    files."""
    from geomech.scenes.format.keys import text
    from geomech.scenes.format.schema import schema

    if not json_schema:
        return text(section).removesuffix("\n")
    if section is not None:
        raise Refusal(
            "--json-schema describes whole scene files", instead="drop SECTION"
        )
    return json.dumps(schema(), indent=1)
