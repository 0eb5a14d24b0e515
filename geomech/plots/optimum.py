"""An optimal gait: its loop on the CCF map, coloured by its limits, and its angles over a cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.plots.maps import ccf_map, shape_space
from geomech.plots.stretched import stretched_map
from geomech.plots.style import axes_of, figure, quantity, styled
from geomech.results.fields import field_of, stretch_of
from geomech.results.scenes import scene_of
from geomech.studies.effort import units
from geomech.systems.base import shape_labels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LONG = 12  # letters of a name: a legend of longer ones has a line for each
LIMITS = {  # of a loop: colour, text
    "zero": ("black", "runs along the zero line"),
    "limit": ("#D55E00", "at the joint limit"),
    "singular": ("#0072B2", "as near to singular shapes as it may"),
    "length": ("#009E73", "off the zero line: path length holds it back"),
    "else": ("#CC79A7", "off the zero line"),
    "loop": ("black", "best"),
}
RESIDUAL = {
    "length": ",\nand what A leaves of the law",
    "else": ": what A leaves of the law",
}  # where drag is not linear


@styled
def optimum_map(
    result: Result, ax: Axes | None = None, clim: float | str | None = None
) -> Axes:
    """Draw the best loop on the map of the CCF that it gains, coloured by what limits it;
    the start dashed. Sign and colours are those of `ccf_figure` in the same frame. Where
    the velocity does not follow from shape alone there is no CCF, and the map has the loop
    alone.

    result: of `geomech.optimise`, for two joints. clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    >>> ax = geomech.plots.optimum_map(best)
    """
    ax, scene = axes_of(ax, 4.6, 5.2), scene_of(result)
    labels = shape_labels(scene.system)
    if "gained_ccf" not in result:
        extent = scene.numerics.extent
        shape_space(ax, [np.linspace(-1, 1, 2) * extent] * 2, labels)
        ax.set_title("no CCF: the velocity does not follow\nfrom shape alone")
    else:
        field, _ = field_of(result, "gained_ccf")
        ccf_map(field, component_of(result), ax=ax, labels=labels, clim=clim)
        frame = "minimum-perturbation frame"
        if field.masked:
            frame = f"frame {result.attributes['gained_frame']}"
        ax.set_title(f"{ax.get_title()},\n{frame}")
    draw_start_and_best(result, ax, lambda curve: curve, not scene.system.traits.linear)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1)
    return ax


def component_of(result: Result) -> int:
    """Return the number of the component of the CCF that counts."""
    components = result["component"].values.tolist()
    return components.index(result.attributes["gained_component"])


@styled
def stretched_optimum(
    result: Result, ax: Axes | None = None, clim: float | str | None = None
) -> Axes:
    """Draw `optimum_map` on shape space redrawn so that equal lengths are equal path
    lengths. result: with ``stretched_shape``."""
    ax, system = axes_of(ax), scene_of(result).system
    plane = stretch_of(result)
    look = {
        "labels": shape_labels(system),
        "unit": units(system)["path_length"],
        "clim": clim,
    }
    field, _ = field_of(result, "gained_ccf")
    stretched_map(field, plane, component_of(result), ax=ax, **look)
    share = 100 * plane.rms
    ax.set_title(
        f"the same, stretched to path lengths\n(lengths off by {share:.2g} % rms)"
    )
    low, high = ([a[k] for a in plane.field.axes] for k in (0, -1))

    def place(curve: np.ndarray) -> np.ndarray:
        return plane(np.clip(curve, low, high))

    draw_start_and_best(result, ax, place, not system.traits.linear)
    return ax


def draw_start_and_best(result: Result, ax: Axes, place, nonlinear: bool) -> None:
    """Draw both loops, each shape where ``place`` puts it. nonlinear: drag is not
    linear."""
    start = place(result["start_loop"].values)
    ax.plot(*start.T, color="0.25", lw=0.9, ls="--", label="start")
    explained = nonlinear and "gained_ccf" in result
    best = place(result["loop"].values)
    draw_limited(ax, best, result["limited_by"].values, explained)


def draw_limited(
    ax: Axes, curve: np.ndarray, kinds: np.ndarray, nonlinear: bool = False
) -> None:
    """Draw a curve (P, 2) in the colours of LIMITS, with a dot at its start and an arrow
    along it. nonlinear: drag is not linear, so that A is not all."""
    for kind, (colour, text) in LIMITS.items():
        mask = kinds == kind
        if mask.any():
            joined = mask | np.roll(mask, 1)
            shown = np.where(joined, curve.T, np.nan)
            label = text
            if nonlinear:
                label += RESIDUAL.get(kind, "")
            ax.plot(*shown, color=colour, lw=1.8, label=label)
    ax.plot(*curve[0], "o", color="black", ms=3)
    arrow = {"arrowstyle": "-|>", "color": "black", "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", curve[100], curve[90], arrowprops=arrow)


@styled
def optimum_angles(result: Result, ax: Axes | None = None) -> Axes:
    """Draw the shape variables of the best gait over a cycle, and the limits.

    Examples
    --------
    >>> import geomech
    >>> best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    >>> ax = geomech.plots.optimum_angles(best)
    """
    ax = axes_of(ax, 4.0, 3.4)
    t, curves = result["phase"].values, result["loop"].values.T
    names = shape_labels(scene_of(result).system)
    step = max(1, len(curves) // 6)
    for k, curve in list(enumerate(curves))[step // 2 :: step]:
        ax.plot(t, curve, label=quantity(names[k][0]))
    if touches_joint_limit(result):
        for side in np.unique(result["joint_limits"].values):
            ax.axhline(side, color=LIMITS["limit"][0], lw=0.8, ls=":")
    ticks = ["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"]
    ax.set(
        xlabel="phase $t$ (rad)",
        ylabel=f"shape ({names[0][1]})",
        xlim=(0, 2 * np.pi),
        xticks=np.pi / 2 * np.arange(5),
        xticklabels=ticks,
    )
    value, start = result["value"], float(result["start_value"])
    if start <= 1e-9:
        start = 0.0
    best = f"{float(value):.4g} {value.unit}"
    ax.set_title(f"{value.label}: {best}\n(start {start:.4g})")
    long = max(len(name) for name, _ in names) > LONG
    columns = 1 if long else 3
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=columns)
    return ax


def touches_joint_limit(result: Result) -> bool:
    """Return whether the best gait touches a limit of the joints."""
    if "limit_touched" not in result or "joint_limits" not in result:
        return False
    return any(x.startswith("alpha") for x in result["limit_touched"].values)


@styled
def optimum_figure(result: Result, *, clim: float | str | None = None) -> Figure:
    """Draw `optimum_map` and `optimum_angles` side by side; the angles alone where there
    are not two joints; between them `stretched_optimum` of a result with
    ``stretched_shape``. clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    >>> fig = geomech.plots.optimum_figure(best)
    """
    if result["loop"].values.shape[1] != 2:
        fig, axes = figure(3.8, 3.4)
        optimum_angles(result, axes[0, 0])
        return fig
    stretched = "stretched_shape" in result
    fig, axes = figure(11.8 if stretched else 7.6, 3.9, 3 if stretched else 2)
    optimum_map(result, axes[0, 0], clim)
    if stretched:
        stretched_optimum(result, axes[0, 1], clim)
    optimum_angles(result, axes[0, -1])
    return fig
