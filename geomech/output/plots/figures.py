"""Whole figures of a connection and of a CCF: three components side by side, two body frames one above the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geomech.connection import Connection
from geomech.errors import choose
from geomech.field import Field
from geomech.gaits import Gait
from geomech.metric import Finsler, Metric
from geomech.output.plots.maps import ANGLES, TITLES, Labels, ccf_map, largest, vector_field
from geomech.output.plots.style import blank, figure, quantity, styled
from geomech.output.plots.styles import (
    CCF_STYLES,
    CONNECTION_STYLES,
    MINUS_SIGN,
    ccf_contours,
    ccf_surface,
    streamlines,
)
from geomech.two_form import TwoForm


@styled
def connection_figure(
    connection: Connection, unit: str = "BL", labels: Labels = ANGLES, style: str = "quiver",
    beside: Connection | None = None, names: Sequence[str] = (),
):  # fmt: skip
    """All three rows of A side by side, as arrows ("quiver") or "streamlines". beside: the connection in another body frame,
    drawn below on the same scales. names: of the two frames."""
    draw = {"quiver": vector_field, "streamlines": streamlines}[choose("style", style, CONNECTION_STYLES)]
    rows = [connection] if beside is None else [connection, beside]
    fig, axes = figure(10.8, 3.0 * len(rows), 3, len(rows), layout="compressed")
    for component in range(3):
        sizes = [largest(np.hypot(*c.A[component])) for c in rows]
        top = None if beside is None else max(sizes)
        for c, ax in zip(rows, axes[:, component]):
            draw(c, component, unit, ax, labels=labels, top=top)
    _name(axes, names)
    return fig


@styled
def pairs_figure(
    form: TwoForm, at: Sequence[float], component: int = 0, unit: str = "BL", labels: Labels | None = None
):
    """The CCF of all pairs of joints on the planes through the shape ``at`` (d,), one component, on one scale. labels: (name,
    unit) of each shape variable."""
    labels = labels or [(f"alpha_{k + 1}", "rad") for k in range(form.field.joints)]
    fields = [form.slice(i, j, at) for i, j in form.pairs]
    columns = min(3, len(fields))
    rows = -(-len(fields) // columns)
    fig, axes = figure(3.6 * columns, 3.2 * rows, columns, rows, layout="compressed")
    top = max(largest(f.values[component]) for f in fields)
    for (i, j), field, ax in zip(form.pairs, fields, axes.ravel()):
        ccf_map(field, component, (), unit, ax, None, (labels[i], labels[j]), top=top)
        rest = ", ".join(
            f"{quantity(labels[k][0])} = {at[k]:g}".replace("-", MINUS_SIGN)
            for k in range(len(labels))
            if k not in (i, j)
        )
        ax.set_title(f"{ax.get_title()}, {i + 1}{j + 1}" + f"; {rest}" * bool(rest), fontsize=8)
    for ax in axes.ravel()[len(fields) :]:
        ax.set_axis_off()
    return fig


@styled
def ccf_figure(
    field: Field, gaits: Sequence[Gait] = (), unit: str = "BL", error: Field | None = None, labels: Labels = ANGLES,
    style: str = "map", metric: Metric | Finsler | None = None, beside: tuple[Field, Field | None] | None = None,
    names: Sequence[str] = (),
):  # fmt: skip
    """All three components of the CCF side by side, with gaits drawn on them, as colours ("map"), "contours" or a "surface".
    metric: its rings on a map. beside: (CCF, error) in another body frame, drawn below on the same scales. names: of the two
    frames."""
    rows = [(field, error)] if beside is None else [(field, error), beside]
    if choose("style", style, CCF_STYLES) == "surface":
        fig = blank(11.4, 3.6 * len(rows))
        axes = fig.subplots(len(rows), 3, squeeze=False, subplot_kw={"projection": "3d"})
        fig.get_layout_engine().set(w_pad=0.25)
    else:
        fig, axes = figure(10.8, 3.2 * len(rows), 3, len(rows), layout="compressed")
    draw = {"map": ccf_map, "contours": ccf_contours, "surface": ccf_surface}[style]
    more = {"metric": metric} if style == "map" else {}
    for component in range(len(TITLES)):
        top = None if beside is None else max(largest(f.values[component]) for f, _ in rows)
        for (f, e), ax in zip(rows, axes[:, component]):
            draw(f, component, gaits, unit, ax, e, labels, top=top, **more)
    _name(axes, names)
    return fig


def _name(axes, names: Sequence[str]) -> None:
    """Say at the left of each row which frame it is in."""
    for row, name in zip(axes, names):
        told = {"transform": row[0].transAxes, "rotation": 90, "ha": "center", "va": "center", "fontsize": 10}
        put = row[0].text2D if hasattr(row[0], "text2D") else row[0].text
        put(-0.33 if put.__name__ == "text" else -0.1, 0.5, name, **told)
