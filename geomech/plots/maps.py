"""Maps of shape space: rows of A as arrows, components of the CCF as colours, gaits as curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.errors import choose
from geomech.gaits import Gait
from geomech.geometry.connection import Connection
from geomech.geometry.field import Field
from geomech.geometry.metric import Finsler, Metric
from geomech.plots.style import axes_of, figure, quantity, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

ROUNDING = 1e-13  # of the largest entry of A: a row below it is nothing but rounding
COMPONENTS = ("x", "y", r"\theta")
WORDS = ("x", "y", "theta")  # for the components, as --component has them
TITLES = ("forward", "sideways", "turning")
Labels = Sequence[tuple[str, str]]
ANGLES = (("alpha_1", "rad"), ("alpha_2", "rad"))
OF_CCF = 1e-12  # the same of a CCF, a derivative
PHASES = np.linspace(0, 2 * np.pi, 400)  # at which a gait is drawn
HATCHED = "error above value"
RINGS = "joint rates of equal effort"
SHORT = 0.06  # of the map's width: a shorter bit of a line of zeros is no line
PATCH = 6  # points of one
FINER = 4  # points of a line for each of the grid
ARROWS, LONGEST = (
    13,
    1.5,
)  # arrows along an axis; the longest, in units of their distance
FINEST = 400  # grid points along an axis of a map: about the dots of its picture


def shape_space(ax: Axes, axes: Sequence[np.ndarray], labels: Labels = ANGLES) -> Axes:
    """Label a plane of two shape variables and set it to the grid. labels: (name, unit) of each.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.plots import figure, shape_space
    >>> fig, axes = figure(3.0, 3.0)
    >>> ax = shape_space(axes[0, 0], [np.linspace(-1, 1, 5)] * 2)
    """
    ax.set(
        xlabel=quantity(*labels[0]), ylabel=quantity(*labels[1]), aspect="equal",
        xlim=(axes[0][0], axes[0][-1]), ylim=(axes[1][0], axes[1][-1]),
    )  # fmt: skip
    return ax


@styled
def vector_field(
    connection: Connection,
    component: int = 0,
    *,
    ax: Axes | None = None,
    every: int | None = None,
    labels: Labels = ANGLES,
    top: float | None = None,
    clim: float | str | None = None,
) -> Axes:
    """Draw row ``component`` of A as arrows over shape space (Fig. 11(c)), on a scale of its own; colour repeats their length.

    labels: as for `shape_space`. top: of the colours and of the arrows' scale, for maps that are compared. clim: that top as a
    number or a percentile of the lengths, as for `limit_of`. Longer arrows are cut to it.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.vector_field(study.fitted, component=0)
    """
    ax = axes_of(ax)
    step = every or max(1, round(len(connection.axes[0]) / ARROWS))
    pick = slice(step // 2, None, step)
    x, y = np.meshgrid(*(a[pick] for a in connection.axes), indexing="ij")
    u, v = (connection.A[component, k][pick, pick] for k in (0, 1))
    size = np.hypot(u, v)
    if not has_row(connection, component):
        u, v, size = 0 * u, 0 * v, 0 * size
    most = top or (
        limit_of(np.hypot(*connection.A[component][:2]), clim)
        if clim
        else largest(size)
    )
    cut, lengths = np.fmin(1.0, most / np.fmax(size, 1e-300)), size
    u, v, size = cut * u, cut * v, cut * size
    spacing = step * max(np.ptp(a) / max(1, len(a) - 1) for a in connection.axes)
    look = {
        "cmap": arrow_colours(),
        "pivot": "mid",
        "width": 0.0085,
        "headwidth": 3.6,
        "headlength": 4.0,
    }
    look |= {
        "headaxislength": 3.6,
        "minshaft": 1.6,
        "minlength": 0.8,
        "scale_units": "xy",
    }
    arrows = ax.quiver(x, y, u, v, size, scale=most / (LONGEST * spacing), **look)
    arrows.set_clim(0.0, most)
    return label_row(ax, arrows, component, connection, labels, lengths)


def arrow_colours() -> ListedColormap:
    """Return a colour map whose ends are both seen on white, light to dark."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["viridis"](np.linspace(0.86, 0.0, 256)), "arrows")


