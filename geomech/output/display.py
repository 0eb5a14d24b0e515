"""What a notebook shows of results: a line, a small table or a picture, as HTML. Nothing is computed for it."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Sequence

import numpy as np

from geomech.core.errors import plain
from geomech.geometry.connection import Connection
from geomech.geometry.field import Field
from geomech.output import plots, sweeps
from geomech.output.system import described
from geomech.study.bench import Study
from geomech.study.results import Displacements, Swept
from geomech.systems.base import length_unit

MOST_ROWS = 40
DPI = 90


def page(line: str, head: Sequence[str] = (), rows: Iterable[Sequence] = (), picture=None) -> str:
    """A line, a table of at most MOST_ROWS, a Figure."""
    rows, cell = list(rows), lambda tag, x: f"<{tag}>{html.escape(plain(_text(x)))}</{tag}>"
    line = html.escape(plain(line))
    parts = [f"<p>{line}</p>"]
    if rows:
        lines = [("th", head)] * bool(head) + [("td", row) for row in rows[:MOST_ROWS]]
        body = "".join(f"<tr>{''.join(cell(tag, x) for x in row)}</tr>" for tag, row in lines)
        parts.append(f"<table>{body}</table>")
        if len(rows) > MOST_ROWS:
            parts.append(f"<p>and {len(rows) - MOST_ROWS} rows more</p>")
    if picture is not None:
        parts.append(f'<img alt="{line}" src="data:image/png;base64,{_encoded(picture)}"/>')
    return "<div>" + "".join(parts) + "</div>"


def _text(x) -> str:
    return f"{x:.4g}" if isinstance(x, (float, np.floating)) else str(x)


def _encoded(picture) -> str:
    with io.BytesIO() as file:
        picture.savefig(file, format="png", dpi=DPI)
        return base64.b64encode(file.getvalue()).decode()


def connection(fitted: Connection) -> str:
    """Its rows as arrows over shape space, or its line where shape space is no plane."""
    return page(repr(fitted), picture=plots.connection_figure(fitted) if len(fitted.axes) == 2 else None)


def field(values: Field) -> str:
    """Its components as colours over shape space, as those of a CCF; its line for any other."""
    drawn = values.joints == 2 and values.values.shape[0] == 3 and values.values.ndim == 3
    return page(repr(values), picture=plots.ccf_figure(values) if drawn else None)


def study(bench: Study) -> str:
    """Its scene, tiers and, where it is computed already, the CCF with the scene's gait."""
    scene, held = bench.scene, {key[0] for key in bench.computed}
    rows = [
        ("system", described(scene.system)[0]),
        ("gait", repr(scene.gait)),
        ("numerics", repr(scene.numerics)),
        ("tiers", ", ".join(bench.tiers)),
        ("computed", ", ".join(sorted(held)) or "nothing yet"),
    ]
    drawn = {"ccf", "error of the ccf"} <= held and scene.system.joints == 2
    maps = lambda: plots.ccf_figure(bench.curvature, [scene.gait], error=bench.curvature_error)
    return page(f"Study of {scene.name}", (), rows, maps() if drawn else None)


def displacements(table: Displacements) -> str:
    """A row an amplitude and tier."""
    unit, rows = length_unit(table.scene.system), []
    told = {
        "estimate": f"error ({unit})",
        "estimate_heading": "error of heading (rad)",
        "medium_error": f"medium ({unit})",
    }
    told |= {"medium_error_heading": "medium, heading (rad)", "speed": f"speed ({unit}/s)"}
    there = {key: name for key, name in told.items() if key in table}
    each = [(table.errors(key), ".4g" if key == "speed" else ".1e") for key in there]
    for k, amplitude in enumerate(table["amplitude"]):
        for name in table.tiers:
            errors = (f"{values[name][k]:{style}}" for values, style in each)
            rows.append((amplitude, name, *(float(x) + 0.0 for x in np.round(table[name][k], 12)), *errors))
    head = ("amplitude", "tier", f"x ({unit})", f"y ({unit})", "heading (rad)", *there.values())
    said = f"; estimated error: {table['estimate_is']}" if "estimate_is" in table else ""
    return page(f"Net displacement per cycle of {table.scene.name}{said}", head, rows)


def swept(results: Swept) -> str:
    """Against one parameter, or as a map over two; its line for more."""
    return page(repr(results), picture=sweeps.draw(results.scene, results) if len(results["over"]) <= 2 else None)
