"""Work-precision diagrams: error against seconds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.plots.style import figure, styled
from geomech.tiers import TIERS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SETTING_MARKER = "osD^v<>Ph*X"
SETTINGS = {  # in words, where an entry of [numerics] is short for them
    "phases": "phases a cycle",
    "segments": "midpoints a link for the loads",
    "nodes": "Gauss points a link for the loads",
    "pieces": "pieces a body length",
    "curves": "curves of the family's table",
    "grid": "points a joint of the grid",
    "harmonics": "highest harmonic kept",
    "directions": "directions of the fit",
    "interpolation": "degree of the splines",
}
PANELS = {
    "truth": (
        "Error of the answer",
        "rms distance from a far finer force balance (BL)",
    ),
    "limit": (
        "Error of one approximation alone",
        "rms distance from where the setting leads (BL)",
    ),
}
FLAT = 0.3  # order below which finer settings gain nothing to speak of


@styled
def work_precision(results: Mapping, axes: Any = None) -> Any:
    """Draw error against seconds of `accuracy.study`, a line for each setting of a tier with its first and last value at its
    ends.

    The first of two Axes has the error of the answer, the second the error from the limit of that setting alone. A kind of
    error that no setting is measured by has no Axes."""
    found = {
        against: [x for x in results["lines"] if x["against"] == against]
        for against in PANELS
    }
    found = {against: lines for against, lines in found.items() if lines}
    axes = figure(5.0 * len(found), 3.8, len(found))[1][0] if axes is None else axes
    for ax, (against, lines) in zip(axes, found.items()):
        title, error = PANELS[against]
        for line, marker in zip(lines, SETTING_MARKER):
            colour = (
                TIERS[line["tier"]].colour
                if against == "truth"
                else f"C{SETTING_MARKER.index(marker)}"
            )
            _line(ax, line, marker, colour)
        ax.set(
            xlabel=f"time for {len(results['amplitudes'])} amplitudes, tables included (s)",
            ylabel=error,
        )
        ax.set_title(title)
        for axis in (ax.xaxis, ax.yaxis):
            _decades(axis)
        ax.grid(True, which="major", lw=0.3, color="0.85")
        ax.legend(
            loc="upper center",
            bbox_to_anchor=(0.5, -0.18),
            title="tier: setting, from coarse to fine",
        )
        ax.get_legend().get_title().set_fontsize(8)
    return axes


def _line(ax, line: Mapping, marker: str, colour: str) -> None:
    error, values = np.maximum(line["error"], 1e-17), line["value"]
    slope = line["slope"]
    gain = (
        ""
        if slope is None
        else f", order {slope:.1f}"
        if slope >= FLAT
        else ", no gain"
    )
    label = f"{line['tier']}: {SETTINGS.get(line['setting'], line['setting'])}, {values[0]:g} to {values[-1]:g}{gain}"
    ax.loglog(line["seconds"], error, marker=marker, label=label, color=colour, lw=1.0)
    for end, offset, how in (
        (0, (0, 5), {"ha": "center"}),
        (-1, (5, 0), {"ha": "left", "va": "center"}),
    ):
        at = {
            "xy": (line["seconds"][end], error[end]),
            "xytext": offset,
            "textcoords": "offset points",
        }
        ax.annotate(f"{values[end]:g}", **at, **how, fontsize=7, color=colour)


def _decades(axis) -> None:
    """Label powers of ten alone, two of them at least."""
    low, high = axis.get_view_interval()
    if np.floor(np.log10(high)) - np.ceil(np.log10(low)) < 1:
        axis.axes.set(
            **{
                f"{axis.axis_name}lim": (
                    10.0 ** np.floor(np.log10(low)),
                    10.0 ** np.ceil(np.log10(high)),
                )
            }
        )
    axis.set_minor_formatter("")


@styled
def work_precision_figure(results: Mapping) -> Figure:
    """Draw `work_precision` on a figure of its own; ``results`` as `geomech.accuracy` returns them.

    Examples
    --------
    >>> import geomech
    >>> table = geomech.accuracy(geomech.study("three-link-viscous", phases=32, grid=7).scene, runs=1)
    >>> fig = geomech.plots.work_precision_figure(table)
    """
    count = len({line["against"] for line in results["lines"]})
    fig, axes = figure(5.0 * count, 5.2, count)
    work_precision(results, axes[0])
    return fig


@styled
def walk_accuracy_figure(results: dict) -> Figure:
    """Draw the error of the speed against each setting of a robot (`geomech.studies.accuracy`)."""
    fig, axes = figure(8.4, 2.9, len(results["lines"]))
    labels = {
        "steps": "steps of a cycle",
        "elements": "elements of an outline",
        "rounding": "rounding (m/s)",
    }
    for ax, line in zip(axes[0], results["lines"]):
        value, error = np.array(line["value"], float), np.maximum(line["error"], 1e-12)
        ax.loglog(value, error, "o-", color="black", lw=1.0)
        sign = 1 if line["label"] == "rounding" else -1
        slope = error.max() * (value / value[error.argmax()]) ** (sign * line["order"])
        ax.loglog(
            value, slope, color="0.6", ls="--", lw=0.8, label=f"order {line['order']}"
        )
        ax.set(xlabel=labels[line["label"]], ylabel="error of the speed (m/s)")
        ax.set_xticks(value, [f"{v:g}" for v in value], rotation=45)
        ax.minorticks_off()
        ax.legend(loc="best")
    return fig
