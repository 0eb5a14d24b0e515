"""Everything of a scene in lines: its displacements, gait by gait."""

from __future__ import annotations

from geomech.core.variables import Result
from geomech.results import show

MORE = "--all prints all variables and rows"


def text(result: Result) -> str:
    """Return displacements by the most exact tier, gait by gait."""
    tables = result.subject.tables.values()
    return "\n".join(show.text(table) for table in tables)


def full(result: Result) -> str:
    """Return the table of every gait by every tier."""
    tables = result.subject.tables.values()
    return "\n".join(show.text(table, everything=True) for table in tables)
