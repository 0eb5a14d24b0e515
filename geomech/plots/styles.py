"""Other ways to draw a connection and its CCF: streamlines, contours with the gait's
area shaded, surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.periods import Periods, ends_differ, period_of
from geomech.mathematics.geometry.representations.field import Field
from geomech.plots.look import colours, font_points
from geomech.plots.maps import (
    ANGLES,
    PHASES,
    ROW_ROUNDING,
    TITLES,
    Labels,
    arrow_colours,
    ccf_label,
    ccf_map,
    ccf_name,
    draw_gait,
    drawable,
    inside_periods,
    label_row,
    refined,
    scale_limit,
    shape_space,
    vector_field,
)
from geomech.plots.style import axes_of, blank, quantity, styled, with_minus_signs
from rft.core.registry import Registry, functions_with

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONNECTION_STYLES = Registry(
    "geomech.connection_styles",
    "style",
    "a way to draw a connection",
    functions_with("draws", "connection"),
)
CCF_STYLES = Registry(
    "geomech.ccf_styles", "style", "a way to draw a CCF", functions_with("draws", "ccf")
)
CONNECTION_STYLES.register(vector_field, style="quiver")
CCF_STYLES.register(ccf_map, style="map")

STREAM_POINTS = 61  # along an axis, at most: the grid that streamlines are drawn on
CONTOURS = 6  # of either sign
AREA_POINTS = 240  # along an axis: the grid on which a gait's area is shaded
PLUS = "#B2182B"  # areas that move the body forwards, to the left or turn it left
MINUS = "#2166AC"  # areas that move it the opposite way
DIRECTIONS = (  # of PLUS and MINUS, by component
    ("ahead", "backwards"),
    ("to the left", "to the right"),
    ("turns left", "turns right"),
)


@CONNECTION_STYLES.register(style="streamlines")
@styled
def streamlines(
    connection: Connection,
    component: int = 0,
    *,
    ax: Axes | None = None,
    labels: Labels = ANGLES,
    top: float | None = None,
    clim: float | str | None = None,
) -> Axes:
    """Draw row ``component`` of A as streamlines over shape space, coloured by the
    row's length.

    Along a line a change of shape moves the body the most for its size, across it not
    at all. Arguments as for `vector_field`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.streamlines(study.fitted, 0)
    """
    from matplotlib.colors import Normalize

    ax = axes_of(ax)
    row = Field(connection.axes, connection.A[component], connection.degree)
    if row.masked:
        axes = list(connection.axes)
        u, v = row.values
    else:
        axes = [
            np.linspace(a[0], a[-1], min(STREAM_POINTS, 4 * len(a)))
            for a in connection.axes
        ]
        shapes = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
        u, v = np.moveaxis(row(shapes), -1, 0)
    lengths = np.hypot(u, v)
    top = top or scale_limit(lengths, clim)
    largest_entry = np.nanmax(np.abs(connection.A), initial=0.0)
    if np.nanmax(lengths, initial=0.0) <= ROW_ROUNDING * largest_entry:
        u = 0 * u
        v = 0 * v
        lengths = 0 * lengths

    # streamplot refuses spacing that differs in its last digit.
    even = [np.linspace(a[0], a[-1], len(a)) for a in axes]
    lines = ax.streamplot(
        *even,
        u.T,
        v.T,
        color=np.nan_to_num(lengths.T),
        cmap=arrow_colours(),
        norm=Normalize(0.0, top),
        density=1.1,
        linewidth=0.9,
        arrowsize=0.8,
    )
    return label_row(ax, lines.lines, component, connection, labels, lengths)


@CCF_STYLES.register(style="contours")
@styled
def ccf_contours(
    field: Field,
    component: int = 0,
    gaits: Sequence[Gait] = (),
    *,
    ax: Axes | None = None,
    error: Field | None = None,
    labels: Labels = ANGLES,
    clim: float | str | None = None,
) -> Axes:
    """Draw a component of the CCF as contours, dashed below zero, and shade the area of
    each gait by the sign of its contribution to the displacement: CCF times winding
    number.

    error: of the field; shapes where it exceeds the value are not shaded. Other
    arguments as for `ccf_map`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.ccf_contours(study.curvature, 0)
    """
    ax = axes_of(ax)
    field = drawable(field)
    axes, values = refined(field, field.values[component])
    _draw_contours(ax, axes, values, scale_limit(values, clim))
    shape_space(ax, field.axes, labels)
    signs = set()
    for gait in gaits:
        signs |= _shade_area(ax, field, component, gait, error)
        draw_gait(gait, ax, within=field.axes, periods=field.periods)
    if signs:
        _sign_legend(ax, component, signs, -0.2)
    ax.set_title(f"{ccf_label(component, field.unit, labels)}: {TITLES[component]}")
    return ax


def _draw_contours(
    ax: Axes, axes: Sequence[np.ndarray], values: np.ndarray, limit: float
) -> None:
    """Draw contours at round values between -limit and limit, every second one with its
    value."""
    from matplotlib.ticker import MaxNLocator

    steps = [1, 2, 2.5, 5, 10]
    ticks = MaxNLocator(2 * CONTOURS, steps=steps, symmetric=True)
    levels = ticks.tick_values(-limit, limit)
    colours = []
    widths = []
    dashes = []
    for level in levels:
        is_zero = abs(level) <= 1e-9 * limit
        colours.append("0.6" if is_zero else "0.25")
        widths.append(1.4 if is_zero else 0.6)
        dashes.append("--" if level < 0 and not is_zero else "-")
    lines = ax.contour(
        *axes,
        values.T,
        levels=levels,
        colors=colours,
        linewidths=widths,
        linestyles=dashes,
    )

    def label(level: float) -> str:
        return with_minus_signs(f"{level:g}")

    ax.clabel(lines, levels[::2], fmt=label, fontsize=font_points(6))


def _sign_legend(ax: Axes, component: int, signs: set[int], y: float) -> None:
    """Explain the shades of these signs below a map, with the legend's top at a height
    of the axes."""
    from matplotlib.patches import Patch

    ahead, back = DIRECTIONS[component]
    handles = []
    for sign, colour, label in ((1, PLUS, ahead), (-1, MINUS, back)):
        if sign in signs:
            handles.append(Patch(facecolor=colour, alpha=0.35, label=label))
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, y), ncols=2)


def _shade_area(
    ax: Axes, field: Field, component: int, gait: Gait, error: Field | None
) -> set[int]:
    """Shade the area of a gait by the sign of CCF times winding number; return the
    signs that occur."""
    if field.masked:
        return set()
    x, y = (np.linspace(a[0], a[-1], AREA_POINTS) for a in field.axes)
    shapes = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    times = times_enclosed(gait, x, y, field.periods)
    density = Field(field.axes, field.values[component], 1)(shapes) * times
    if error is not None:
        errors = Field(error.axes, error.values[component], 1)(shapes)
        density[np.abs(density) <= np.abs(times) * errors] = 0.0
    signs = set()
    for sign, colour in ((1, PLUS), (-1, MINUS)):
        mask = sign * density > 0
        if mask.any():
            signs.add(sign)
            look = {"levels": [0.5, 2.0], "colors": [colour], "alpha": 0.35}
            ax.contourf(x, y, mask.T, zorder=0, **look)
    return signs


def times_enclosed(
    gait: Gait, x: np.ndarray, y: np.ndarray, periods: Periods
) -> np.ndarray:
    """Return how often a gait goes around the points of the grid x (N,) by y (M,),
    positive counter-clockwise; (N, M).

    On axes with periods it goes around a point if it goes around it whole periods away,
    and a gait that winds is closed by its loop at rest, run backwards."""
    curve = gait.shape(PHASES)
    if not periods:
        return winding(curve, x, y)
    if ends_differ(gait):
        try:
            rest = gait.shape(PHASES, 0.0)
        except TypeError:  # a curve without a family
            return np.zeros((len(x), len(y)), int)
        curve = np.concatenate([curve, rest[::-1]])
    shifts = []
    for k, grid in enumerate((x, y)):
        period = period_of(periods, k)
        if period is None:
            shifts.append([0.0])
            continue
        low = np.floor((curve[:, k].min() - grid[0]) / period)
        high = np.floor((curve[:, k].max() - grid[0]) / period)
        shifts.append(period * np.arange(low, high + 1))
    times = np.zeros((len(x), len(y)), int)
    for x_shift in shifts[0]:
        for y_shift in shifts[1]:
            times += winding(curve, x + x_shift, y + y_shift)
    return times


def winding(curve: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the winding number (N, M) of a closed curve (P, 2) around the points of
    the grid x (N,) by y (M,), positive counter-clockwise.

    It counts the crossings, with their sign, of the line from each point to the
    right."""
    x0, y0 = curve.T
    x1, y1 = np.roll(curve, -1, 0).T
    start_below = y0[:, None] <= y
    end_below = y1[:, None] <= y
    k, j = np.nonzero(start_below != end_below)
    x_crossing = x0[k] + (y[j] - y0[k]) / (y1[k] - y0[k]) * (x1[k] - x0[k])
    crossings = np.zeros((len(x) + 1, len(y)), int)
    sign = np.where(start_below[k, j], 1, -1)
    np.add.at(crossings, (np.searchsorted(x, x_crossing), j), sign)
    return np.cumsum(crossings[::-1], 0)[::-1][1:]


