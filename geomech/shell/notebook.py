"""Connections, fields and studies as HTML for a notebook: a line, a small table and a
picture of what is computed already. `geomech.results.html` shows results."""

from __future__ import annotations

from typing import Any

from geomech import plots
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.representations.field import Field
from geomech.results.html import encoded, escaped, row
from geomech.shell.describe.system import system_lines
from geomech.studies.scene_tables import SceneTables


def page(
    line: str, rows: list[tuple[str, ...]] | None = None, picture: Any = None
) -> str:
    """Return a line, the rows of a table and a Figure as HTML."""
    parts = [f"<p>{escaped(line)}</p>"]
    if rows:
        body = "".join(row("td", cells) for cells in rows)
        parts.append(f'<table cellpadding="4">{body}</table>')
    if picture is not None:
        source = f"data:image/png;base64,{encoded(picture)}"
        parts.append(f'<img alt="{escaped(line)}" src="{source}"/>')
    return f"<div>{''.join(parts)}</div>"


def connection(fitted: Connection) -> str:
    """Return the rows of A as arrows over shape space, or a line where shape space is
    no plane."""
    picture = None
    if len(fitted.axes) == 2:
        picture = plots.connection_figure(fitted)
    return page(repr(fitted), picture=picture)


def field(values: Field) -> str:
    """Return the components of a CCF as colours over shape space; a line for any other
    field."""
    picture = None
    shape = values.values.shape
    if values.joints == 2 and shape[0] == 3 and len(shape) == 3:
        picture = plots.ccf_figure(values)
    return page(repr(values), picture=picture)


def study(tables: SceneTables) -> str:
    """Return the scene and tiers of a study and, if it is computed already, the CCF
    with the scene's gait."""
    scene = tables.scene
    computed = {key[0] for key in tables.computed}
    rows = [
        ("system", system_lines(scene.system)[0]),
        ("gait", repr(scene.gait)),
        ("numerics", repr(scene.numerics)),
        ("tiers", ", ".join(tables.tiers)),
        ("computed", ", ".join(sorted(computed)) or "nothing yet"),
    ]
    picture = None
    if {"ccf", "error of the ccf"} <= computed and scene.system.joints == 2:
        error = tables.curvature_error
        picture = plots.ccf_figure(tables.curvature, [scene.gait], error=error)
    return page(f"Study of {scene.name}", rows, picture)
