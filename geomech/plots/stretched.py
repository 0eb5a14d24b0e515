"""The CCF on shape space redrawn so that equal lengths on paper are equal path lengths
(`geomech.mathematics.geometry.stretch`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.stretch import Stretch
from geomech.plots.look import font_points
from geomech.plots.maps import (
    ANGLES,
    PHASES,
    TITLES,
    Labels,
    ccf_name,
    certain,
    colorbar_extend,
    component_unit,
    draw_arrow,
    draw_colours,
    has_component,
    is_inside,
    note_zero_components,
    panel_components,
    scale_limit,
    unknown,
)
from geomech.plots.style import axes_of, figure, quantity, styled, with_minus_signs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def stretched_map(
    field: Field,
    stretch: Stretch,
    component: int = 0,
    gaits: Sequence[Gait] = (),
    *,
    ax: Axes | None = None,
    error: Field | None = None,
    labels: Labels = ANGLES,
    unit: str = "BL",
    clim: float | str | None = None,
) -> Axes:
    """Draw a component of the CCF over stretched shape space, per area there.

    An area on paper times its colour is its part of the displacement, and the length of
    a gait is its path length. Lines of constant shape variables are thin, and thick at
    0.

    unit: of path length. clim: as for `ccf_figure`, of the values per area there. Other
    arguments as for `ccf_map`.

    Examples
    --------
    >>> import geomech
    >>> from geomech.mathematics.geometry.stretch import stretch
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> plane = stretch(study.metric)
    >>> gait = study.scene.gait
    >>> ax = geomech.plots.stretched_map(study.curvature, plane, gaits=[gait])
    >>> ax.get_xlabel()
    'path length (BL)'
    """
    ax = axes_of(ax)
    values = stretch.density(Field(field.axes, field.values[component], field.degree))
    top = scale_limit(values, clim)
    u, v = stretch.field.values
    image = draw_colours(ax, u, v, values, top, "gouraud")
    if error is not None:
        errors = stretch.density(Field(error.axes, error.values[component], 1))
        hidden = unknown(values, errors)
        hatching = {"levels": [0.5, 2.0], "colors": "none", "hatches": ["||||||"]}
        ax.contourf(u, v, hidden.astype(float), **hatching)
        values = np.where(hidden, np.nan, certain(values, errors))
    if np.nanmin(values) < 0 < np.nanmax(values):
        ax.contour(u, v, values, levels=[0.0], colors="0.35", linewidths=0.6)

    _draw_shape_lines(ax, stretch, labels)
    for gait in gaits:
        _draw_gait(gait, ax, stretch)
    label = quantity("path length", unit)
    ax.set(aspect="equal", xlabel=label, ylabel=label)
    ax.set_title(f"{ccf_name(component)}: {TITLES[component]}")
    extend = colorbar_extend(image.get_array(), top)
    bar = ax.figure.colorbar(image, ax=ax, shrink=0.85, extend=extend)
    area_unit = f"{unit}$^2$" if unit.isalpha() else f"({unit})$^2$"
    density_unit = f"{component_unit(component, field.unit)}/{area_unit}"
    bar.set_label(f"{ccf_name(component)} / area ({density_unit})")
    return ax


def _draw_shape_lines(ax: Axes, stretch: Stretch, labels: Labels) -> None:
    """Draw and label lines of constant shape variables at round values, and set the
    limits of the axes."""
    for k in (0, 1):
        ticks = _round_values(stretch.field.axes[k])
        _draw_constant_lines(ax, stretch, k, ticks)
        _label_constant_lines(ax, stretch, k, ticks, labels[k])
    spans = np.array([[x.min(), x.max()] for x in stretch.field.values])
    pad = 0.2 * np.ptp(spans, axis=1).max()
    ax.set(xlim=spans[0] + [-pad, pad / 4], ylim=spans[1] + [-pad, pad / 4])


def _round_values(axis: np.ndarray) -> list[float]:
    """Return some round values within an axis of the grid."""
    from matplotlib.ticker import MaxNLocator

    ticks = MaxNLocator(6, steps=[1, 2, 5, 10])
    return [x for x in ticks.tick_values(axis[0], axis[-1]) if axis[0] <= x <= axis[-1]]


def _shapes_at(k: int, value, other) -> np.ndarray:
    """Return shapes (N, 2) at which variable k has a value and the other one
    another."""
    if k == 0:
        return np.stack(np.broadcast_arrays(value, other), -1)
    return np.stack(np.broadcast_arrays(other, value), -1)


def _draw_constant_lines(
    ax: Axes, stretch: Stretch, k: int, ticks: list[float]
) -> None:
    """Draw lines of constant shape variable k, at ticks and at the edges of the
    grid."""
    axis = stretch.field.axes[k]
    other = stretch.field.axes[1 - k]
    along = np.linspace(other[0], other[-1], 121)
    for x in sorted({*ticks, axis[0], axis[-1]}):
        is_edge = x in (axis[0], axis[-1])
        width = 0.9 if is_edge or x == 0 else 0.3
        alpha = 1.0 if is_edge else 0.6
        line = stretch(_shapes_at(k, x, along))
        ax.plot(*line.T, color="0.15", lw=width, alpha=alpha)


def _label_constant_lines(
    ax: Axes, stretch: Stretch, k: int, ticks: list[float], label: tuple[str, str]
) -> None:
    """Write the values of shape variable k where its lines begin, and its name along
    the edge."""
    other = stretch.field.axes[1 - k]
    ends = stretch(_shapes_at(k, ticks, other[0]))
    inner = stretch(_shapes_at(k, ticks, other[0] + 0.02 * np.ptp(other)))
    outwards = ends - inner
    size = np.ptp(stretch.field.values, axis=(1, 2)).max()
    outwards *= 0.045 * size / np.linalg.norm(outwards, axis=-1, keepdims=True)

    centred = {"ha": "center", "va": "center"}
    for x, place in zip(ticks, ends + outwards):
        text = with_minus_signs(f"{x:g}")
        ax.text(*place, text, fontsize=font_points(6), color="0.3", **centred)
    middle = len(ticks) // 2
    along_x, along_y = ends[middle + 1] - ends[middle - 1]
    tilt = np.degrees(np.arctan2(along_y, along_x))
    ax.text(
        *(ends + 3.4 * outwards)[middle],
        quantity(*label),
        fontsize=font_points(8),
        rotation=(tilt + 80) % 180 - 80,
        rotation_mode="anchor",
        **centred,
    )


def _draw_gait(gait: Gait, ax: Axes, stretch: Stretch) -> None:
    """Draw a gait on stretched shape space as `draw_gait` draws it on the grid."""
    axes = stretch.field.axes
    shapes = gait.shape(PHASES)
    inside = is_inside(shapes, axes)
    low = [axis[0] for axis in axes]
    high = [axis[-1] for axis in axes]
    curve = np.full(shapes.shape, np.nan)
    curve[inside] = stretch(np.clip(shapes, low, high)[inside])
    ax.plot(*curve.T, color="black", lw=1.2)
    ax.plot(*curve[0], "o", color="black", ms=3)
    if np.isfinite(curve[50:59]).all():
        draw_arrow(ax, curve[50], curve[58])


@styled
def stretched_figure(
    field: Field,
    stretch: Stretch,
    gaits: Sequence[Gait] = (),
    *,
    error: Field | None = None,
    labels: Labels = ANGLES,
    unit: str = "BL",
    components: Sequence[str] = (),
    clim: float | str | None = None,
) -> Figure:
    """Draw `stretched_map` of the components side by side, and write below how far
    lengths on paper are off. components, clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> from geomech.mathematics.geometry.stretch import stretch
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> plane = stretch(study.metric)
    >>> ccf = study.curvature
    >>> fig = geomech.plots.stretched_figure(ccf, plane, components=["x"])
    """
    panels = panel_components(components, [[has_component(field, k) for k in range(3)]])
    fig, axes = figure(0.3 + 3.7 * len(panels), 3.5, len(panels), layout="compressed")
    options = {"error": error, "labels": labels, "unit": unit, "clim": clim}
    for component, ax in zip(panels, axes[0]):
        stretched_map(field, stretch, component, gaits, ax=ax, **options)
    rms = 100 * stretch.rms
    largest = 100 * stretch.largest
    note = f"lengths on paper are off by {rms:.2g} % rms, {largest:.2g} % at most"
    if stretch.folded:
        note += f"; {100 * stretch.folded:.2g} % of the plane is folded over"
    note_zero_components(fig, panels, components, ccf_name, note)
    return fig
