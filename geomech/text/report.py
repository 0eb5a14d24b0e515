"""Everything of a scene in lines: its displacements, gait by gait."""

from __future__ import annotations

from geomech.core.variables import Result
from geomech.text import displacement


def text(result: Result) -> str:
    """Return the table of every gait."""
    return "\n".join(displacement.text(table, title) for title, table in result.subject.tables.items())
