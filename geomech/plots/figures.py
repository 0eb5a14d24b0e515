"""Whole figures of a connection and of a CCF: three components side by side, two body
frames one above the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from geomech.core.errors import choose
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.representations.plane import Plane, ProjectedGait
from geomech.mathematics.geometry.two_form import TwoForm
from geomech.plots.look import current, font_points
from geomech.plots.maps import (
    ANGLES,
    PHASES,
    Labels,
    ccf_map,
    ccf_name,
    draw_gait,
    has_component,
    has_row,
    inside_periods,
    largest,
    note_zero_components,
    panel_components,
    row_name,
    scale_limit,
)
from geomech.plots.style import (
    columns_that_fit,
    figure,
    panels,
    quantity,
    styled,
    with_minus_signs,
)
from geomech.plots.styles import CCF_STYLES, CONNECTION_STYLES
from geomech.results.fields import Slice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMN_WIDTH = 3.5  # in, of a map with its colour bar and labels
ROW_NAME = -0.72  # in, of the name of a row from its first panel, in a given width
SHADOW = "dashed: the gait, seen along the joints that are held here"


# Connections


@styled
def connection_figure(
    connection: Connection,
    *,
    labels: Labels = ANGLES,
    style: str = "quiver",
    other: Connection | None = None,
    names: Sequence[str] = (),
    components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:
    """Draw the rows of A side by side, without those that are zero everywhere, as
    arrows ("quiver") or "streamlines", each row on a scale of its own.

    other: the connection in another body frame, drawn below on the same scales. names:
    of the two frames. components: "x", "y" and "theta", drawn even where they are zero.
    clim: top of the scales, a number or a percentile of a row's lengths such as "98%";
    by default their largest.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> fig = geomech.plots.connection_figure(study.fitted, components=["x", "theta"])
    """
    draw = CONNECTION_STYLES[choose("style", style, CONNECTION_STYLES)]
    connections = [connection]
    if other is not None:
        connections.append(other)
    panels = panel_components(components, [_rows_present(c) for c in connections])
    fig, axes = _connection_panels(panels, len(connections))
    for k, component in enumerate(panels):
        top = None
        if other is not None or clim is not None:
            tops = [
                scale_limit(np.hypot(*c.A[component]), clim)
                for c in connections
                if has_row(c, component)
            ]
            top = max(tops, default=None)
        for c, ax in zip(connections, axes[:, k]):
            draw(c, component, ax=ax, labels=labels, top=top)
    _name_rows(axes, names)
    _save_width(axes)
    note_zero_components(fig, panels, components, row_name)
    return fig


@styled
def plane_connection_figure(
    planes: Sequence[Plane | Slice],
    *,
    labels: Labels | None = None,
    style: str = "quiver",
    components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:
    """Draw the rows of A of the two joints that move, on planes of shape space, a line
    of panels for each pair of joints.

    labels: as for `planes_figure`. Other arguments as for `connection_figure`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("seven-link-wave", grid=7).tables
    >>> fig = geomech.plots.plane_connection_figure([study.plane((1, 6))])
    """
    draw = CONNECTION_STYLES[choose("style", style, CONNECTION_STYLES)]
    labels = labels or _angle_labels(len(planes[0].at))
    present = [_rows_present(plane.connection) for plane in planes]
    panels = panel_components(components, present)
    fig, axes = _connection_panels(panels, len(planes))
    for plane, row in zip(planes, axes):
        connection = plane.connection
        pair = [labels[k - 1] for k in plane.pair]
        for component, ax in zip(panels, row):
            top = None
            if clim is not None:
                top = scale_limit(np.hypot(*connection.A[component][:2]), clim)
            draw(connection, component, ax=ax, labels=pair, top=top)
    _name_rows(axes, [plane_title(plane, labels) for plane in planes])
    _save_width(axes)
    note_zero_components(fig, panels, components, row_name)
    return fig


def _connection_panels(panels: Sequence[int], rows: int) -> tuple[Any, Any]:
    """Return (Figure, Axes) for these components of some connections."""
    columns = len(panels)
    width = 0.3 + COLUMN_WIDTH * columns
    height = 3.0 + 2.7 * (rows - 1)
    return figure(width, height, columns, rows, layout="compressed")


def _rows_present(connection: Connection) -> list[bool]:
    return [has_row(connection, k) for k in range(3)]


# CCFs


@styled
def pairs_figure(
    form: TwoForm,
    at: Sequence[float],
    component: int = 0,
    *,
    labels: Labels | None = None,
) -> Figure:
    """Draw one component of the CCF of all pairs of joints, on the planes through a
    shape, on one scale.

    at: the shape (d,), rad. labels: (name, unit) of each shape variable."""
    labels = labels or _angle_labels(form.field.joints)
    fields = [form.slice(i, j, at) for i, j in form.pairs]
    columns = min(3, len(fields))
    rows = -(-len(fields) // columns)
    fig, axes = figure(3.6 * columns, 3.2 * rows, columns, rows, layout="compressed")
    top = max(largest(f.values[component]) for f in fields)
    for (i, j), field, ax in zip(form.pairs, fields, axes.ravel()):
        ccf_map(
            field, component, ax=ax, labels=(labels[i - 1], labels[j - 1]), clim=top
        )
        title = f"{ax.get_title()}, {i}{j}"
        fixed = [k for k in range(len(labels)) if k + 1 not in (i, j)]
        if fixed:
            angles = [f"{quantity(labels[k][0])} = {at[k]:g}" for k in fixed]
            title += f"; {with_minus_signs(', '.join(angles))}"
        ax.set_title(title, fontsize=font_points(8))
    for ax in axes.ravel()[len(fields) :]:
        ax.set_axis_off()
    return fig


@styled
def ccf_figure(
    field: Field,
    gaits: Sequence[Gait] = (),
    *,
    error: Field | None = None,
    labels: Labels = ANGLES,
    style: str = "map",
    metric: Metric | Finsler | None = None,
    other: tuple[Field, Field | None] | None = None,
    names: Sequence[str] = (),
    components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:
    """Draw the components of the CCF side by side with gaits on them, without those
    that are zero everywhere, as colours ("map"), "contours" or a "surface".

    error: of the field, as for `ccf_map`. metric: drawn as rings on a map. other:
    (CCF, error) in another body frame, drawn below on the same scales. names: of the
    two frames. components: "x", "y" and "theta", drawn even where they are zero. clim:
    limit of the colours on either side of zero, a number or a percentile of the values'
    size such as "98%"; by default their largest.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ccf = study.curvature
    >>> fig = geomech.plots.ccf_figure(ccf, [study.scene.gait], components=["x"])
    """
    rows = [MapRow(field, error, gaits, labels)]
    if other is not None:
        rows.append(MapRow(*other, gaits, labels))
    return _draw_rows(rows, style, metric, names, True, components, clim)


@styled
def planes_figure(
    planes: Sequence[Plane | Slice],
    gait: Gait | None = None,
    *,
    labels: Labels | None = None,
    style: str = "map",
    other: Plane | Slice | None = None,
    names: Sequence[str] = (),
    components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:
    """Draw the CCF of pairs of joints on planes of shape space, a line of panels for
    each pair.

    gait: of all joints. Where it leaves the plane, it is dashed, as it is seen along
    the fixed joints, and its area is not shaded. labels: (name, unit) of all shape
    variables.
    other: the plane of a single pair in another body frame, below on the same scales.
    names: of the two frames. Other arguments as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("seven-link-wave", grid=7).tables
    >>> fig = geomech.plots.planes_figure([study.plane((1, 6))], study.scene.gait)
    """
    labels = labels or _angle_labels(len(planes[0].at))
    drawn = [*planes]
    titles = [plane_title(plane, labels) for plane in planes]
    if other is not None:
        drawn.append(other)
    if names:
        angles = [plane_title(plane, labels) for plane in drawn]
        titles = [f"{title}; frame {name}" for title, name in zip(angles, names)]
    rows = [_plane_row(plane, gait, labels) for plane in drawn]
    return _draw_rows(rows, style, None, titles, other is not None, components, clim)


class MapRow(NamedTuple):
    """A line of maps of a CCF, one for each component.

    error: of the field, or None. gaits: drawn on the maps. labels: of the two shape
    variables. shadows: curves of gaits that leave the plane, seen on it."""

    field: Field
    error: Field | None
    gaits: Sequence = ()
    labels: Labels = ANGLES
    shadows: Sequence = ()


def _plane_row(plane: Plane | Slice, gait: Gait | None, labels: Labels) -> MapRow:
    """Return the maps of a plane, with the gait on it or as a shadow."""
    gaits = []
    shadows = []
    if gait is not None:
        projected = ProjectedGait(gait, plane)
        if projected.lies_in_plane:
            gaits.append(projected)
        else:
            shadows.append(projected)
    pair = [labels[k - 1] for k in plane.pair]
    return MapRow(plane.ccf, plane.error, gaits, pair, shadows)


def _angle_labels(joints: int) -> Labels:
    """Return labels of shape variables that are joint angles."""
    return [(f"alpha_{k + 1}", "rad") for k in range(joints)]


def plane_title(plane: Plane | Slice, labels: Labels) -> str:
    """Return the angles of the fixed joints of a plane as a title."""
    if not plane.fixed:
        return ""
    fixed = [k - 1 for k in plane.fixed]
    angles = [f"{quantity(labels[k][0])} = {plane.at[k]:.3g}" for k in fixed]
    unit = labels[fixed[0]][1]
    return f"{with_minus_signs(', '.join(angles))} {unit}"


def _draw_rows(
    rows: Sequence[MapRow],
    style: str,
    metric: Metric | Finsler | None,
    names: Sequence[str],
    same_scale: bool,
    components: Sequence[str],
    clim: float | str | None,
) -> Figure:
    """Draw the components of CCFs, a line of panels for each row.

    same_scale: rows have the same limits of colours."""
    draw = CCF_STYLES[choose("style", style, CCF_STYLES)]
    present = [[has_component(r.field, k) for k in range(3)] for r in rows]
    panels = panel_components(components, present)
    is_surface = getattr(draw, "projection", "") == "3d"
    if is_surface:
        fig, axes = _surface_panels(len(panels), len(rows))
    else:
        fig, axes = _map_panels(len(panels), len(rows))

    options: dict[str, Any] = {}
    if style == "map":
        options["metric"] = metric
    for k, component in enumerate(panels):
        limits = _colour_limits(rows, component, clim, same_scale)
        for row, ax, limit in zip(rows, axes[:, k], limits):
            draw(
                row.field,
                component,
                row.gaits,
                ax=ax,
                error=row.error,
                labels=row.labels,
                clim=limit,
                **options,
            )
            for shadow in row.shadows:
                _draw_shadow(shadow, ax, row.field, is_surface)

    notes = []
    if any(row.shadows for row in rows):
        notes.append(SHADOW)
    note_zero_components(fig, panels, components, ccf_name, *notes)
    if style == "map":
        _merge_legends(fig, axes)
    _name_rows(axes, names)
    if not is_surface:
        _save_width(axes)
    return fig


def _surface_panels(columns: int, rows: int) -> tuple[Any, Any]:
    """Return (Figure, 3-D Axes) of surfaces."""
    width = 1.0 + 3.6 * columns
    fit = columns_that_fit(width, columns)
    fig, axes = panels(width, 3.6 * rows, columns, rows, fit, {"projection": "3d"})
    fig.get_layout_engine().set(w_pad=0.25)
    return fig, axes


def _map_panels(columns: int, rows: int) -> tuple[Any, Any]:
    """Return (Figure, Axes) of maps."""
    width = 0.3 + COLUMN_WIDTH * columns
    height = 3.2 + 2.75 * (rows - 1)
    fig, axes = figure(width, height, columns, rows, layout="compressed")
    # The widest labels of several rows need a margin.
    right = 0.97 if rows > 1 else 1.0
    fig.get_layout_engine().set(rect=(0.0, 0.0, right, 1.0))
    return fig, axes


def _colour_limits(
    rows: Sequence[MapRow],
    component: int,
    clim: float | str | None,
    same_scale: bool,
) -> list[float | None]:
    """Return the limit of the colours of each row's map; None where it is zero."""
    limits: list[float | None] = []
    for row in rows:
        if has_component(row.field, component):
            limits.append(scale_limit(row.field.values[component], clim))
        else:
            limits.append(None)
    if same_scale:
        highest = max((x for x in limits if x), default=None)
        return [highest] * len(rows)
    return limits