def label_row(
    ax,
    arrows,
    component: int,
    connection: Connection,
    labels: Labels,
    lengths: np.ndarray,
):
    """Set title, colour bar and axes of a map of a row of A with arrows of these lengths."""
    ax.set_title(f"{row_name(component)}: {TITLES[component]}")
    colorbar = ax.figure.colorbar(
        arrows,
        ax=ax,
        shrink=0.85,
        extend=extend(lengths, arrows.get_clim()[1] * (1 + 1e-9)),
    )
    colorbar.set_label(
        f"|{row_name(component)}| ({unit_of(component, connection.unit)}/{labels[0][1]})",
        labelpad=8,
    )
    return shape_space(ax, connection.axes, labels)


def row_name(component: int) -> str:
    """Return "A" with the index of a row."""
    return rf"$\mathbf{{A}}^{{{COMPONENTS[component]}}}$"


def has_row(connection: Connection, component: int) -> bool:
    """Return whether a row of A is more than rounding."""
    row = np.nanmax(np.hypot(*connection.A[component][:2]), initial=0.0)
    return bool(row > ROUNDING * np.nanmax(np.abs(connection.A), initial=0.0))


def unit_of(component: int, unit: str) -> str:
    """Return the unit of a component of a displacement."""
    return "rad" if component == 2 else unit


def drawable(field: Field) -> Field:
    """Return the field on at most FINEST points an axis: a finer mesh shows no more and fills gigabytes."""
    picks = [
        np.unique(np.linspace(0, len(a) - 1, min(len(a), FINEST)).round().astype(int))
        for a in field.axes
    ]
    axes = tuple(a[p] for a, p in zip(field.axes, picks))
    return replace(field, axes=axes, values=field.values[(..., *np.ix_(*picks))])


def has(field: Field, component: int) -> bool:
    """Return whether a component of a CCF is more than rounding."""
    size = np.nanmax(
        np.abs(field.values), axis=tuple(range(1, field.values.ndim)), initial=0.0
    )
    return bool(size[component] > OF_CCF * size.max())


@styled
def ccf_map(
    field: Field, component: int = 0, gaits: Sequence[Gait] = (), *, ax: Axes | None = None, error: Field | None = None,
    labels: Labels = ANGLES, legend: bool = True, metric: Metric | Finsler | None = None,
    clim: float | str | None = None,
) -> Axes:  # fmt: skip
    """Draw a component of the CCF over shape space with gaits on it (Fig. 11(d)), as far as the field goes; the colours are
    centred on zero. A component that is rounding alone is drawn as zero.

    error: of the field (`curvature.error`). Hatched are patches where it exceeds the value, so that not even the sign is known
    (`unknown`); there no line of zeros is drawn, and next to them only lines that part two known signs (`certain`). labels: as
    for `shape_space`. legend: explain hatching and rings below the map. metric: drawn as rings (`indicatrices`). clim: limit of
    the colours on either side of zero, a number or a percentile of the values' size such as "98%"; else their largest.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = geomech.plots.ccf_map(study.curvature, component=0, gaits=[study.scene.gait], error=study.curvature_error)
    """
    from cmcrameri import cm

    ax = axes_of(ax)
    field, error = drawable(field), error and drawable(error)
    values, drawn = field.values[component], has(field, component)
    if not drawn:
        values, error = 0 * values, None
    top, smooth = (
        limit_of(values, clim) if drawn else 1.0,
        "nearest" if field.masked else "gouraud",
    )
    image = ax.pcolormesh(
        *field.axes,
        values.T,
        cmap=cm.vik,
        vmin=-top,
        vmax=top,
        shading=smooth,
        rasterized=True,
    )
    hidden, handles = None, []
    if error is not None:
        hidden = unknown(values, error.values[component])
        values = certain(values, error.values[component])
        handles += _hatch(ax, field, hidden)
    _zeros(ax, field, values, hidden)
    shape_space(ax, field.axes, labels)
    if metric is not None:
        handles.append(indicatrices(metric, ax, field.axes))
    if legend and handles:
        ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.2))

    for gait in gaits:
        draw_gait(gait, ax, within=field.axes)
    if not all(inside_of(gait.shape(PHASES), field.axes).all() for gait in gaits):
        paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
        ax.text(
            0.02,
            0.02,
            "gait leaves the field",
            transform=ax.transAxes,
            fontsize=7,
            bbox=paper,
        )
    ax.set_title(f"{ccf_name(component)}: {TITLES[component]}")
    bar = ax.figure.colorbar(
        image,
        ax=ax,
        shrink=0.85,
        ticks=None if drawn else [0.0],
        extend=extend(image.get_array(), top),
    )
    bar.set_label(ccf_label(component, field.unit, labels))
    return ax


