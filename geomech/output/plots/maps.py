"""Maps of shape space: rows of A as arrows, components of the CCF as colours, gaits as curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geomech.connection import Connection
from geomech.field import Field
from geomech.gaits import Gait
from geomech.output.plots.style import axes_of, figure, styled

ROUNDING = 1e-13  # of the largest entry of A: a row below it is nothing but rounding
COMPONENTS = ("x", "y", r"\theta")
FINEST = 400  # grid points along an axis of a map: about the dots of its picture


def shape_space(ax, axes: Sequence[np.ndarray]):
    """Label a plane of two joint angles and set it to the grid."""
    ax.set(
        xlabel=r"$\alpha_1$ (rad)", ylabel=r"$\alpha_2$ (rad)", aspect="equal",
        xlim=(axes[0][0], axes[0][-1]), ylim=(axes[1][0], axes[1][-1]),
    )  # fmt: skip
    return ax


@styled
def vector_field(connection: Connection, component: int = 0, unit: str = "BL", ax=None, every: int | None = None):
    """Row ``component`` of A as arrows over shape space (Fig. 11(c)); colour repeats their length."""
    ax = axes_of(ax)
    step = every or max(1, len(connection.axes[0]) // 12)
    pick = slice(step // 2, None, step)
    x, y = np.meshgrid(*(a[pick] for a in connection.axes), indexing="ij")
    u, v = (connection.A[component, k][pick, pick] for k in (0, 1))
    size = np.hypot(u, v)
    if np.nanmax(size, initial=0.0) <= ROUNDING * np.nanmax(np.abs(connection.A), initial=0.0):  # a row of nothing
        u, v, size = 0 * u, 0 * v, 0 * size
    if np.isnan(size).any():  # beside singular shapes arrows are cut
        cut = np.fmin(1.0, largest(size) / np.fmax(size, 1e-300))
        u, v, size = cut * u, cut * v, cut * size
    top = np.nanmax(size, initial=0.0)
    arrows = ax.quiver(x, y, u, v, size, cmap="viridis", pivot="mid", width=0.007, scale=None if top else 1.0)
    arrows.set_clim(0.0, top or 1.0)
    per = "rad" if component == 2 else unit
    colorbar = ax.figure.colorbar(arrows, ax=ax, shrink=0.85)
    colorbar.set_label(rf"$|\mathbf{{A}}^{{{COMPONENTS[component]}}}|$ ({per}/rad)")
    return shape_space(ax, connection.axes)


def drawable(field: Field) -> Field:
    """The field on at most FINEST points an axis: a finer mesh shows no more and fills gigabytes."""
    picks = [np.unique(np.linspace(0, len(a) - 1, min(len(a), FINEST)).round().astype(int)) for a in field.axes]
    axes = tuple(a[p] for a, p in zip(field.axes, picks))
    return Field(axes, field.values[(..., *np.ix_(*picks))], field.degree)


@styled
def ccf_map(
    field: Field, component: int = 0, gaits: Sequence[Gait] = (), unit: str = "BL", ax=None, error: Field | None = None
):
    """A component of the CCF over shape space with gaits drawn on it (Fig. 11(d)); the colours are centred on zero.

    error: of the field (`curvature.error`). Hatched where it exceeds the value, so that not even the sign is known; there
    the line of zeros keeps only what parts two signs that are known (`certain`)."""
    from cmcrameri import cm

    ax = axes_of(ax)
    field, error = drawable(field), error and drawable(error)
    values = field.values[component]
    top, smooth = largest(values), "nearest" if field.masked else "gouraud"
    image = ax.pcolormesh(*field.axes, values.T, cmap=cm.vik, vmin=-top, vmax=top, shading=smooth, rasterized=True)
    if error is not None:
        unsure = error.values[component] - np.abs(values)
        upright = "||||||"  # lines of symmetry of chains are diagonal
        ax.contourf(*field.axes, unsure.T, levels=[0.0, np.inf], colors="none", hatches=[upright])
        ax.set_title("hatched: error above value", loc="left", fontsize=8)
        values = certain(values, error.values[component])
    ax.contour(*field.axes, values.T, levels=[0.0], colors="0.35", linewidths=0.6)
    for gait in gaits:
        draw_gait(gait, ax)
    per = "rad" if component == 2 else unit
    colorbar = ax.figure.colorbar(image, ax=ax, shrink=0.85)
    colorbar.set_label(rf"CCF$_{{{COMPONENTS[component]}}}$ ({per}/rad$^2$)")
    return shape_space(ax, field.axes)


def largest(values: np.ndarray) -> float:
    """Of the magnitudes, for a scale; beside singular shapes, where these grow beyond all bounds, of nine tenths of them."""
    size = np.abs(values[np.isfinite(values)])
    return float(size.max() if size.size == values.size else np.quantile(size, 0.9)) or 1.0


def certain(values: np.ndarray, error: np.ndarray) -> np.ndarray:
    """values (N_1, N_2) for a line of zeros that follows no noise: where |value| <= error averaged with their neighbours,
    and of the other sign wherever a patch of one sign has no point that is known."""
    from scipy.ndimage import gaussian_filter, label

    known = np.abs(values) > error
    beyond = np.pad(values, 3, "reflect", reflect_type="odd")  # so that a slope is kept up to the edge
    values = np.where(known, values, gaussian_filter(beyond, 1.0, radius=3)[3:-3, 3:-3])
    for sign in (1, -1):
        patches, count = label(sign * values > 0)
        noise = np.setdiff1d(np.arange(1, count + 1), patches[known])
        values[np.isin(patches, noise)] *= -1
    return values


@styled
def draw_gait(gait: Gait, ax=None, color: str = "black"):
    """The gait's curve with a dot at its start and an arrow along it."""
    t = np.linspace(0, 2 * np.pi, 400)
    ax, curve = axes_of(ax), gait.shape(t)
    ax.plot(*curve.T, color=color, lw=1.2)
    ax.plot(*curve[0], "o", color=color, ms=3)
    ax.annotate("", curve[58], curve[50], arrowprops={"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0})
    return ax


@styled
def connection_figure(connection: Connection, unit: str = "BL"):
    """All three rows of A side by side."""
    fig, axes = figure(10.8, 3.0, 3)
    for component, ax in enumerate(axes[0]):
        vector_field(connection, component, unit, ax)
    return fig


@styled
def ccf_figure(field: Field, gaits: Sequence[Gait] = (), unit: str = "BL", error: Field | None = None):
    """All three components of the CCF side by side, with gaits drawn on them."""
    fig, axes = figure(10.8, 3.0, 3)
    for component, ax in enumerate(axes[0]):
        ccf_map(field, component, gaits, unit, ax, error)
    return fig


KNOB_MARKER = "osD^v<>Ph*X"
