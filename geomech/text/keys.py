"""The keys of scene files, in lines or as a JSON Schema."""

from __future__ import annotations

import json

from geomech.scenes import keys
from geomech.scenes.schema import schema
from rft.core.refusal import Refusal


def reference(section: str | None, json_schema: bool) -> str:
    """Return all keys of scene files, those of one section, or a JSON Schema of whole files."""
    if not json_schema:
        return keys.text(section).removesuffix("\n")
    if section is not None:
        raise Refusal(
            "--json-schema is that of whole scene files", instead="drop SECTION"
        )
    return json.dumps(schema(), indent=1)