def extend(values: np.ndarray, top: float) -> str:
    """Return at which ends of a colour bar from -top to top there are values beyond it."""
    above, below = bool((values > top).any()), bool((values < -top).any())
    return {(True, True): "both", (True, False): "max", (False, True): "min"}.get(
        (above, below), "neither"
    )


def ccf_name(component: int) -> str:
    """Return "CCF" with its index."""
    return rf"CCF$_{{{COMPONENTS[component]}}}$"


def ccf_label(component: int, unit: str, labels: Labels) -> str:
    """Return the label of a scale: the name with its unit."""
    per = (
        f"{labels[0][1]}$^2$"
        if labels[0][1] == labels[1][1]
        else f"({labels[0][1]} {labels[1][1]})"
    )
    return f"{ccf_name(component)} ({unit_of(component, unit)}/{per})"


def indicatrices(
    metric: Metric | Finsler, ax: Axes, axes: Sequence[np.ndarray], count: int = 7
) -> Any:
    """Draw rings around ``count`` x ``count`` shapes: rates that take the same effort, so that a ring is long in directions in
    which shape changes cheaply. All have one scale. Return a handle for the legend.

    Examples
    --------
    >>> import geomech
    >>> from geomech.plots import ccf_map, indicatrices
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> rings = indicatrices(study.metric, ccf_map(study.curvature), study.curvature.axes)
    """
    from matplotlib.lines import Line2D

    spots = [a[0] + np.ptp(a) * (np.arange(count) + 0.5) / count for a in axes]
    places = np.stack(np.meshgrid(*spots, indexing="ij"), -1).reshape(-1, 2)
    rings = metric.indicatrix(places, 72)
    rings *= (
        0.46
        * min(np.ptp(a) for a in axes)
        / count
        / np.nanmax(np.linalg.norm(rings, axis=-1))
    )
    closed = (
        np.concatenate([rings, rings[:, :1], np.full_like(rings[:, :1], np.nan)], 1)
        + places[:, None]
    )
    style = {"color": "black", "lw": 0.7}
    ax.plot(*closed.reshape(-1, 2).T, **style)
    return Line2D(
        [], [], marker="o", ls="", mfc="none", mec="black", mew=0.7, ms=6, label=RINGS
    )


def _hatch(ax, field: Field, hidden: np.ndarray) -> list:
    """Hatch patches, with rounded edges; return handles for the legend, if there are any."""
    from matplotlib.patches import Patch

    axes, mask = _rounded(field, hidden)
    upright = "||||||"  # lines of symmetry of chains are diagonal
    ax.contourf(*axes, mask.T, levels=[0.5, 2.0], colors="none", hatches=[upright])
    return [
        Patch(facecolor="none", edgecolor="black", lw=0.3, hatch=upright, label=HATCHED)
    ] * bool(hidden.any())


