"""Everything of a scene in lines: its displacements, gait by gait."""

from __future__ import annotations

from geomech.core.variables import Result
from geomech.text import displacement

MORE = displacement.MORE
ROWS = 10  # amplitudes of all gaits together, so that they fit a screen


def text(result: Result) -> str:
    """Return displacements by the most exact tier, gait by gait."""
    found = result.subject.tables
    rows = ROWS // len(found)
    lines = [
        line
        for title, table in found.items()
        for line in displacement.gait_lines(table, title, rows)
    ]
    return "\n".join([*lines, displacement.FRAME])


def full(result: Result) -> str:
    """Return the table of every gait by every tier."""
    return "\n".join(
        displacement.full(table, title)
        for title, table in result.subject.tables.items()
    )
