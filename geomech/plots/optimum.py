"""An optimal gait: its loop on the CCF map, coloured by its limits, and its angles over
a cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.mathematics.systems.base import shape_labels
from geomech.plots.maps import ccf_map, draw_arrow, shape_space
from geomech.plots.stretched import stretched_map
from geomech.plots.style import axes_of, figure, quantity, styled
from geomech.results.fields import field_of, stretch_of
from geomech.results.scenes import scene_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LONGEST_NAME = 12  # letters; a legend of longer ones has a line for each
LIMITS = {  # what limits a loop: colour, text
    "zero": ("black", "runs along the zero line"),
    "limit": ("#D55E00", "at the joint limit"),
    "singular": ("#0072B2", "as near to singular shapes as it may"),
    "length": ("#009E73", "off the zero line: path length holds it back"),
    "else": ("#CC79A7", "off the zero line"),
    "loop": ("black", "best"),
}
RESIDUAL_TEXTS = {  # added where drag is not linear
    "length": ",\nand what A leaves of the law",
    "else": ": what A leaves of the law",
}


@styled
def optimum_map(
    result: Result, ax: Axes | None = None, clim: float | str | None = None
) -> Axes:
    """Draw the best loop on the map of the CCF that it gains, coloured by what limits
    it, and the start of the search dashed.

    Sign and colours are those of `ccf_figure` in the same frame. Where the velocity
    does not follow from shape alone there is no CCF, and the map has the loops alone.

    result: of `geomech.optimise`, for two joints. clim: as for `ccf_figure`.

    Examples
    --------
    >>> import geomech
    >>> best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    >>> ax = geomech.plots.optimum_map(best)
    """
    ax = axes_of(ax, 4.6, 5.2)
    scene = scene_of(result)
    labels = shape_labels(scene.system)
    if "gained_ccf" not in result:
        extent = scene.numerics.extent
        shape_space(ax, [np.linspace(-1, 1, 2) * extent] * 2, labels)
        ax.set_title("no CCF: the velocity does not follow\nfrom shape alone")
    else:
        field, _ = field_of(result, "gained_ccf")
        ccf_map(field, gained_component(result), ax=ax, labels=labels, clim=clim)
        frame = "minimum-perturbation frame"
        if field.masked:
            frame = f"frame {result.attributes['gained_frame']}"
        ax.set_title(f"{ax.get_title()},\n{frame}")
    start = result["start_loop"].values
    best = result["loop"].values
    draw_start_and_best(result, ax, start, best, not scene.system.traits.linear)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=1)
    return ax


def gained_component(result: Result) -> int:
    """Return the index of the component of the CCF that the gait gains."""
    components = result["component"].values.tolist()
    return components.index(result.attributes["gained_component"])


@styled
def stretched_optimum(
    result: Result, ax: Axes | None = None, clim: float | str | None = None
) -> Axes:
    """Draw `optimum_map` on shape space redrawn so that equal lengths are equal path
    lengths.

    result: with ``stretched_shape``."""
    ax = axes_of(ax)
    system = scene_of(result).system
    plane = stretch_of(result)
    field, _ = field_of(result, "gained_ccf")
    stretched_map(
        field,
        plane,
        gained_component(result),
        ax=ax,
        labels=shape_labels(system),
        unit=result["stretched_shape"].units,
        clim=clim,
    )
    percent = 100 * plane.rms
    ax.set_title(
        f"the same, stretched to path lengths\n(lengths off by {percent:.2g} % rms)"
    )
    low = [axis[0] for axis in plane.field.axes]
    high = [axis[-1] for axis in plane.field.axes]
    start = plane(np.clip(result["start_loop"].values, low, high))
    best = plane(np.clip(result["loop"].values, low, high))
    draw_start_and_best(result, ax, start, best, not system.traits.linear)
    return ax


def draw_start_and_best(
    result: Result, ax: Axes, start: np.ndarray, best: np.ndarray, nonlinear: bool
) -> None:
    """Draw the loops (P, 2) of the start and of the best gait. nonlinear: drag is not
    linear."""
    ax.plot(*start.T, color="0.25", lw=0.9, ls="--", label="start")
    has_residual = nonlinear and "gained_ccf" in result
    draw_limited(ax, best, result["limited_by"].values, has_residual)


def draw_limited(
    ax: Axes, curve: np.ndarray, limits: np.ndarray, has_residual: bool = False
) -> None:
    """Draw a curve (P, 2) in the colours of LIMITS, with a dot at its start and an
    arrow along it.

    limits: key of LIMITS at each point (P,). has_residual: drag is not linear, so that
    A leaves a residual of the law, which the legend mentions."""
    for limit, (colour, text) in LIMITS.items():
        mask = limits == limit
        if mask.any():
            joined = mask | np.roll(mask, 1)
            line = np.where(joined, curve.T, np.nan)
            label = text
            if has_residual:
                label += RESIDUAL_TEXTS.get(limit, "")
            ax.plot(*line, color=colour, lw=1.8, label=label)
    ax.plot(*curve[0], "o", color="black", ms=3)
    draw_arrow(ax, curve[90], curve[100])


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
    t = result["phase"].values
    curves = result["loop"].values.T
    labels = shape_labels(scene_of(result).system)
    # Some six curves of a chain of many joints.
    step = max(1, len(curves) // 6)
    for k in range(step // 2, len(curves), step):
        ax.plot(t, curves[k], label=quantity(labels[k][0]))
    if touches_joint_limit(result):
        for side in np.unique(result["joint_limits"].values):
            ax.axhline(side, color=LIMITS["limit"][0], lw=0.8, ls=":")
    ticks = ["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"]
    ax.set(
        xlabel="phase $t$ (rad)",
        ylabel=f"shape ({labels[0][1]})",
        xlim=(0, 2 * np.pi),
        xticks=np.pi / 2 * np.arange(5),
        xticklabels=ticks,
    )
    value = result["value"]
    start = float(result["start_value"])
    if start <= 1e-9:
        start = 0.0
    best = f"{float(value):.4g} {value.unit}"
    ax.set_title(f"{value.label}: {best}\n(start {start:.4g})")
    is_long = max(len(name) for name, _ in labels) > LONGEST_NAME
    columns = 1 if is_long else 3
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=columns)
    return ax


def touches_joint_limit(result: Result) -> bool:
    """Return whether the best gait touches a limit of the joints."""
    if "limit_touched" not in result or "joint_limits" not in result:
        return False
    return any(x.startswith("alpha") for x in result["limit_touched"].values)


@styled
def optimum_figure(result: Result, *, clim: float | str | None = None) -> Figure:
    """Draw `optimum_map` and `optimum_angles` side by side, with `stretched_optimum`
    between them for a result with ``stretched_shape``. Unless there are two joints,
    only the angles are drawn. clim: as for `ccf_figure`.

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
    if "stretched_shape" not in result:
        fig, axes = figure(7.6, 3.9, 2)
        optimum_map(result, axes[0, 0], clim)
    else:
        fig, axes = figure(11.8, 3.9, 3)
        optimum_map(result, axes[0, 0], clim)
        stretched_optimum(result, axes[0, 1], clim)
    optimum_angles(result, axes[0, -1])
    return fig
