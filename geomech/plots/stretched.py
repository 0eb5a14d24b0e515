"""The CCF on shape space redrawn so that equal lengths on paper are equal path lengths (`geomech.geometry.stretch`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.gaits import Gait
from geomech.geometry.field import Field
from geomech.geometry.stretch import Stretch
from geomech.plots.maps import (
    ANGLES,
    PHASES,
    TITLES,
    Labels,
    ccf_name,
    certain,
    extend,
    has,
    inside_of,
    limit_of,
    panels_of,
    say_left_out,
    unit_of,
    unknown,
)
from geomech.plots.style import axes_of, figure, quantity, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def stretched_map(
    field: Field, stretch: Stretch, component: int = 0, gaits: Sequence[Gait] = (), *, ax: Axes | None = None,
    error: Field | None = None, labels: Labels = ANGLES, unit: str = "BL",
    clim: float | str | None = None,
) -> Axes:  # fmt: skip
    """Draw a component of the CCF over stretched shape space, per area there: an area on paper times the colour is what it
    adds to the displacement, and the length of a gait is its path length. Lines of constant shape variables are thin, and
    thick at 0.

    unit: of path length. clim: as for `ccf_figure`, of the values per area there. Other arguments as for `ccf_map`.

    Examples
    --------
    >>> import geomech
    >>> from geomech.geometry.stretch import stretch
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.stretched_map(study.curvature, stretch(study.metric), gaits=[study.scene.gait])
    >>> ax.get_xlabel()
    'path length (BL)'
    """
    from cmcrameri import cm

    ax, values = (
        axes_of(ax),
        stretch.density(Field(field.axes, field.values[component], field.degree)),
    )
    most = limit_of(values, clim)
    u, v = stretch.field.values
    image = ax.pcolormesh(
        u,
        v,
        values,
        cmap=cm.vik,
        vmin=-most,
        vmax=most,
        shading="gouraud",
        rasterized=True,
    )
    if error is not None:
        limit = stretch.density(Field(error.axes, error.values[component], 1))
        ax.contourf(
            u,
            v,
            unknown(values, limit).astype(float),
            levels=[0.5, 2.0],
            colors="none",
            hatches=["||||||"],
        )
        values = np.where(unknown(values, limit), np.nan, certain(values, limit))
    if np.nanmin(values) < 0 < np.nanmax(values):
        ax.contour(u, v, values, levels=[0.0], colors="0.35", linewidths=0.6)
    _angles(ax, stretch, labels)
    for gait in gaits:
        _draw(gait, ax, stretch)
    ax.set(
        aspect="equal",
        xlabel=quantity("path length", unit),
        ylabel=quantity("path length", unit),
    )
    ax.set_title(f"{ccf_name(component)}: {TITLES[component]}")
    per = f"{unit}$^2$" if unit.isalpha() else f"({unit})$^2$"
    label = f"{ccf_name(component)} / area ({unit_of(component, field.unit)}/{per})"
    ax.figure.colorbar(
        image, ax=ax, shrink=0.85, extend=extend(image.get_array(), most)
    ).set_label(label)
    return ax


def _angles(ax, stretch: Stretch, labels: Labels) -> None:
    """Draw and label lines of constant shape variables at round values."""
    from matplotlib.ticker import MaxNLocator

    axes = stretch.field.axes
    for k, (axis, other) in enumerate(zip(axes, axes[::-1])):
        along = np.linspace(other[0], other[-1], 121)
        ticks = [
            x
            for x in MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(axis[0], axis[-1])
            if axis[0] <= x <= axis[-1]
        ]
        for x in sorted({*ticks, axis[0], axis[-1]}):
            shape = np.stack(
                [np.full_like(along, x), along][:: 1 if k == 0 else -1], -1
            )
            edge = x in (axis[0], axis[-1])
            ax.plot(
                *stretch(shape).T,
                color="0.15",
                lw=0.9 if edge or x == 0 else 0.3,
                alpha=1.0 if edge else 0.6,
            )
        end = stretch(
            np.stack([[x, other[0]] for x in ticks])[:, :: 1 if k == 0 else -1]
        )
        inner = stretch(
            np.stack([[x, other[0] + 0.02 * np.ptp(other)] for x in ticks])[
                :, :: 1 if k == 0 else -1
            ]
        )
        out = end - inner
        out *= (
            0.045
            * np.ptp(stretch.field.values, axis=(1, 2)).max()
            / np.linalg.norm(out, axis=-1, keepdims=True)
        )
        for x, at in zip(ticks, end + out):
            ax.text(
                *at,
                f"{x:g}".replace("-", "\N{MINUS SIGN}"),
                fontsize=6,
                ha="center",
                va="center",
                color="0.3",
            )
        middle = len(ticks) // 2
        tilt = np.degrees(np.arctan2(*(end[middle + 1] - end[middle - 1])[::-1]))
        name = {
            "rotation": (tilt + 80) % 180 - 80,
            "rotation_mode": "anchor",
            "ha": "center",
            "va": "center",
        }
        ax.text(*(end + 3.4 * out)[middle], quantity(*labels[k]), fontsize=8, **name)
    spans = np.array([[x.min(), x.max()] for x in stretch.field.values])
    pad = 0.2 * np.ptp(spans, axis=1).max()
    ax.set(xlim=spans[0] + [-pad, pad / 4], ylim=spans[1] + [-pad, pad / 4])


def _draw(gait: Gait, ax, stretch: Stretch) -> None:
    """Draw a gait as `draw_gait` does, on stretched shape space."""
    curve = gait.shape(PHASES)
    inside = inside_of(curve, stretch.field.axes)
    seen = np.full(curve.shape, np.nan)
    clipped = np.clip(
        curve, [a[0] for a in stretch.field.axes], [a[-1] for a in stretch.field.axes]
    )
    seen[inside] = stretch(clipped[inside])
    ax.plot(*seen.T, color="black", lw=1.2)
    ax.plot(*seen[0], "o", color="black", ms=3)
    if np.isfinite(seen[50:59]).all():
        style = {"arrowstyle": "-|>", "color": "black", "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", seen[58], seen[50], arrowprops=style)


@styled
def stretched_figure(
    field: Field, stretch: Stretch, gaits: Sequence[Gait] = (), *, error: Field | None = None,
    labels: Labels = ANGLES, unit: str = "BL", components: Sequence[str] = (), clim: float | str | None = None,
) -> Figure:  # fmt: skip
    """Draw the components side by side, with the errors of length of the plane. components, clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> from geomech.geometry.stretch import stretch
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> fig = geomech.plots.stretched_figure(study.curvature, stretch(study.metric), components=["x"])
    """
    panels = panels_of(components, [[has(field, k) for k in range(3)]])
    fig, axes = figure(0.3 + 3.7 * len(panels), 3.5, len(panels), layout="compressed")
    look = {"error": error, "labels": labels, "unit": unit, "clim": clim}
    for component, ax in zip(panels, axes[0]):
        stretched_map(field, stretch, component, gaits, ax=ax, **look)
    caption = f"lengths on paper are off by {100 * stretch.rms:.2g} % rms, {100 * stretch.largest:.2g} % at most"
    fold = (
        f"; {100 * stretch.folded:.2g} % of the plane is folded over"
        if stretch.folded
        else ""
    )
    say_left_out(fig, panels, components, ccf_name, caption + fold)
    return fig
