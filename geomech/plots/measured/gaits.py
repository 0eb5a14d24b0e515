"""A measured gait: its cycles with the tube of the data, the connection along it, and
displacements of its cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.geometry.representations.tube import TaylorSeries
from geomech.plots.look import font_points
from geomech.plots.maps import TITLES, draw_arrow, row_name
from geomech.plots.shown import ShownAxes
from geomech.plots.style import blank, columns_that_fit, figure, quantity, styled
from geomech.results.measured import series_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
POSE = ("x", "y", "heading")
WIDTH = 10.8  # in
STACKED_HEIGHTS = (3.6, 1.2, *[1.6] * 3, *[2.6] * 3)  # in, of rows in a narrow look
TICKS = {0.0: "0", np.pi: r"$\pi$", 2 * np.pi: r"$2\pi$"}


@styled
def measured_figure(result: Result) -> Figure:
    """Draw a result of `fit_gait` of a log.

    The left column has the shapes of the first two joints and the net displacement, the
    middle the rows of A along the mean gait with bands, and the right the net poses of
    the cycles as logged, against those that the connection predicts."""
    series = series_of(result)
    if columns_that_fit(WIDTH, 3) == 3:
        fig, axes = figure(WIDTH, 6.6, 3, 3, width_ratios=(1.4, 1.2, 1.0))
        grid = axes[0, 0].get_gridspec()
        places = (grid[:2, 0], grid[2, 0])
    else:
        fig, axes = _stacked_panels()
        grid = axes[0, 0].get_gridspec()
        places = (grid[0, :], grid[1, :])
    for ax in axes[:, 0]:
        ax.remove()
    shapes = fig.add_subplot(places[0], axes_class=ShownAxes)
    axes[0, 2].set_title("cycles", loc="left")
    _draw_shapes(result, series, shapes)
    _write_displacement(result, fig.add_subplot(places[1]))
    for component in range(3):
        _draw_row(result, series, component, axes[component, 1])
        _draw_cycles(result, component, axes[component, 2])
    label = f"{100 * series.level:.3g} % intervals"
    axes[0, 1].fill_between([], [], color="0.5", alpha=0.25, lw=0, label=label)
    axes[0, 1].legend(loc="lower center", bbox_to_anchor=(0.5, 1.12), ncols=4)
    axes[2, 1].set(xlabel=r"phase of the mean gait $\varphi$ (rad)")
    return fig


def _stacked_panels() -> tuple[Figure, Any]:
    """Return (Figure, Axes (3, 3)) for a narrow look, one column below another."""
    fig = blank(WIDTH, sum(STACKED_HEIGHTS))
    grid = fig.add_gridspec(len(STACKED_HEIGHTS), 1, height_ratios=STACKED_HEIGHTS)
    rows = [[0, 2, 5], [1, 3, 6], [1, 4, 7]]
    axes = np.empty((3, 3), object)
    for place in np.ndindex(3, 3):
        row = rows[place[0]][place[1]]
        axes[place] = fig.add_subplot(grid[row, 0], axes_class=ShownAxes)
    return fig, axes


def _joint_columns(result: Result) -> list[str]:
    """Return the names of the log's columns of joint angles."""
    return result.attributes["columns"].split(", ")