def _zeros(ax, field: Field, values: np.ndarray, hidden: np.ndarray | None) -> None:
    """Draw the line of zeros, but for hidden patches and for bits too short to be a line."""
    from matplotlib.path import Path

    axes, fine = finer(field, values)
    if hidden is not None:
        fine = np.where(_rounded(field, hidden)[1] >= 0.5, np.nan, fine)
    if not np.nanmin(fine, initial=0.0) < 0 < np.nanmax(fine, initial=0.0):
        return
    line = ax.contour(*axes, fine.T, levels=[0.0], colors="0.35", linewidths=0.6)
    short = SHORT * max(np.ptp(a) for a in axes)
    (path,) = line.get_paths()
    codes = np.array([] if path.codes is None else path.codes)
    cuts = np.flatnonzero(codes == Path.MOVETO)[1:]
    parts = zip(np.split(path.vertices, cuts), np.split(codes, cuts))
    long = [
        Path(*p) for p in parts if len(p[0]) and np.ptp(p[0], axis=0).max() >= short
    ]
    line.set_paths([Path.make_compound_path(*long)] if long else [])


def _rounded(field: Field, hidden: np.ndarray):
    """Return a mask on the points of `finer`: above one half inside."""
    from scipy.ndimage import gaussian_filter

    axes, mask = finer(field, hidden.astype(float), degree=1)
    return axes, gaussian_filter(mask, 0.7 * FINER, mode="nearest") if len(
        axes[0]
    ) > len(field.axes[0]) else mask


def finer(field: Field, values: np.ndarray, degree: int = 3):
    """Return (axes, values) between the grid's points, too, for smooth lines; unchanged next to singular shapes."""
    from scipy.interpolate import RectBivariateSpline

    if field.masked or max(values.shape) * FINER > FINEST or min(values.shape) < 4:
        return field.axes, values
    axes = [
        np.interp(np.arange(FINER * (len(a) - 1) + 1) / FINER, np.arange(len(a)), a)
        for a in field.axes
    ]
    return axes, RectBivariateSpline(*field.axes, values, kx=degree, ky=degree)(*axes)


