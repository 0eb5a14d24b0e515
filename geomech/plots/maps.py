"""Maps of shape space: rows of A as arrows, components of the CCF as colours, gaits as
curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.errors import choose
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.periods import Periods, periodic_axes
from geomech.mathematics.geometry.representations.field import Field
from geomech.plots.look import colours, font_points
from geomech.plots.style import axes_of, figure, quantity, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

Labels = Sequence[tuple[str, str]]  # (name, unit) of each shape variable

COMPONENTS = ("x", "y", r"\theta")  # in formulas
COMPONENT_WORDS = ("x", "y", "theta")  # as --component spells them
TITLES = ("forward", "sideways", "turning")
ANGLES = (("alpha_1", "rad"), ("alpha_2", "rad"))  # labels of two joint angles
ROW_ROUNDING = 1e-13  # of the largest entry of A: a smaller row is rounding
CCF_ROUNDING = 1e-12  # of the largest value of the CCF, a derivative: likewise
PHASES = np.linspace(0, 2 * np.pi, 400)  # rad, at which a gait is drawn
HATCHED = "error above value"
RINGS = "joint rates of equal effort"
SHORTEST_ZERO_LINE = 0.06  # of the map's width: shorter pieces are not drawn
PATCH_POINTS = 6  # grid points of the smallest patch that is hatched
REFINEMENT = 4  # points of a smooth line for each point of the grid
ARROWS = 13  # along an axis
LONGEST_ARROW = 1.5  # in distances between arrows
ARROW_STYLE = {
    "pivot": "mid",
    "width": 0.0085,
    "headwidth": 3.6,
    "headlength": 4.0,
    "headaxislength": 3.6,
    "minshaft": 1.6,
    "minlength": 0.8,
    "scale_units": "xy",
}
FINEST = 400  # grid points along an axis of a map: about the dots of its picture


def shape_space(ax: Axes, axes: Sequence[np.ndarray], labels: Labels = ANGLES) -> Axes:
    """Label a plane of two shape variables and set its limits to those of the grid.

    labels: (name, unit) of each variable.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.plots import figure, shape_space
    >>> fig, axes = figure(3.0, 3.0)
    >>> ax = shape_space(axes[0, 0], [np.linspace(-1, 1, 5)] * 2)
    """
    ax.set(
        xlabel=quantity(*labels[0]),
        ylabel=quantity(*labels[1]),
        aspect="equal",
        xlim=(axes[0][0], axes[0][-1]),
        ylim=(axes[1][0], axes[1][-1]),
    )
    return ax


# The connection


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
    """Draw row ``component`` of A as arrows over shape space (Fig. 11(c)), coloured by
    their length.

    every: grid points per arrow. labels: as for `shape_space`. top: the length at the
    end of the colours and of the arrows' scale, for maps that are compared; by default
    each row has a scale of its own. clim: the same as a number or a percentile of the
    lengths, as for `scale_limit`. Longer arrows are cut to it.

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
    lengths = np.hypot(u, v)
    if not has_row(connection, component):
        u = 0 * u
        v = 0 * v
        lengths = 0 * lengths
    if not top and clim:
        top = scale_limit(np.hypot(*connection.A[component][:2]), clim)
    top = top or largest(lengths)

    cut = np.fmin(1.0, top / np.fmax(lengths, 1e-300))
    spacing = step * max(np.ptp(a) / max(1, len(a) - 1) for a in connection.axes)
    arrows = ax.quiver(
        x,
        y,
        cut * u,
        cut * v,
        cut * lengths,
        cmap=arrow_colours(),
        scale=top / (LONGEST_ARROW * spacing),
        **ARROW_STYLE,
    )
    arrows.set_clim(0.0, top)
    return label_row(ax, arrows, component, connection, labels, lengths)