def _draw_shadow(gait: ProjectedGait, ax: Any, field: Field, is_surface: bool) -> None:
    """Draw a gait that leaves the plane, as seen along the fixed joints."""
    if is_surface:
        floor = ax.get_zlim()[0]
        curve = inside_periods(gait.shape(PHASES), field.axes, field.periods)
        ax.plot(*curve.T, floor, "--", color="black", lw=1.0)
    else:
        draw_gait(gait, ax, within=field.axes, line="--", periods=field.periods)


def _merge_legends(fig: Figure, axes: Any) -> None:
    """Replace the legends of maps, which explain the same, by one: below the maps, or
    above them where there is a note below."""
    handles = {}
    for ax in axes.flat:
        legend = ax.get_legend()
        if legend is not None:
            handles |= {h.get_label(): h for h in legend.legend_handles}
            legend.remove()
    if handles:
        side = "upper" if fig.get_supxlabel() else "lower"
        fig.legend(
            handles=[*handles.values()],
            loc=f"outside {side} center",
            ncols=len(handles),
        )


def _save_width(axes: Any) -> None:
    """Leave the width of a page to maps that stand side by side: the panels of a line
    share the label of y, and the unit of a colour bar stands in the title.

    axes: (rows, columns), of maps whose lines have the same y."""
    asked = current().inches
    side_by_side = axes[0, 0].get_gridspec().ncols
    if asked is None or side_by_side == 1 or asked >= COLUMN_WIDTH * side_by_side:
        return
    for ax in axes.flat:
        if not ax.get_subplotspec().is_first_col():
            ax.set_ylabel("")
            ax.tick_params(labelleft=False)
        for drawn in ax.collections:
            bar = getattr(drawn, "colorbar", None)
            if bar is not None:
                unit = bar.ax.get_ylabel().rpartition(" ")[2]
                bar.set_label("")
                ax.set_title(f"{ax.get_title()} {unit}")