def unknown(values: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return a mask (N_1, N_2) where error > |value| over a patch of 3 by 3 points or more, or over PATCH points together away
    from sign changes. A patch along a line of zeros adds nothing to that line."""
    from scipy.ndimage import binary_opening, label, maximum_filter, minimum_filter

    beyond, square = error > np.abs(values), np.ones((3, 3))
    known = np.where(np.isnan(values), 0.0, values)
    highest, lowest = (f(known, 3) for f in (maximum_filter, minimum_filter))
    patches, count = label(beyond & ~((highest > 0) & (lowest < 0)), square)
    sizes = np.bincount(patches.ravel(), minlength=count + 1)
    return binary_opening(beyond, square) | ((patches > 0) & (sizes[patches] >= PATCH))


def largest(values: np.ndarray) -> float:
    """Return the largest of magnitudes, for a scale; next to singular shapes, where they have no bound, of nine tenths of
    them.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.plots import largest
    >>> largest(np.array([0.5, -2.0, 1.0]))
    2.0
    """
    size = np.abs(values[np.isfinite(values)])
    if not size.size:
        return 1.0
    return (
        float(size.max() if size.size == values.size else np.quantile(size, 0.9)) or 1.0
    )


def limit_of(values: np.ndarray, clim: float | str | None = None) -> float:
    """Return the limit of colours for values: a number as it is, that percentile of their size for "98%", the further from
    zero of two percentiles of the values for "5%:95%", else `largest`."""
    if clim is None:
        return largest(values)
    if not isinstance(clim, str):
        return float(clim)
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 1.0
    percents = [float(end.rstrip("%")) for end in clim.split(":")]
    ends = np.percentile(finite if len(percents) > 1 else np.abs(finite), percents)
    return float(np.abs(ends).max()) or largest(values)


def panels_of(
    components: str | Sequence[str], drawn: Sequence[Sequence[bool]]
) -> list[int]:
    """Return the components to draw: those named; else those that are more than rounding in a row, or all if there are none."""
    if isinstance(components, str):
        components = (components,)
    if components:
        return [WORDS.index(choose("component", name, WORDS)) for name in components]
    return [k for k in range(3) if any(row[k] for row in drawn)] or [0, 1, 2]


def say_left_out(
    fig, panels: Sequence[int], components: Sequence[str], name: Callable, *notes: str
) -> None:
    """Write below the panels which are left out as they are zero, after some notes."""
    absent = [] if components else [name(k) for k in range(3) if k not in panels]
    zero = [f"{' and '.join(absent)}: zero everywhere"] if absent else []
    if lines := [*notes, *zero]:
        fig.supxlabel("; ".join(lines), fontsize=8, color="0.3")


def certain(values: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return values (N_1, N_2) for a line of zeros that follows no noise: where |value| <= error averaged with their
    neighbours, and of the other sign wherever a patch of one sign has no known point."""
    from scipy.ndimage import gaussian_filter, label

    known = np.abs(values) > error
    beyond = np.pad(
        values, 3, "reflect", reflect_type="odd"
    )  # so that a slope is kept up to the edge
    values = np.where(known, values, gaussian_filter(beyond, 1.0, radius=3)[3:-3, 3:-3])
    for sign in (1, -1):
        patches, count = label(sign * values > 0)
        noise = np.setdiff1d(np.arange(1, count + 1), patches[known])
        values[np.isin(patches, noise)] *= -1
    return values


@styled
def draw_gait(
    gait: Gait,
    ax: Axes | None = None,
    color: str = "black",
    within: Sequence[np.ndarray] | None = None,
    line: str = "-",
) -> Axes:
    """Draw the gait's curve with a dot at its start and an arrow along it, as far as it lies within the axes of a grid.

    line: its style.

    Examples
    --------
    >>> from geomech.gaits import Circle
    >>> from geomech.plots import draw_gait, figure
    >>> fig, axes = figure(3.0, 3.0)
    >>> ax = draw_gait(Circle(0.5), axes[0, 0])
    """
    ax, curve = axes_of(ax), gait.shape(PHASES)
    curve[~inside_of(curve, within or ())] = np.nan
    ax.plot(*curve.T, line, color=color, lw=1.2)
    ax.plot(*curve[0], "o", color=color, ms=3)
    ahead = np.roll(
        np.arange(392), -50
    )  # an eighth of the way, or the next place inside
    start = next(
        (
            k
            for k in ahead
            if np.isfinite(curve[[k, k + 8]]).all() and (curve[k] != curve[k + 8]).any()
        ),
        None,
    )
    if start is not None:
        style = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", curve[start + 8], curve[start], arrowprops=style)
    return ax


def inside_of(curve: np.ndarray, axes: Sequence[np.ndarray]) -> np.ndarray:
    """Return a mask (P,) of the shapes of a curve (P, 2) that lie within the axes of a grid, to rounding."""
    inside = np.ones(len(curve), bool)
    for x, axis in zip(curve.T, axes):
        slack = 1e-9 * np.ptp(axis)
        inside &= (x >= axis[0] - slack) & (x <= axis[-1] + slack)
    return inside


@styled
def frame_figure(pose: Field, *, labels: Labels = ANGLES) -> Figure:
    """Draw the pose of a body frame in another over shape space: x, y and heading side by side, colours centred on zero."""
    from cmcrameri import cm

    fig, axes = figure(10.8, 3.0, 3, layout="compressed")
    pose = drawable(pose)
    for component, ax in enumerate(axes[0]):
        values, name = pose.values[component], ("x", "y", "heading")[component]
        top = largest(values)
        image = ax.pcolormesh(
            *pose.axes,
            values.T,
            cmap=cm.vik,
            vmin=-top,
            vmax=top,
            shading="gouraud",
            rasterized=True,
        )
        fig.colorbar(image, ax=ax, shrink=0.85).set_label(
            f"{name} ({unit_of(component, pose.unit)})"
        )
        ax.set_title(f"{name} of the frame")
        shape_space(ax, pose.axes, labels)
    return fig