@CCF_STYLES.register(style="surface", projection="3d")
@styled
def ccf_surface(
    field: Field,
    component: int = 0,
    gaits: Sequence[Gait] = (),
    *,
    ax: Axes | None = None,
    error: Field | None = None,
    labels: Labels = ANGLES,
    clim: float | str | None = None,
) -> Axes:
    """Draw a component of the CCF as a surface over shape space, with gaits on it and,
    on the plane below, their areas shaded by sign as in `ccf_contours`.

    ax: of projection "3d"; by default one of a new figure. error: not drawn. Other
    arguments as for `ccf_map`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.ccf_surface(study.curvature, 0)
    """
    from cmcrameri import cm

    if ax is None:
        ax = blank(4.2, 3.6).add_subplot(projection="3d")
    field = drawable(field)
    axes, values = refined(field, field.values[component])
    top = scale_limit(values, clim)
    ax.plot_surface(
        *np.meshgrid(*axes, indexing="ij"),
        np.clip(values, -top, top),
        cmap=colours(cm.vik),
        vmin=-top,
        vmax=top,
        rcount=121,
        ccount=121,
        lw=0,
        antialiased=False,
        rasterized=True,
        alpha=0.9,
    )
    floor = -1.6 * top
    signs = set()
    for gait in gaits:
        curve = inside_periods(gait.shape(PHASES), field.axes, field.periods)
        ax.plot(*curve.T, floor, color="black", lw=1.0)
        if not field.masked:
            _draw_on_surface(ax, field, component, gait, top)
            signs |= _shade_floor(ax, field, component, gait, floor)
    if signs:
        _sign_legend(ax, component, signs, 0.0)

    ax.set(
        xlabel=quantity(*labels[0]),
        ylabel=quantity(*labels[1]),
        zlim=(floor, top),
        title=f"{ccf_name(component)}: {TITLES[component]}",
    )
    ax.set_zlabel(ccf_label(component, field.unit, labels), labelpad=6)
    ax.set_zticks([x for x in ax.get_zticks() if -top <= x <= top])
    ax.tick_params(labelsize=font_points(7))
    ax.view_init(elev=28, azim=-58)
    ax.set_box_aspect(None, zoom=0.86)
    return ax


