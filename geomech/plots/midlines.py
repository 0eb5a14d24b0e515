"""Kinematics of midlines: the body on its way, slip and amplitude along it, and what was measured beside what is predicted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.plots.style import figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED, PREDICTED = "#0072B2", "#D55E00"
BODIES = 12  # midlines of a cycle that are drawn
PANELS = "speed", "heading", "slip"


@styled
def midlines_figure(result: Result) -> Figure:
    """Draw a result of `fit_gait` of midlines: the way of the body with the midlines of one
    cycle, and slip and amplitude along the body with intervals; below, if there is a
    prediction, speed, heading and slip of each cycle, measured and predicted, with their
    means and intervals."""
    compared = "compared" in result
    height, rows = (6.0, 2) if compared else (3.2, 1)
    fig, axes = figure(9.6, height, 3, rows)
    _track(result, axes[0, 0])
    _along(result, "slip", "rad", axes[0, 1])
    _along(result, "amplitude", "BL", axes[0, 2])
    if compared:
        for name, ax in zip(PANELS, axes[1]):
            _compared(result, name, ax)
        axes[1, 0].legend(loc="lower center", bbox_to_anchor=(0.62, 1.0), ncols=2)
    return fig


def _track(result: Result, ax) -> None:
    x, y = result["track_x"], result["track_y"]
    label = "mean of the body"
    for one, other in zip(x.values, y.values):
        ax.plot(one, other, color=MEASURED, lw=1.2, label=label)
        label = None
    every = max(1, result["midline_x"].values.shape[0] // BODIES)
    bodies = [result[name].values[::every] for name in ("midline_x", "midline_y")]
    label = "midlines of a cycle"
    for one, other in zip(*bodies):
        ax.plot(one, other, color="0.55", lw=0.8, label=label)
        label = None
    heads = [body[:, -1] for body in bodies]
    ax.plot(*heads, "o", color="black", ms=2.5, label="head")
    if "track_x_predicted" in result:
        way = (result[f"track_{axis}_predicted"].values for axis in "xy")
        ax.plot(*way, "--", color=PREDICTED, lw=1.2, label="predicted")
    ax.set(xlabel=f"x ({x.unit})", ylabel=f"y ({y.unit})")
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_title(f"{len(x.values)} cycles", loc="left")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.28), ncols=2)


def _along(result: Result, name: str, unit: str, ax) -> None:
    s, values, error = (
        result["s"].values,
        result[f"{name}_along"].values,
        result[f"{name}_along"].error,
    )
    ax.fill_between(s, values - error, values + error, color=MEASURED, alpha=0.25, lw=0)
    ax.plot(s, values, "o-", color=MEASURED, lw=1.2)
    ax.set(
        xlim=(0, 1),
        ylim=(0, None),
        xlabel="place on the body, tail 0 to head 1",
        ylabel=f"{name} ({unit})",
    )
    ax.set_title(f"{name} along the body", loc="left")


def _compared(result: Result, name: str, ax) -> None:
    for ending, colour, label in (
        ("", MEASURED, "measured"),
        ("_predicted", PREDICTED, "predicted"),
    ):
        mean, each = result[f"{name}{ending}"], result[f"{name}_per_cycle{ending}"]
        value, error = float(mean), float(mean.error)
        ax.axhspan(value - error, value + error, color=colour, alpha=0.2, lw=0)
        ax.axhline(value, color=colour, lw=1.2, label=label)
        number = np.arange(1, len(each.values) + 1)
        ax.plot(number, each.values, "o", color=colour, ms=3)
    ax.set(xlabel="cycle", ylabel=f"{name} ({result[name].unit})")
    ax.set_title(name, loc="left")
    ax.xaxis.get_major_locator().set_params(integer=True)