def _draw_shapes(result: Result, series: TaylorSeries, ax: Axes) -> None:
    """Draw the first two joint angles: the log, the mean gait, and for two joints the
    edges of the tube of the data."""
    t = np.linspace(0, 2 * np.pi, 400)
    log = result["shapes"].values
    ax.plot(*log[:, :2].T, ".", ms=1.2, color="0.6", label="rows of the log")
    loop = series.loop.shape(t)
    if loop.shape[1] == 2:
        normal = series.loop.normals(t)[..., 0]
        spread = np.einsum("tij,ti,tj->t", series.spread_at(t), normal, normal) ** 0.5
        offset = spread[:, None] * normal
        edge = {"lw": 0.8, "color": COLOURS[1]}
        ax.plot(*(loop + offset).T, "--", label="where the data end", **edge)
        ax.plot(*(loop - offset).T, "--", **edge)
    ax.plot(*loop[:, :2].T, color="black", lw=1.4, label="mean gait")
    ax.plot(*loop[0, :2], "o", color="black", ms=4)
    draw_arrow(ax, loop[50, :2], loop[58, :2])

    first, second = (quantity(name, "rad") for name in _joint_columns(result)[:2])
    ax.set(xlabel=first, ylabel=second, aspect="equal")
    cycles = result.attributes["cycles"]
    frequency = float(result["frequency"])
    ax.set_title(f"{cycles} cycles at {frequency:.4g} per unit of t", loc="left")
    ax.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.16),
        ncols=3,
        markerscale=4,
        handlelength=1.2,
        columnspacing=1.0,
    )


def _write_displacement(result: Result, ax: Axes) -> None:
    """Write the net displacement per cycle, logged and predicted, as a small table."""
    from matplotlib.transforms import blended_transform_factory

    ax.set_axis_off()
    level = 100 * float(result.attributes["level"])
    head = f"net displacement per cycle, {level:.3g} % intervals"
    rows = [("", "mean of the log", "mean gait, predicted")]
    for name in POSE:
        logged = result[name]
        predicted = result[f"{name}_predicted"]
        title = f"{name} ({logged.unit})"
        rows.append((title, _value_with_error(logged), _value_with_error(predicted)))
    across = ax.transAxes
    columns = (0.0, 0.26, 0.64)
    if columns_that_fit(WIDTH, 3) < 3:  # over the width of the figure
        across = blended_transform_factory(ax.figure.transFigure, ax.transAxes)
        columns = (0.02, 0.27, 0.63)
    ax.text(columns[0], 0.8, head, transform=across)
    for k, row in enumerate(rows):
        y = 0.62 - 0.17 * k
        for x, cell in zip(columns, row):
            ax.text(x, y, cell, transform=across, fontsize=font_points(8))


def _value_with_error(variable: Variable) -> str:
    return rf"${float(variable):.5f} \pm {float(variable.error):.5f}$"


def _draw_row(result: Result, series: TaylorSeries, component: int, ax: Axes) -> None:
    """Draw a row of A along the mean gait, with a band for each joint."""
    t = np.linspace(0, 2 * np.pi, 200)
    A, error = series.along(t)
    for j, (name, colour) in enumerate(zip(_joint_columns(result), COLOURS)):
        a = A[:, component, j]
        e = error[:, component, j]
        ax.fill_between(t, a - e, a + e, color=colour, alpha=0.25, lw=0)
        ax.plot(t, a, color=colour, lw=1.2, label=f"by {quantity(name)}")
    ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    unit = result["A_along"].unit[component]
    ax.set(xlim=(0, 2 * np.pi), ylabel=f"{row_name(component)} ({unit})")
    ax.set_xticks(list(TICKS), list(TICKS.values()))
    ax.set_title(TITLES[component], loc="left")


def _draw_cycles(result: Result, component: int, ax: Axes) -> None:
    """Draw a component of each cycle's net pose, logged against predicted."""
    name = POSE[component]
    logged = result[f"{name}_per_cycle"]
    predicted = result[f"{name}_per_cycle_predicted"]
    both = np.concatenate([predicted.values, logged.values])
    margin = 0.05 * np.ptp(both) + 1e-12
    ends = (both.min() - margin, both.max() + margin)
    ax.plot(ends, ends, color="0.7", lw=0.8, zorder=0)
    ax.plot(predicted.values, logged.values, ".", ms=4, color=COLOURS[0])
    ax.set(
        xlim=ends,
        ylim=ends,
        aspect="equal",
        xlabel=f"{name} predicted ({logged.unit})",
        ylabel=f"{name} logged ({logged.unit})",
    )
    ax.locator_params(nbins=4)
    ax.tick_params(axis="x", rotation=30)
