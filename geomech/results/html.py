"""Any result as HTML for a notebook: its lines, its tables, and its picture."""

from __future__ import annotations

import base64
import html as escaping
import io
from typing import Any

from geomech.core.variables import Result
from geomech.results.kinds import kind_of
from geomech.results.show import Table, parts
from rft.core.refusal import Refusal, printable

DPI = 90


def html(result: Result) -> str:
    """Return a result as HTML."""
    elements = []
    for part in parts(result):
        if isinstance(part, Table):
            elements.append(table(part))
        else:
            elements.append(f"<p>{escaped(part)}</p>")
    return f"<div>{''.join(elements)}{picture(result)}</div>"


def escaped(text: str) -> str:
    return escaping.escape(printable(text))


def table(part: Table) -> str:
    """Return a table with a row for each coordinate."""
    columns = [part.first]
    for block in part.blocks:
        columns += block
    heads, *rows = zip(*columns)
    body = row("th", heads) + "".join(row("td", cells) for cells in rows)
    title = ""
    if part.title:
        title = f"<p>{escaped(part.title)}</p>"
    return f'{title}<table cellpadding="4">{body}</table>'


def row(tag: str, cells: tuple[str, ...]) -> str:
    marked = "".join(f"<{tag}>{escaped(cell)}</{tag}>" for cell in cells)
    return f"<tr>{marked}</tr>"


def picture(result: Result) -> str:
    """Return the picture of a result; "" for a kind without one, or where the picture
    takes a scene that the result lacks."""
    kind = kind_of(result)
    if kind.draw is None:
        return ""
    try:
        drawn = encoded(result.plot())
    except Refusal:
        return ""
    name = escaping.escape(result.kind)
    return f'<img alt="{name}" src="data:image/png;base64,{drawn}"/>'


def encoded(figure: Any) -> str:
    """Return a figure as PNG in base 64."""
    with io.BytesIO() as file:
        figure.savefig(file, format="png", dpi=DPI)
        return base64.b64encode(file.getvalue()).decode()
