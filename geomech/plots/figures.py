"""Whole figures of a connection and of a CCF: three components side by side, two body frames one above the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from geomech.core.errors import choose
from geomech.gaits import Gait
from geomech.geometry.connection import Connection
from geomech.geometry.field import Field
from geomech.geometry.metric import Finsler, Metric
from geomech.geometry.plane import Plane, ProjectedGait
from geomech.geometry.two_form import TwoForm
from geomech.plots.maps import (
    ANGLES,
    PHASES,
    Labels,
    ccf_map,
    ccf_name,
    draw_gait,
    has,
    has_row,
    largest,
    limit_of,
    panels_of,
    row_name,
    say_left_out,
)
from geomech.plots.style import blank, figure, quantity, styled
from geomech.plots.styles import (
    CCF_STYLES,
    CONNECTION_STYLES,
    MINUS_SIGN,
)
from geomech.results.fields import Slice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHADOW = "dashed: the gait, seen along the joints that are held here"


@styled
def connection_figure(
    connection: Connection, *, labels: Labels = ANGLES, style: str = "quiver",
    beside: Connection | None = None, names: Sequence[str] = (), components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:  # fmt: skip
    """Draw the rows of A side by side, but for those that are zero everywhere, as arrows ("quiver") or "streamlines", each row
    on a scale of its own.

    beside: the connection in another body frame, drawn below on the same scales. names: of the two frames. components:
    of WORDS, drawn even where they are zero. clim: top of the scales, a number or a percentile of a row's lengths such as
    "98%", their largest if left out.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> fig = geomech.plots.connection_figure(study.fitted, components=["x", "theta"])
    """
    draw = CONNECTION_STYLES[choose("style", style, CONNECTION_STYLES)]
    rows = [connection] if beside is None else [connection, beside]
    panels = panels_of(components, [[has_row(c, k) for k in range(3)] for c in rows])
    fig, axes = figure(
        0.3 + 3.5 * len(panels),
        3.0 + 2.7 * (len(rows) - 1),
        len(panels),
        len(rows),
        layout="compressed",
    )
    for k, component in enumerate(panels):
        tops = [
            limit_of(np.hypot(*c.A[component]), clim)
            for c in rows
            if has_row(c, component)
        ]
        top = None if beside is None and clim is None else max(tops, default=None)
        for c, ax in zip(rows, axes[:, k]):
            draw(c, component, ax=ax, labels=labels, top=top)
    _name(axes, names)
    say_left_out(fig, panels, components, row_name)
    return fig


@styled
def pairs_figure(
    form: TwoForm,
    at: Sequence[float],
    component: int = 0,
    *,
    labels: Labels | None = None,
) -> Figure:
    """Draw one component of the CCF of all pairs of joints, on the planes through the shape ``at`` (d,), on one scale.

    labels: (name, unit) of each shape variable."""
    labels = labels or [(f"alpha_{k + 1}", "rad") for k in range(form.field.joints)]
    fields = [form.slice(i, j, at) for i, j in form.pairs]
    columns = min(3, len(fields))
    rows = -(-len(fields) // columns)
    fig, axes = figure(3.6 * columns, 3.2 * rows, columns, rows, layout="compressed")
    top = max(largest(f.values[component]) for f in fields)
    for (i, j), field, ax in zip(form.pairs, fields, axes.ravel()):
        ccf_map(field, component, ax=ax, labels=(labels[i], labels[j]), clim=top)
        fixed = ", ".join(
            f"{quantity(labels[k][0])} = {at[k]:g}".replace("-", MINUS_SIGN)
            for k in range(len(labels))
            if k not in (i, j)
        )
        ax.set_title(
            f"{ax.get_title()}, {i + 1}{j + 1}" + f"; {fixed}" * bool(fixed), fontsize=8
        )
    for ax in axes.ravel()[len(fields) :]:
        ax.set_axis_off()
    return fig


class Row(NamedTuple):
    """A row of maps of a CCF. error: of the field, or None. shadows: curves of gaits that move elsewhere, seen on the
    plane."""

    field: Field
    error: Field | None
    gaits: Sequence = ()
    labels: Labels = ANGLES
    shadows: Sequence = ()


@styled
def ccf_figure(
    field: Field, gaits: Sequence[Gait] = (), *, error: Field | None = None, labels: Labels = ANGLES,
    style: str = "map", metric: Metric | Finsler | None = None, beside: tuple[Field, Field | None] | None = None,
    names: Sequence[str] = (), components: Sequence[str] = (), clim: float | str | None = None,
) -> Figure:  # fmt: skip
    """Draw the components of the CCF side by side with gaits on them, but for those that are zero everywhere, as colours
    ("map"), "contours" or a "surface".

    metric: its rings on a map. beside: (CCF, error) in another body frame, drawn below on the same scales. names: of the two
    frames. components: of WORDS, drawn even where they are zero. clim: limit of the colours on either side of zero, a number or
    a percentile of the values' size such as "98%"; their largest if left out.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> fig = geomech.plots.ccf_figure(study.curvature, gaits=[study.scene.gait], error=study.curvature_error, components=["x"])
    """
    rows = [Row(field, error, gaits, labels)] + (
        [] if beside is None else [Row(*beside, gaits, labels)]
    )
    return _ccf_rows(rows, style, metric, names, True, components, clim)


@styled
def planes_figure(
    planes: Sequence[Plane | Slice], gait: Gait | None = None, *, labels: Labels | None = None, style: str = "map",
    beside: Plane | Slice | None = None, names: Sequence[str] = (), components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:  # fmt: skip
    """Draw the CCF of pairs of joints on planes of shape space, a row for each pair, as `ccf_figure` does.

    gait: of all joints; where it leaves the plane it is dashed, as it is seen along the fixed joints, and has no area. labels:
    (name, unit) of all shape variables. beside: the plane of a single pair in another body frame, below on the same scales.
    names: of the two frames. components, clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("seven-link-wave", grid=7).tables
    >>> fig = geomech.plots.planes_figure([study.plane((0, 5))], study.scene.gait)
    """
    labels, rows = labels or _angles(planes), []
    for one in [*planes, *([] if beside is None else [beside])]:
        seen = [] if gait is None else [ProjectedGait(gait, one)]
        on_plane, shadows = (
            [x for x in seen if x.lies_in_plane == lies] for lies in (True, False)
        )
        rows.append(
            Row(one.ccf, one.error, on_plane, [labels[k] for k in one.pair], shadows)
        )
    titles = [
        f"{plane_title(one, labels)}; frame {name}"
        for one, name in zip([planes[0], beside], names)
    ]
    titles = titles or [plane_title(one, labels) for one in planes]
    return _ccf_rows(rows, style, None, titles, beside is not None, components, clim)


@styled
def plane_connection_figure(
    planes: Sequence[Plane | Slice], *, labels: Labels | None = None, style: str = "quiver", components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:  # fmt: skip
    """Draw the rows of A of the two joints that move, on planes of shape space, a row for each pair, as `connection_figure`
    does.

    labels: as for `planes_figure`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("seven-link-wave", grid=7).tables
    >>> fig = geomech.plots.plane_connection_figure([study.plane((0, 5))])
    """
    draw = CONNECTION_STYLES[choose("style", style, CONNECTION_STYLES)]
    labels = labels or _angles(planes)
    panels = panels_of(
        components, [[has_row(one.connection, k) for k in range(3)] for one in planes]
    )
    fig, axes = figure(
        0.3 + 3.5 * len(panels),
        3.0 + 2.7 * (len(planes) - 1),
        len(panels),
        len(planes),
        layout="compressed",
    )
    for one, row in zip(planes, axes):
        for component, ax in zip(panels, row):
            top = (
                None
                if clim is None
                else limit_of(np.hypot(*one.connection.A[component][:2]), clim)
            )
            draw(
                one.connection,
                component,
                ax=ax,
                labels=[labels[k] for k in one.pair],
                top=top,
            )
    _name(axes, [plane_title(one, labels) for one in planes])
    say_left_out(fig, panels, components, row_name)
    return fig


def _angles(planes: Sequence[Plane | Slice]) -> Labels:
    """Return the labels of shape variables that are joint angles."""
    return [(f"alpha_{k + 1}", "rad") for k in range(len(planes[0].at))]


def plane_title(plane: Plane | Slice, labels: Labels) -> str:
    """Return the angles of the fixed joints of a plane as a title."""
    angles = ", ".join(
        f"{quantity(labels[k][0])} = {plane.at[k]:.3g}".replace("-", MINUS_SIGN)
        for k in plane.fixed
    )
    return f"{angles} {labels[plane.fixed[0]][1]}" if plane.fixed else ""


def _ccf_rows(
    rows: Sequence[Row],
    style: str,
    metric,
    names: Sequence[str],
    same: bool,
    components,
    clim,
):
    """Draw maps of the components, a line of them for each row. same: on the same scales."""
    draw = CCF_STYLES[choose("style", style, CCF_STYLES)]
    solid = getattr(draw, "projection", "") == "3d"
    panels = panels_of(components, [[has(r.field, k) for k in range(3)] for r in rows])
    count = len(panels)
    if solid:
        fig = blank(1.0 + 3.6 * count, 3.6 * len(rows))
        axes = fig.subplots(
            len(rows), count, squeeze=False, subplot_kw={"projection": "3d"}
        )
        fig.get_layout_engine().set(w_pad=0.25)
    else:
        fig, axes = figure(
            0.3 + 3.5 * count,
            3.2 + 2.75 * (len(rows) - 1),
            count,
            len(rows),
            layout="compressed",
        )
        fig.get_layout_engine().set(
            rect=(0.0, 0.0, 0.97 if len(rows) > 1 else 1.0, 1.0)
        )  # room for the widest labels
    more = {"metric": metric} if style == "map" else {}
    for k, component in enumerate(panels):
        tops = [
            limit_of(r.field.values[component], clim)
            if has(r.field, component)
            else None
            for r in rows
        ]
        if same:
            tops = [max((x for x in tops if x), default=None)] * len(rows)
        for r, ax, top in zip(rows, axes[:, k], tops):
            draw(
                r.field,
                component,
                r.gaits,
                ax=ax,
                error=r.error,
                labels=r.labels,
                clim=top,
                **more,
            )
            for shadow in r.shadows:
                if solid:
                    ax.plot(
                        *shadow.shape(PHASES).T,
                        ax.get_zlim()[0],
                        "--",
                        color="black",
                        lw=1.0,
                    )
                else:
                    draw_gait(shadow, ax, within=r.field.axes, line="--")
    say_left_out(
        fig,
        panels,
        components,
        ccf_name,
        *([SHADOW] if any(r.shadows for r in rows) else []),
    )
    if style == "map":
        _one_legend(fig, axes, "upper" if fig.get_supxlabel() else "lower")
    _name(axes, names)
    return fig


def _one_legend(fig, axes, where: str) -> None:
    """Put the legends of maps, which explain the same, into one, "upper" or "lower"."""
    handles = {}
    for ax in axes.flat:
        if (legend := ax.get_legend()) is not None:
            handles |= {h.get_label(): h for h in legend.legend_handles}
            legend.remove()
    if handles:
        fig.legend(
            handles=[*handles.values()],
            loc=f"outside {where} center",
            ncols=len(handles),
        )


def _name(axes, names: Sequence[str]) -> None:
    """Write the frame of each row at its left."""
    for row, name in zip(axes, names):
        options = {
            "transform": row[0].transAxes,
            "rotation": 90,
            "ha": "center",
            "va": "center",
            "fontsize": 10,
        }
        write = row[0].text2D if hasattr(row[0], "text2D") else row[0].text
        write(
            -0.33 if write.__name__ == "text" else 0.03,
            0.5,
            name,
            in_layout=write.__name__ == "text",
            **options,
        )
