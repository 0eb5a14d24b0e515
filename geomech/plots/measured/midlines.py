"""Kinematics of midlines: the track of the body, slip and amplitude along it, and
measured cycles compared with predicted ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result
from geomech.plots.style import figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED_COLOUR = "#0072B2"
PREDICTED_COLOUR = "#D55E00"
MIDLINES = 12  # of a cycle that are drawn
ALONG = "_along"
PANELS = ("track", "slip_along", "amplitude_along", "speed", "heading", "slip")
COLUMNS = 3


@styled
def midlines_figure(result: Result, panels: Sequence[str] = ()) -> Figure:
    """Draw a result of `fit_gait` of midlines: the track of the body with the midlines
    of one cycle, and slip and amplitude along the body with intervals.

    If there is a prediction, the panels below show speed, heading and slip of each
    cycle, measured and predicted, with their means and intervals.

    panels: of PANELS, in this order; by default all. Those of cycles show measured ones
    alone where there is no prediction."""
    has_prediction = "compared" in result
    names = [choose("panel", name, PANELS) for name in panels]
    if not names:
        names = [*PANELS] if has_prediction else [*PANELS[:COLUMNS]]
    columns = min(COLUMNS, len(names))
    rows = -(-len(names) // columns)
    height = 3.4 if rows == 1 else 3.0 * rows
    fig, axes = figure(3.2 * columns, height, columns, rows)
    first_of_cycles = True
    for name, ax in zip(names, axes.ravel()):
        if name == "track":
            _draw_track(result, ax)
        elif name.endswith(ALONG):
            _draw_along_body(result, name.removesuffix(ALONG), ax)
        else:
            _draw_cycles(result, name, "", MEASURED_COLOUR, "measured", ax)
            if has_prediction:
                _draw_cycles(
                    result, name, "_predicted", PREDICTED_COLOUR, "predicted", ax
                )
                if first_of_cycles:
                    place = {"loc": "lower center", "bbox_to_anchor": (0.62, 1.0)}
                    ax.legend(ncols=2, **place)
            first_of_cycles = False
    for ax in axes.ravel()[len(names) :]:
        ax.set_axis_off()
    return fig


def _draw_track(result: Result, ax: Axes) -> None:
    """Draw the track of the body's mean, cycle by cycle, with the midlines of one cycle
    and their heads."""
    x = result["track_x"]
    y = result["track_y"]
    label = "mean of the body"
    for cycle_x, cycle_y in zip(x.values, y.values):
        ax.plot(cycle_x, cycle_y, color=MEASURED_COLOUR, lw=1.2, label=label)
        label = None

    every = max(1, result["midline_x"].values.shape[0] // MIDLINES)
    body_x = result["midline_x"].values[::every]
    body_y = result["midline_y"].values[::every]
    label = "midlines of a cycle"
    for midline_x, midline_y in zip(body_x, body_y):
        ax.plot(midline_x, midline_y, color="0.55", lw=0.8, label=label)
        label = None
    ax.plot(body_x[:, -1], body_y[:, -1], "o", color="black", ms=2.5, label="head")

    if "track_x_predicted" in result:
        track_x = result["track_x_predicted"].values
        track_y = result["track_y_predicted"].values
        look = {"color": PREDICTED_COLOUR, "lw": 1.2, "label": "predicted"}
        ax.plot(track_x, track_y, "--", **look)
    ax.set(xlabel=f"x ({x.unit})", ylabel=f"y ({y.unit})")
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_title(f"{len(x.values)} cycles", loc="left")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=2)


def _draw_along_body(result: Result, name: str, ax: Axes) -> None:
    """Draw a quantity along the body with its interval."""
    s = result["s"].values
    along = result[f"{name}_along"]
    values = along.values
    error = along.error
    band = {"color": MEASURED_COLOUR, "alpha": 0.25, "lw": 0}
    ax.fill_between(s, values - error, values + error, **band)
    ax.plot(s, values, "o-", color=MEASURED_COLOUR, lw=1.2)
    ax.set(
        xlim=(0, 1),
        ylim=(0, None),
        xlabel="place on the body, tail 0 to head 1",
        ylabel=f"{name} ({along.unit})",
    )
    ax.set_title(f"{name} along the body", loc="left")


def _draw_cycles(
    result: Result, name: str, ending: str, colour: str, label: str, ax: Axes
) -> None:
    """Draw a quantity of each cycle with its mean and interval.

    ending: of the variables' names, "" for those measured."""
    mean = result[f"{name}{ending}"]
    value = float(mean)
    error = float(mean.error)
    ax.axhspan(value - error, value + error, color=colour, alpha=0.2, lw=0)
    ax.axhline(value, color=colour, lw=1.2, label=label)
    cycles = result[f"{name}_per_cycle{ending}"].values
    ax.plot(np.arange(1, len(cycles) + 1), cycles, "o", color=colour, ms=3)
    ax.set(xlabel="cycle", ylabel=f"{name} ({result[name].unit})")
    ax.set_title(name, loc="left")
    ax.xaxis.get_major_locator().set_params(integer=True)