def _draw_on_surface(
    ax: Axes, field: Field, component: int, gait: Gait, top: float
) -> None:
    """Draw a gait at the height of the surface, as far as the field goes."""
    curve = inside_periods(gait.shape(PHASES), field.axes, field.periods)
    low = [axis[0] for axis in field.axes]
    high = [axis[-1] for axis in field.axes]
    inside = ((curve >= low) & (curve <= high)).all(-1)
    surface = Field(field.axes, field.values[component], field.degree)
    height = np.full(len(curve), np.nan)
    height[inside] = surface(curve[inside])
    height = np.clip(height, -top, top)
    ax.plot(*curve.T, height, color="black", lw=1.4, zorder=10)


def _shade_floor(
    ax: Axes, field: Field, component: int, gait: Gait, floor: float
) -> set[int]:
    """Shade the area of a gait on the plane below a surface; return the signs that
    occur."""
    x, y = (np.linspace(a[0], a[-1], AREA_POINTS // 2) for a in field.axes)
    shapes = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    times = times_enclosed(gait, x, y, field.periods)
    density = Field(field.axes, field.values[component], 1)(shapes) * times
    signs = set()
    for sign, colour in ((1, PLUS), (-1, MINUS)):
        mask = sign * density > 0
        if mask.any():
            signs.add(sign)
            ax.contourf(
                *np.moveaxis(shapes, -1, 0),
                mask.astype(float),
                zdir="z",
                offset=floor,
                levels=[0.5, 2.0],
                colors=[colour],
                alpha=0.35,
            )
    return signs
