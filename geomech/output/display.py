"""Results as HTML for a notebook: a line, a small table or a picture. Nothing is computed for it."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Sequence

import numpy as np

from geomech import plots
from geomech.describe.system import described
from geomech.geometry.connection import Connection
from geomech.geometry.field import Field
from geomech.studies.study import Study
from rft.core.refusal import printable

MOST_ROWS = 40
DPI = 90


def page(
    line: str, head: Sequence[str] = (), rows: Iterable[Sequence] = (), picture=None
) -> str:
    """Return a line, a table of at most MOST_ROWS rows and a Figure as HTML."""
    rows, cell = (
        list(rows),
        lambda tag, x: f"<{tag}>{html.escape(printable(_text(x)))}</{tag}>",
    )
    line = html.escape(printable(line))
    parts = [f"<p>{line}</p>"]
    if rows:
        lines = [("th", head)] * bool(head) + [("td", row) for row in rows[:MOST_ROWS]]
        body = "".join(
            f"<tr>{''.join(cell(tag, x) for x in row)}</tr>" for tag, row in lines
        )
        parts.append(f'<table cellpadding="4">{body}</table>')
        if len(rows) > MOST_ROWS:
            parts.append(f"<p>and {len(rows) - MOST_ROWS} rows more</p>")
    if picture is not None:
        parts.append(
            f'<img alt="{line}" src="data:image/png;base64,{_encoded(picture)}"/>'
        )
    return "<div>" + "".join(parts) + "</div>"


def _text(x) -> str:
    return f"{x:.4g}" if isinstance(x, (float, np.floating)) else str(x)


def _encoded(picture) -> str:
    with io.BytesIO() as file:
        picture.savefig(file, format="png", dpi=DPI)
        return base64.b64encode(file.getvalue()).decode()


def connection(fitted: Connection) -> str:
    """Return the rows of A as arrows over shape space, or a line where shape space is no plane."""
    return page(
        repr(fitted),
        picture=plots.connection_figure(fitted) if len(fitted.axes) == 2 else None,
    )


def field(values: Field) -> str:
    """Return the components of a CCF as colours over shape space; a line for any other field."""
    drawn = (
        values.joints == 2 and values.values.shape[0] == 3 and values.values.ndim == 3
    )
    return page(repr(values), picture=plots.ccf_figure(values) if drawn else None)


def study(bench: Study) -> str:
    """Return the scene and tiers of a study and, where it is computed already, the CCF with the scene's gait."""
    scene, computed = bench.scene, {key[0] for key in bench.computed}
    rows = [
        ("system", described(scene.system)[0]),
        ("gait", repr(scene.gait)),
        ("numerics", repr(scene.numerics)),
        ("tiers", ", ".join(bench.tiers)),
        ("computed", ", ".join(sorted(computed)) or "nothing yet"),
    ]
    drawn = {"ccf", "error of the ccf"} <= computed and scene.system.joints == 2
    maps = lambda: plots.ccf_figure(
        bench.curvature, [scene.gait], error=bench.curvature_error
    )
    return page(f"Study of {scene.name}", (), rows, maps() if drawn else None)
