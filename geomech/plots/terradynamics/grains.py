"""A swim in a bed of grains, compared with what the tiers predict."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.plots.style import figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TIER_COLOUR = "0.6"
GRAINS_COLOUR = "#D55E00"


@styled
def grains_figure(result: Result) -> Figure:
    """Draw the body at the start of every cycle with the track of its frame, and the
    distance per cycle by every method."""
    fig, axes = figure(7.2, 3.0, 2, 1)
    left, right = axes[0]
    _draw_track(left, result)
    _draw_distances(right, result)
    return fig


def _draw_track(ax: Axes, result: Result) -> None:
    """Draw the track of the frame and the body at the start of every cycle."""
    ax.plot(result["track_x"].values, result["track_y"].values, color="0.5", lw=0.6)
    x = result["body_x"].values
    y = result["body_y"].values
    for k in range(len(x)):
        alpha = 0.3 + 0.7 * k / len(x)  # later cycles are darker
        ax.plot(x[k], y[k], color="black", lw=1.2, alpha=alpha)
    unit = result["body_x"].unit
    ax.set(xlabel=f"$x$ ({unit})", ylabel=f"$y$ ({unit})", aspect="equal")


def _draw_distances(ax: Axes, result: Result) -> None:
    """Draw a bar for each tier and one for the grains, with errors; the grains are the
    last method of a result."""
    names = result["method"].values.tolist()
    distance = result["net_distance"]
    error = np.hypot(np.nan_to_num(distance.error), np.nan_to_num(distance.spread))
    colours = [TIER_COLOUR] * (len(names) - 1) + [GRAINS_COLOUR]
    rows = range(len(names))
    ax.barh(rows, distance.values, xerr=error, color=colours, height=0.6)
    ax.set_yticks(rows, names)
    ax.invert_yaxis()
    largest = (distance.values + error).max()
    label = f"distance per cycle ({distance.unit})"
    ax.set(xlabel=label, xlim=(0, 1.15 * largest or None))
    ax.locator_params(axis="x", nbins=5)