def arrow_colours() -> ListedColormap:
    """Return a colour map, light to dark, whose ends are both visible on white, or the
    one that the look asks for."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    asked = colours(None)
    if asked is not None:
        return asked
    return ListedColormap(colormaps["viridis"](np.linspace(0.86, 0.0, 256)), "arrows")


def label_row(
    ax: Axes,
    arrows: Any,
    component: int,
    connection: Connection,
    labels: Labels,
    lengths: np.ndarray,
) -> Axes:
    """Add title, colour bar and axes to a map of a row of A.

    lengths: of the row where it is drawn; those above the colours' limit give the
    colour bar an arrow."""
    name = row_name(component)
    ax.set_title(f"{name}: {TITLES[component]}")
    top = arrows.get_clim()[1] * (1 + 1e-9)
    colorbar = ax.figure.colorbar(
        arrows, ax=ax, shrink=0.85, extend=colorbar_extend(lengths, top)
    )
    unit = f"{component_unit(component, connection.unit)}/{labels[0][1]}"
    colorbar.set_label(f"|{name}| ({unit})", labelpad=8)
    return shape_space(ax, connection.axes, labels)


def row_name(component: int) -> str:
    """Return "A" with the index of a row, as a formula."""
    return rf"$\mathbf{{A}}^{{{COMPONENTS[component]}}}$"


def has_row(connection: Connection, component: int) -> bool:
    """Return whether a row of A is more than rounding."""
    row = np.nanmax(np.hypot(*connection.A[component][:2]), initial=0.0)
    largest_entry = np.nanmax(np.abs(connection.A), initial=0.0)
    return bool(row > ROW_ROUNDING * largest_entry)


# The CCF


def component_unit(component: int, unit: str) -> str:
    """Return the unit of a component of a displacement."""
    return "rad" if component == 2 else unit


def drawable(field: Field) -> Field:
    """Return the field on at most FINEST points along each axis.

    A finer mesh shows no more and fills gigabytes."""
    picks = []
    for axis in field.axes:
        places = np.linspace(0, len(axis) - 1, min(len(axis), FINEST))
        picks.append(np.unique(places.round().astype(int)))
    axes = tuple(a[p] for a, p in zip(field.axes, picks))
    return replace(field, axes=axes, values=field.values[(..., *np.ix_(*picks))])


def has_component(field: Field, component: int) -> bool:
    """Return whether a component of a CCF is more than rounding."""
    grid_axes = tuple(range(1, field.values.ndim))
    size = np.nanmax(np.abs(field.values), axis=grid_axes, initial=0.0)
    return bool(size[component] > CCF_ROUNDING * size.max())


@styled
def ccf_map(
    field: Field,
    component: int = 0,
    gaits: Sequence[Gait] = (),
    *,
    ax: Axes | None = None,
    error: Field | None = None,
    labels: Labels = ANGLES,
    legend: bool = True,
    metric: Metric | Finsler | None = None,
    clim: float | str | None = None,
) -> Axes:
    """Draw a component of the CCF over shape space with gaits on it (Fig. 11(d)).

    The colours are centred on zero. A component that is rounding alone is drawn as
    zero.
    Gaits are drawn as far as the field goes.

    error: of the field (`curvature.error`). Patches where it exceeds the value, so that
    not even the sign is known, are hatched (`unknown`). No line of zeros is drawn in
    them, and next to them only lines between two known signs (`certain`). labels: as
    for `shape_space`. legend: explain hatching and rings below the map. metric: drawn
    as rings (`indicatrices`). clim: limit of the colours on either side of zero, a
    number or a percentile of the values' size such as "98%"; by default their largest.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> gait = study.scene.gait
    >>> error = study.curvature_error
    >>> ax = geomech.plots.ccf_map(study.curvature, gaits=[gait], error=error)
    """
    ax = axes_of(ax)
    field = drawable(field)
    values = field.values[component]
    errors = None
    top = 1.0
    ticks: list[float] | None = [0.0]
    if has_component(field, component):
        top = scale_limit(values, clim)
        ticks = None
        if error is not None:
            errors = drawable(error).values[component]
    else:
        values = 0 * values

    shading = "nearest" if field.masked else "gouraud"
    image = draw_colours(ax, *field.axes, values.T, top, shading)
    handles = []
    hidden = None
    if errors is not None:
        hidden = unknown(values, errors)
        handles += _hatch_patches(ax, field, hidden)
        values = certain(values, errors)
    _draw_zero_line(ax, field, values, hidden)
    shape_space(ax, field.axes, labels)

    if metric is not None:
        handles.append(indicatrices(metric, ax, field.axes))
    if legend and handles:
        ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.2))
    for gait in gaits:
        line = getattr(gait, "line", "-")
        colour = getattr(gait, "colour", "black")
        draw_gait(gait, ax, colour, field.axes, line, field.periods)
    _label_loops(ax, gaits)
    for gait in gaits:
        curve = inside_periods(gait.shape(PHASES), field.axes, field.periods)
        if not is_inside(curve[np.isfinite(curve).all(-1)], field.axes).all():
            _note_gait_outside(ax)
            break

    ax.set_title(f"{ccf_name(component)}: {TITLES[component]}")
    extend = colorbar_extend(image.get_array(), top)
    bar = ax.figure.colorbar(image, ax=ax, shrink=0.85, ticks=ticks, extend=extend)
    bar.set_label(ccf_label(component, field.unit, labels))
    return ax


def draw_colours(
    ax: Axes, x: Any, y: Any, values: Any, top: float, shading: str
) -> Any:
    """Draw values (M, N) as colours from -top to top over x (N,) and y (M,), or over a
    mesh of these; return the image."""
    from cmcrameri import cm

    return ax.pcolormesh(
        x,
        y,
        values,
        cmap=colours(cm.vik),
        vmin=-top,
        vmax=top,
        shading=shading,
        rasterized=True,
    )


def _label_loops(ax: Axes, gaits: Sequence[Any]) -> None:
    """Write beside the end of a lower corner which line is which, where loops have
    names."""
    names = [gait for gait in gaits if hasattr(gait, "label")]
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    strokes = {"-": "solid", "--": "dashed"}
    text = ", ".join(f"{strokes[gait.line]}: {gait.label}" for gait in names)
    if text:
        ax.text(
            0.98,
            0.02,
            text,
            transform=ax.transAxes,
            fontsize=font_points(7),
            ha="right",
            bbox=box,
        )


def _note_gait_outside(ax: Axes) -> None:
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    text = "gait leaves the field"
    ax.text(0.02, 0.02, text, transform=ax.transAxes, fontsize=font_points(7), bbox=box)


def colorbar_extend(values: np.ndarray, top: float) -> str:
    """Return the ends of a colour bar from -top to top beyond which there are values:
    "both", "min", "max" or "neither"."""
    above = bool((values > top).any())
    below = bool((values < -top).any())
    if above and below:
        return "both"
    if above:
        return "max"
    if below:
        return "min"
    return "neither"


def ccf_name(component: int) -> str:
    """Return "CCF" with the index of a component, as a formula."""
    return rf"CCF$_{{{COMPONENTS[component]}}}$"


def ccf_label(component: int, unit: str, labels: Labels) -> str:
    """Return the label of a scale: the name of a component with its unit."""
    first = labels[0][1]
    second = labels[1][1]
    per = f"({first} {second})"
    if first == second:
        per = f"{first}$^2$"
    return f"{ccf_name(component)} ({component_unit(component, unit)}/{per})"


def indicatrices(
    metric: Metric | Finsler, ax: Axes, axes: Sequence[np.ndarray], count: int = 7
) -> Any:
    """Draw rings of equal effort around ``count`` x ``count`` shapes; return a handle
    for the legend.

    A ring is the set of rates that take the same effort: it is long in directions in
    which the shape changes cheaply. All rings have one scale.

    Examples
    --------
    >>> import geomech
    >>> from geomech.plots import ccf_map, indicatrices
    >>> study = geomech.study("three-link-viscous", grid=15).tables
    >>> ax = ccf_map(study.curvature)
    >>> rings = indicatrices(study.metric, ax, study.curvature.axes)
    """
    from matplotlib.lines import Line2D

    centres = [a[0] + np.ptp(a) * (np.arange(count) + 0.5) / count for a in axes]
    shapes = np.stack(np.meshgrid(*centres, indexing="ij"), -1).reshape(-1, 2)
    rings = metric.indicatrix(shapes, 72)
    largest_radius = np.nanmax(np.linalg.norm(rings, axis=-1))
    rings *= 0.46 * min(np.ptp(a) for a in axes) / count / largest_radius

    # All rings are one line, which nan interrupts.
    first = rings[:, :1]
    closed = np.concatenate([rings, first, np.full_like(first, np.nan)], 1)
    line = (closed + shapes[:, None]).reshape(-1, 2)
    ax.plot(*line.T, color="black", lw=0.7)
    return Line2D(
        [], [], marker="o", ls="", mfc="none", mec="black", mew=0.7, ms=6, label=RINGS
    )


def _hatch_patches(ax: Axes, field: Field, hidden: np.ndarray) -> list:
    """Hatch patches, with rounded edges; return handles for the legend, if there are
    any."""
    from matplotlib.patches import Patch

    axes, mask = _rounded(field, hidden)
    upright = "||||||"  # lines of symmetry of chains are diagonal
    ax.contourf(*axes, mask.T, levels=[0.5, 2.0], colors="none", hatches=[upright])
    if not hidden.any():
        return []
    look = {"facecolor": "none", "edgecolor": "black", "lw": 0.3, "hatch": upright}
    return [Patch(**look, label=HATCHED)]


def _draw_zero_line(
    ax: Axes, field: Field, values: np.ndarray, hidden: np.ndarray | None
) -> None:
    """Draw the line of zeros, without hidden patches and pieces too short to be
    lines."""
    axes, fine = refined(field, values)
    if hidden is not None:
        fine = np.where(_rounded(field, hidden)[1] >= 0.5, np.nan, fine)
    if not np.nanmin(fine, initial=0.0) < 0 < np.nanmax(fine, initial=0.0):
        return
    line = ax.contour(*axes, fine.T, levels=[0.0], colors="0.35", linewidths=0.6)
    shortest = SHORTEST_ZERO_LINE * max(np.ptp(a) for a in axes)
    (path,) = line.get_paths()
    line.set_paths(_long_pieces(path, shortest))


def _long_pieces(path: Any, shortest: float) -> list:
    """Return the pieces of a path that extend over ``shortest`` in x or y, as one path;
    none if there are none."""
    from matplotlib.path import Path

    codes = np.array([] if path.codes is None else path.codes)
    starts = np.flatnonzero(codes == Path.MOVETO)[1:]
    pieces = zip(np.split(path.vertices, starts), np.split(codes, starts))
    long = []
    for vertices, piece_codes in pieces:
        if len(vertices) and np.ptp(vertices, axis=0).max() >= shortest:
            long.append(Path(vertices, piece_codes))
    if not long:
        return []
    return [Path.make_compound_path(*long)]


def _rounded(field: Field, hidden: np.ndarray):
    """Return (axes, mask) of `refined`, with rounded edges: above one half inside."""
    from scipy.ndimage import gaussian_filter

    axes, mask = refined(field, hidden.astype(float), degree=1)
    if len(axes[0]) > len(field.axes[0]):
        mask = gaussian_filter(mask, 0.7 * REFINEMENT, mode="nearest")
    return axes, mask


def refined(field: Field, values: np.ndarray, degree: int = 3) -> tuple:
    """Return (axes, values) with points between those of the grid, for smooth lines;
    unchanged where there are singular shapes, and on grids that are fine already."""
    from scipy.interpolate import RectBivariateSpline

    is_fine = max(values.shape) * REFINEMENT > FINEST
    if field.masked or is_fine or min(values.shape) < 4:
        return field.axes, values
    axes = []
    for axis in field.axes:
        index = np.arange(REFINEMENT * (len(axis) - 1) + 1) / REFINEMENT
        axes.append(np.interp(index, np.arange(len(axis)), axis))
    spline = RectBivariateSpline(*field.axes, values, kx=degree, ky=degree)
    return axes, spline(*axes)


def unknown(values: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return a mask (N_1, N_2) of the patches where error > |value|.

    A patch has 3 by 3 points or more, or PATCH_POINTS connected points away from
    changes of sign: one along a line of zeros would add nothing to that line."""
    from scipy.ndimage import binary_opening, label, maximum_filter, minimum_filter

    square = np.ones((3, 3))
    beyond = error > np.abs(values)
    numbers = np.where(np.isnan(values), 0.0, values)
    changes_sign = (maximum_filter(numbers, 3) > 0) & (minimum_filter(numbers, 3) < 0)
    patches, count = label(beyond & ~changes_sign, square)
    sizes = np.bincount(patches.ravel(), minlength=count + 1)
    large = (patches > 0) & (sizes[patches] >= PATCH_POINTS)
    return binary_opening(beyond, square) | large


