"""Other ways to draw a connection and its CCF: streamlines, contours with the gait's area shaded, surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.gaits import Gait
from geomech.geometry.connection import Connection
from geomech.geometry.field import Field
from geomech.plots.maps import (
    ANGLES,
    PHASES,
    TITLES,
    Labels,
    arrow_colours,
    ccf_label,
    ccf_map,
    ccf_name,
    draw_gait,
    drawable,
    finer,
    label_row,
    limit_of,
    shape_space,
    unit_of,
    vector_field,
)
from geomech.plots.style import axes_of, quantity, styled
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
LINES = 61  # points an axis that streamlines are drawn on
LEVELS = 6  # contours of either sign
AREA = 240  # points an axis on which a gait's area is shaded
MINUS_SIGN = "\N{MINUS SIGN}"
DIRECTIONS = (
    ("ahead", "backwards"),
    ("to the left", "to the right"),
    ("turns left", "turns right"),
)
PLUS, MINUS = (
    "#B2182B",
    "#2166AC",
)  # of areas that carry forwards and backwards, or to either side


@CONNECTION_STYLES.register(style="streamlines")
@styled
def streamlines(
    connection: Connection, component: int = 0, *, ax: Axes | None = None, labels: Labels = ANGLES,
    top: float | None = None, clim: float | str | None = None,
) -> Axes:  # fmt: skip
    """Draw row ``component`` of A as streamlines over shape space: along them a change of shape moves the body the most for
    its size, across them not at all. Colour: length of the row. Other arguments as for `vector_field`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.streamlines(study.fitted, 0)
    """
    from matplotlib.colors import Normalize

    ax = axes_of(ax)
    axes = [np.linspace(a[0], a[-1], min(LINES, 4 * len(a))) for a in connection.axes]
    row = Field(connection.axes, connection.A[component], connection.degree)
    if row.masked:
        axes, values = list(connection.axes), row.values
    else:
        values = np.moveaxis(
            row(np.stack(np.meshgrid(*axes, indexing="ij"), -1)), -1, 0
        )
    even = [
        np.linspace(a[0], a[-1], len(a)) for a in axes
    ]  # to the last digit, as streamplot asks
    u, v = values
    size = np.hypot(u, v)
    most = top or limit_of(size, clim)
    if np.nanmax(size, initial=0.0) <= 1e-13 * np.nanmax(
        np.abs(connection.A), initial=0.0
    ):
        u, v, size = 0 * u, 0 * v, 0 * size
    look = {
        "cmap": arrow_colours(),
        "norm": Normalize(0.0, most),
        "density": 1.1,
        "linewidth": 0.9,
        "arrowsize": 0.8,
    }
    lines = ax.streamplot(*even, u.T, v.T, color=np.nan_to_num(size.T), **look)
    return label_row(ax, lines.lines, component, connection, labels, size)


@CCF_STYLES.register(style="contours")
@styled
def ccf_contours(
    field: Field, component: int = 0, gaits: Sequence[Gait] = (), *, ax: Axes | None = None, error: Field | None = None,
    labels: Labels = ANGLES, clim: float | str | None = None,
) -> Axes:  # fmt: skip
    """Draw a component of the CCF as contours, dashed below zero, and shade the area of each gait by the sign of its
    contribution to the displacement: CCF times winding number.

    error: shapes where it exceeds the value have no shade. Other arguments as for `ccf_map`.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.ccf_contours(study.curvature, 0)
    """
    from matplotlib.ticker import MaxNLocator

    ax, field = axes_of(ax), drawable(field)
    axes, values = finer(field, field.values[component])
    most = limit_of(values, clim)
    levels = MaxNLocator(
        2 * LEVELS, steps=[1, 2, 2.5, 5, 10], symmetric=True
    ).tick_values(-most, most)
    looks = {0: ("0.6", 1.4, "-"), 1: ("0.25", 0.6, "-"), -1: ("0.25", 0.6, "--")}
    colours, widths, dashes = zip(
        *(looks[int(np.sign(x)) if abs(x) > 1e-9 * most else 0] for x in levels)
    )
    lines = ax.contour(
        *axes,
        values.T,
        levels=levels,
        colors=colours,
        linewidths=widths,
        linestyles=dashes,
    )
    ax.clabel(
        lines, levels[::2], fmt=lambda x: f"{x:g}".replace("-", MINUS_SIGN), fontsize=6
    )
    shape_space(ax, field.axes, labels)
    signs = set()
    for gait in gaits:
        signs |= _shaded(ax, field, component, gait, error)
        draw_gait(gait, ax, within=field.axes)
    if signs:
        ax.legend(
            handles=_legend_patches(component, signs),
            loc="upper center",
            bbox_to_anchor=(0.5, -0.2),
            ncols=2,
        )
    ax.set_title(f"{ccf_label(component, field.unit, labels)}: {TITLES[component]}")
    return ax


def _legend_patches(component: int, signs: set[int]) -> list:
    """Return handles for a legend of the shades of these signs."""
    from matplotlib.patches import Patch

    looks = ((1, PLUS), (-1, MINUS))
    return [
        Patch(facecolor=c, alpha=0.35, label=DIRECTIONS[component][k])
        for k, (s, c) in enumerate(looks)
        if s in signs
    ]


def _shaded(
    ax, field: Field, component: int, gait: Gait, error: Field | None
) -> set[int]:
    """Shade the area of a gait by the sign of CCF times winding number; return the signs that occur."""
    x, y = (np.linspace(a[0], a[-1], AREA) for a in field.axes)
    shapes = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    times = winding(gait.shape(PHASES), x, y)
    if field.masked:
        return set()
    density = Field(field.axes, field.values[component], 1)(shapes) * times
    if error is not None:
        density[
            np.abs(density)
            <= np.abs(times) * Field(error.axes, error.values[component], 1)(shapes)
        ] = 0.0
    found = {s for s in (1, -1) if (s * density > 0).any()}
    for s in found:
        ax.contourf(
            x,
            y,
            (s * density > 0).T,
            levels=[0.5, 2.0],
            colors=[PLUS if s > 0 else MINUS],
            alpha=0.35,
            zorder=0,
        )
    return found


def winding(curve: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the winding number (N, M) of a closed curve (P, 2) around the points of the grid x (N,) by y (M,), positive
    counter-clockwise: crossings, of either sign, of the line from each point to the right."""
    (x0, y0), (x1, y1) = curve.T, np.roll(curve, -1, 0).T
    below, above = y0[:, None] <= y, y1[:, None] <= y
    k, j = np.nonzero(below != above)
    at = x0[k] + (y[j] - y0[k]) / (y1[k] - y0[k]) * (x1[k] - x0[k])
    crossed = np.zeros((len(x) + 1, len(y)), int)
    np.add.at(crossed, (np.searchsorted(x, at), j), np.where(below[k, j], 1, -1))
    return np.cumsum(crossed[::-1], 0)[::-1][1:]