def _name_rows(axes: Any, names: Sequence[str]) -> None:
    """Write the name of each row at its left."""
    from matplotlib.transforms import ScaledTranslation

    for row, name in zip(axes, names):
        ax = row[0]
        place = -0.33
        transform = ax.transAxes
        if current().inches is not None:
            # Left of the label, however wide the panel is.
            place = 0.0
            inches = ScaledTranslation(ROW_NAME, 0, ax.figure.dpi_scale_trans)
            transform = transform + inches
        look = {
            "transform": transform,
            "rotation": 90,
            "ha": "center",
            "va": "center",
            "fontsize": font_points(10),
        }
        if hasattr(ax, "text2D"):
            look["transform"] = ax.transAxes
            ax.text2D(0.03, 0.5, name, in_layout=False, **look)
        else:
            ax.add_artist(_row_name(place, name, look))


def _row_name(place: float, name: str, look: dict[str, Any]) -> Any:
    """Return the name of a row as a text that takes room beside its panel alone.

    As for the label of an axis, its length does not count in the layout: a name longer
    than a map would push the rows apart until no map is left."""
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

    class RowName(Text):
        def get_tightbbox(self, renderer: Any = None) -> Any:
            box = super().get_tightbbox(renderer)
            if box is None:
                return None
            middle = (box.y0 + box.y1) / 2
            return Bbox.from_extents(box.x0, middle - 0.5, box.x1, middle + 0.5)

    return RowName(place, 0.5, name, in_layout=True, clip_on=False, **look)