def certain(values: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return values (N_1, N_2) whose line of zeros does not follow noise.

    Where |value| <= error, a value is averaged with its neighbours; a patch of one sign
    without any |value| > error changes sign."""
    from scipy.ndimage import gaussian_filter, label

    known = np.abs(values) > error
    # The odd reflection continues a slope beyond the edge.
    padded = np.pad(values, 3, "reflect", reflect_type="odd")
    smooth = gaussian_filter(padded, 1.0, radius=3)[3:-3, 3:-3]
    values = np.where(known, values, smooth)
    for sign in (1, -1):
        patches, count = label(sign * values > 0)
        noise = np.setdiff1d(np.arange(1, count + 1), patches[known])
        values[np.isin(patches, noise)] *= -1
    return values


# Scales and panels


def largest(values: np.ndarray) -> float:
    """Return the largest magnitude, for a scale.

    Next to singular shapes (nan) magnitudes have no bound: there it is the one that
    nine tenths of the others do not exceed.

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
    if size.size == values.size:
        return float(size.max()) or 1.0
    return float(np.quantile(size, 0.9)) or 1.0


def scale_limit(values: np.ndarray, clim: float | str | None = None) -> float:
    """Return the limit of the colours for values.

    clim: the limit itself, or "98%" for that percentile of the values' size, or
    "5%:95%" for the larger size of two percentiles of the values; None for
    `largest`."""
    if clim is None:
        return largest(values)
    if not isinstance(clim, str) or not clim.endswith("%"):
        return float(clim)
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 1.0
    percents = [float(end.rstrip("%")) for end in clim.split(":")]
    if len(percents) == 1:
        finite = np.abs(finite)
    ends = np.percentile(finite, percents)
    return float(np.abs(ends).max()) or largest(values)


def panel_components(
    components: str | Sequence[str], rows: Sequence[Sequence[bool]]
) -> list[int]:
    """Return the indices of the components to draw: those named by COMPONENT_WORDS,
    else those that are not zero in every row, or all if all are.

    rows: whether each of three components is not zero, for every row of panels."""
    if isinstance(components, str):
        components = (components,)
    if components:
        return [
            COMPONENT_WORDS.index(choose("component", name, COMPONENT_WORDS))
            for name in components
        ]
    return [k for k in range(3) if any(row[k] for row in rows)] or [0, 1, 2]


def note_zero_components(
    fig: Figure,
    panels: Sequence[int],
    components: Sequence[str],
    name: Callable[[int], str],
    *notes: str,
) -> None:
    """Write notes below the panels, and which components are absent as they are zero.

    components: as for `panel_components`; where they are named, none is absent."""
    lines = [*notes]
    absent = [name(k) for k in range(3) if k not in panels]
    if absent and not components:
        lines.append(f"{' and '.join(absent)}: zero everywhere")
    if lines:
        fig.supxlabel("; ".join(lines), fontsize=font_points(8), color="0.3")


# Gaits


@styled
def draw_gait(
    gait: Gait,
    ax: Axes | None = None,
    color: str = "black",
    within: Sequence[np.ndarray] | None = None,
    line: str = "-",
    periods: Periods = (),
) -> Axes:
    """Draw the gait's curve with a dot at its start and an arrow along it.

    within: axes of a grid, beyond which the curve is not drawn. line: its style.
    periods: of the axes; beyond the end of one with a period the curve goes on at the
    axis's other end.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.plots import draw_gait, figure
    >>> fig, axes = figure(3.0, 3.0)
    >>> ax = draw_gait(Circle(0.5), axes[0, 0])
    """
    ax = axes_of(ax)
    curve = gait.shape(PHASES)
    if within is not None:
        curve = inside_periods(curve, within, periods)
    curve[~is_inside(curve, within or ())] = np.nan
    ax.plot(*curve.T, line, color=color, lw=1.2)
    ax.plot(*curve[0], "o", color=color, ms=3, clip_on=not periods)
    start = _arrow_start(curve)
    if start is not None:
        draw_arrow(ax, curve[start], curve[start + 8], color)
    return ax


def _arrow_start(curve: np.ndarray) -> int | None:
    """Return the index of a curve (P, 2) at which an arrow of 8 steps begins: an eighth
    of the cycle, or the next one at which the curve is inside and does not rest."""
    for k in np.roll(np.arange(len(curve) - 8), -50):
        steps = curve[k : k + 9]
        if np.isfinite(steps).all() and (steps[0] != steps[-1]).any():
            return k
    return None


def inside_periods(
    curve: np.ndarray, axes: Sequence[np.ndarray], periods: Periods
) -> np.ndarray:
    """Return a curve (P, 2) with the variables that have periods within their axes, as
    a picture shows it.

    Where it passes the end of an axis it has three more points: at this end, nan, and
    at the other end."""
    for k in periodic_axes(periods):
        first = axes[k][0]
        turns = np.floor((curve[:, k] - first) / periods[k] + 1e-9)
        # At the end of the axis itself the curve has not passed it.
        at_end = curve[-1, k] - first - turns[-1] * periods[k]
        if len(turns) > 1 and turns[-1] > turns[-2] and at_end < 1e-9 * periods[k]:
            turns[-1] = turns[-2]
        pieces = []
        for n, turn in enumerate(turns):
            if n and turn != turns[n - 1]:
                ends = curve[n - 1 : n + 1]
                around = turns[n - 1 : n + 1]
                pieces.append(_across_seam(ends, k, around, first, periods[k]))
            point = curve[n].copy()
            point[k] -= turn * periods[k]
            pieces.append(point[None])
        curve = np.concatenate(pieces)
    return curve


def _across_seam(
    ends: np.ndarray, k: int, turns: np.ndarray, first: float, period: float
) -> np.ndarray:
    """Return the points (3, 2) between two points of a curve (2, 2) on different turns
    of variable k: at the end of the axis, nan, and at its other end."""
    before, after = turns
    seam = first + max(before, after) * period
    share = (seam - ends[0, k]) / (ends[1, k] - ends[0, k])
    point = ends[0] + share * (ends[1] - ends[0])
    leaving = point.copy()
    entering = point.copy()
    leaving[k] = seam - before * period
    entering[k] = seam - after * period
    return np.stack([leaving, np.full(2, np.nan), entering])


def draw_arrow(ax: Axes, start: Any, end: Any, color: str = "black") -> None:
    """Draw the head of an arrow from one point to another."""
    style = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", end, start, arrowprops=style)


def is_inside(curve: np.ndarray, axes: Sequence[np.ndarray]) -> np.ndarray:
    """Return a mask (P,) of the points of a curve (P, 2) that lie within the axes of a
    grid, to rounding."""
    inside = np.ones(len(curve), bool)
    for x, axis in zip(curve.T, axes):
        slack = 1e-9 * np.ptp(axis)
        inside &= (x >= axis[0] - slack) & (x <= axis[-1] + slack)
    return inside


# Body frames


@styled
def frame_figure(pose: Field, *, labels: Labels = ANGLES) -> Figure:
    """Draw the pose of a body frame in another over shape space: x, y and heading side
    by side, colours centred on zero."""
    fig, axes = figure(10.8, 3.0, 3, layout="compressed")
    pose = drawable(pose)
    for component, name in enumerate(("x", "y", "heading")):
        ax = axes[0, component]
        values = pose.values[component]
        image = draw_colours(ax, *pose.axes, values.T, largest(values), "gouraud")
        unit = component_unit(component, pose.unit)
        fig.colorbar(image, ax=ax, shrink=0.85).set_label(f"{name} ({unit})")
        ax.set_title(f"{name} of the frame")
        shape_space(ax, pose.axes, labels)
    return fig
