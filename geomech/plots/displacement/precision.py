"""Pictures of accuracy studies: error against seconds, or against values of
settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.variables import Result
from geomech.mathematics.tiers import TIERS
from geomech.plots.look import font_points
from geomech.plots.style import figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SETTING_MARKER = "osD^v<>Ph*X"
SETTINGS = {  # in words, where an entry of [numerics] is short for them
    "phases": "phases per cycle",
    "segments": "midpoints per link for the loads",
    "nodes": "Gauss points per link for the loads",
    "pieces": "pieces per body length",
    "curves": "curves of the family's table",
    "grid": "points of the grid per joint",
    "harmonics": "highest harmonic kept",
    "directions": "directions of the fit",
    "interpolation": "degree of the splines",
}
PANELS = {
    "truth": (
        "Error of the answer",
        "rms distance from a far finer force balance",
    ),
    "limit": (
        "Error of one approximation alone",
        "rms distance from where the setting leads",
    ),
}
ROBOT_SETTINGS = {  # labels of axes
    "steps": "steps of a cycle",
    "elements": "elements of an outline",
    "rounding": "rounding",
}
LOWEST_ORDER = 0.3  # below it finer settings are said to gain nothing; assumed
SMALLEST_ERROR = 1e-17  # drawn in place of 0 on a logarithmic axis
SMALLEST_SPEED_ERROR = 1e-12  # m/s, likewise


@dataclass(frozen=True, eq=False)
class Line:
    """A setting that a study varied from coarse to fine.

    varied: its name. tier: that it belongs to, or "". values, seconds, error: of each
    run (N,). order: measured order of convergence, nan if unknown."""

    varied: str
    tier: str
    values: np.ndarray
    seconds: np.ndarray
    error: np.ndarray
    order: float
    order_by_theory: str


def study_lines(result: Result, name: str = "error", against: str = "") -> list[Line]:
    """Return the settings of a study with the error of a name.

    against: only errors against "truth" or "limit" (PANELS); by default all."""
    lines = []
    for k, reference in enumerate(result["against"].values.tolist()):
        if against and reference != against:
            continue
        tier = ""
        if "tier" in result:
            tier = str(result["tier"][k])
        is_run = np.isfinite(result["value"][k])
        lines.append(
            Line(
                str(result["varied"][k]),
                tier,
                result["value"][k][is_run],
                result["seconds"][k][is_run],
                result[name][k][is_run],
                float(result[name.removesuffix("error") + "order"][k]),
                str(result["order_by_theory"][k]),
            )
        )
    return lines


@styled
def accuracy_figure(result: Result) -> Figure:
    """Draw an accuracy study.

    Of a gait it shows error against seconds for every tier and setting, of forces in
    grains error against the number of parts and against seconds, of a robot error
    against each setting.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", phases=32, grid=7)
    >>> fig = geomech.plots.accuracy_figure(study.accuracy(runs=1))
    """
    if "parts" in result.attributes:
        return parts_figure(result)
    if "speed" in result:
        return robot_figure(result)
    return tiers_figure(result)


# Gaits


@styled
def tiers_figure(result: Result) -> Figure:
    """Draw `work_precision` on a new figure, with room for its legends."""
    count = len({*result["against"].values.tolist()})
    fig, axes = figure(5.0 * count, 5.2, count)
    work_precision(result, axes[0])
    return fig


@styled
def work_precision(result: Result, axes: Any = None) -> Any:
    """Draw error against seconds of a study of a gait, with a line for each setting of
    a tier and its first and last value at the ends; return the Axes.

    axes: one for each kind of error in the study, in the order of PANELS: the error of
    the answer, and the distance from the limit of the setting alone."""
    panels = [name for name in PANELS if name in result["against"].values.tolist()]
    if axes is None:
        _, grid = figure(5.0 * len(panels), 3.8, len(panels))
        axes = [*grid[0]]
    count = result["amplitude"].values.size
    for ax, against in zip(axes, panels):
        title, error = PANELS[against]
        error = f"{error} ({result['error'].unit})"
        for k, line in enumerate(study_lines(result, against=against)):
            colour = f"C{k}"
            if against == "truth":
                colour = TIERS[line.tier].colour
            draw_line(ax, line, SETTING_MARKER[k % len(SETTING_MARKER)], colour)
        ax.set(xlabel=f"time for {count} amplitudes, tables included (s)", ylabel=error)
        ax.set_title(title)
        for axis in (ax.xaxis, ax.yaxis):
            show_decades(axis)
        ax.grid(True, which="major", lw=0.3, color="0.85")
        ax.legend(
            loc="upper center",
            bbox_to_anchor=(0.5, -0.18),
            title="tier: setting, from coarse to fine",
        )
        ax.get_legend().get_title().set_fontsize(font_points(8))
    return axes


def draw_line(ax: Any, line: Line, marker: str, colour: str) -> None:
    """Draw error against seconds of a setting, with its first and last value at the
    ends."""
    error = np.maximum(line.error, SMALLEST_ERROR)
    setting = SETTINGS.get(line.varied, line.varied)
    label = f"{line.tier}: {setting}, {line.values[0]:g} to {line.values[-1]:g}"
    label += order_text(line.order)
    ax.loglog(line.seconds, error, marker=marker, label=label, color=colour, lw=1.0)
    look = {"textcoords": "offset points", "fontsize": font_points(7), "color": colour}
    first = (line.seconds[0], error[0])
    last = (line.seconds[-1], error[-1])
    ax.annotate(f"{line.values[0]:g}", first, (0, 5), ha="center", **look)
    ax.annotate(f"{line.values[-1]:g}", last, (5, 0), va="center", **look)


def order_text(order: float) -> str:
    """Return what a legend adds about the order of convergence."""
    if np.isnan(order):
        return ""
    if order >= LOWEST_ORDER:
        return f", order {order:.1f}"
    return ", no gain"


def show_decades(axis: Any) -> None:
    """Label only powers of ten on a logarithmic axis, and at least two of them."""
    low, high = axis.get_view_interval()
    if np.floor(np.log10(high)) - np.ceil(np.log10(low)) < 1:
        lowest = 10.0 ** np.floor(np.log10(low))
        highest = 10.0 ** np.ceil(np.log10(high))
        axis.axes.set(**{f"{axis.axis_name}lim": (lowest, highest)})
    axis.set_minor_formatter("")


# Forces in grains


@styled
def parts_figure(result: Result) -> Figure:
    """Draw the errors of force and moment against the number of parts, and against
    seconds."""
    fig, ((by_parts, by_seconds),) = figure(7.2, 3.2, 2)
    facts = result.attributes
    for name, colour, marker in zip(("force", "moment"), ("C0", "0.2"), "os"):
        (line,) = study_lines(result, f"{name}_error")
        label = name
        if not np.isnan(line.order):
            label = f"{name}, order {line.order:.1f}"
        error = np.maximum(line.error, SMALLEST_ERROR)
        look = {"color": colour, "marker": marker, "lw": 1.0, "label": label}
        by_parts.loglog(line.values, error, **look)
        by_seconds.loglog(line.seconds, error, **look)
    by_parts.set_xlabel(facts["parts"])
    by_seconds.set_xlabel(f"seconds for {facts['poses']} poses")
    for ax in (by_parts, by_seconds):
        ax.set_ylabel("rms error / largest of the motion")
        ax.grid(True, which="major", lw=0.3, color="0.85")
    by_parts.set_xticks(line.values, [f"{value:.0f}" for value in line.values])
    by_parts.minorticks_off()
    show_decades(by_seconds.xaxis)
    by_parts.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return fig


# Robots


@styled
def robot_figure(result: Result) -> Figure:
    """Draw the error of the speed against each setting of a robot, with a dashed line
    of the order that theory predicts."""
    lines = study_lines(result)
    fig, axes = figure(8.4, 2.9, len(lines))
    for ax, line in zip(axes[0], lines):
        error = np.maximum(line.error, SMALLEST_SPEED_ERROR)
        ax.loglog(line.values, error, "o-", color="black", lw=1.0)
        power = -float(line.order_by_theory)
        if line.varied == "rounding":
            # A smaller rounding is finer; other settings are numbers of parts.
            power = -power
        theory = error.max() * (line.values / line.values[error.argmax()]) ** power
        label = f"order {line.order_by_theory}"
        ax.loglog(line.values, theory, color="0.6", ls="--", lw=0.8, label=label)
        unit = result["speed"].unit
        setting = ROBOT_SETTINGS[line.varied]
        if line.varied == "rounding":
            setting = f"{setting} (m/s)"
        ax.set(xlabel=setting, ylabel=f"error of the speed ({unit})")
        ax.set_xticks(line.values, [f"{v:g}" for v in line.values], rotation=45)
        ax.minorticks_off()
        ax.legend(loc="best")
    return fig