@CCF_STYLES.register(style="surface", projection="3d")
@styled
def ccf_surface(
    field: Field, component: int = 0, gaits: Sequence[Gait] = (), *, ax: Axes | None = None, error: Field | None = None,
    labels: Labels = ANGLES, clim: float | str | None = None,
) -> Axes:  # fmt: skip
    """Draw a component of the CCF as a surface over shape space, with gaits on it and, on the plane below, their areas shaded
    by sign as in `ccf_contours`.

    ax: of projection "3d"; without it one of a new figure.

    Examples
    --------
    >>> import geomech
    >>> ax = geomech.plots.ccf_surface(geomech.study("three-link-viscous", grid=15).tables.curvature, 0)
    """
    from cmcrameri import cm

    from geomech.plots.style import blank

    ax = blank(4.2, 3.6).add_subplot(projection="3d") if ax is None else ax
    field = drawable(field)
    axes, values = finer(field, field.values[component])
    most = limit_of(values, clim)
    clipped = np.clip(values, -most, most)
    ax.plot_surface(
        *np.meshgrid(*axes, indexing="ij"), clipped, cmap=cm.vik, vmin=-most, vmax=most, rcount=121, ccount=121, lw=0,
        antialiased=False, rasterized=True, alpha=0.9,
    )  # fmt: skip
    floor, signs = -1.6 * most, set()
    for gait in gaits:
        curve = gait.shape(PHASES)
        ax.plot(*curve.T, floor, color="black", lw=1.0)
        if not field.masked:
            inside = (
                (curve >= [a[0] for a in axes]) & (curve <= [a[-1] for a in axes])
            ).all(-1)
            height = np.full(len(curve), np.nan)
            height[inside] = Field(field.axes, field.values[component], field.degree)(
                curve[inside]
            )
            ax.plot(
                *curve.T, np.clip(height, -most, most), color="black", lw=1.4, zorder=10
            )
            signs |= _floor(ax, field, component, gait, floor)
    if signs:
        ax.legend(
            handles=_legend_patches(component, signs),
            loc="upper center",
            bbox_to_anchor=(0.5, 0.0),
            ncols=2,
        )
    ax.set(
        xlabel=quantity(*labels[0]), ylabel=quantity(*labels[1]), zlim=(floor, most),
        title=f"{ccf_name(component)}: {TITLES[component]}",
    )  # fmt: skip
    ax.set_zlabel(ccf_label(component, field.unit, labels), labelpad=6)
    ax.set_zticks([x for x in ax.get_zticks() if -most <= x <= most])
    ax.tick_params(labelsize=7)
    ax.view_init(elev=28, azim=-58)
    ax.set_box_aspect(None, zoom=0.86)
    return ax


def _floor(ax, field: Field, component: int, gait: Gait, floor: float) -> set[int]:
    """Shade the area of a gait on the plane below a surface; return the signs that occur."""
    x, y = (np.linspace(a[0], a[-1], AREA // 2) for a in field.axes)
    shapes = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    density = Field(field.axes, field.values[component], 1)(shapes) * winding(
        gait.shape(PHASES), x, y
    )
    for s, colour in ((1, PLUS), (-1, MINUS)):
        if (s * density > 0).any():
            ax.contourf(
                *np.moveaxis(shapes, -1, 0), (s * density > 0).astype(float), zdir="z", offset=floor, levels=[0.5, 2.0],
                colors=[colour], alpha=0.35,
            )  # fmt: skip
    return {s for s in (1, -1) if (s * density > 0).any()}


__all__ = [
    "CCF_STYLES",
    "CONNECTION_STYLES",
    "ccf_contours",
    "ccf_surface",
    "streamlines",
    "unit_of",
    "winding",
]
