"""Work-precision diagrams: error against seconds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geomech.output.plots.style import figure, styled
from geomech.tiers import TIERS

KNOB_MARKER = "osD^v<>Ph*X"


@styled
def work_precision(results: Mapping, axes=None):
    """Error against seconds of `accuracy.study`, a line a knob: against the truth on the first of two Axes, against the
    knob's own limit on the second. Slopes are measured orders in the setting."""
    axes = figure(10.0, 3.8, 2)[1][0] if axes is None else axes
    for ax, against in zip(axes, ("truth", "limit")):
        lines = [line for line in results["lines"] if line["against"] == against]
        for line, marker in zip(lines, KNOB_MARKER):
            style = {"color": TIERS[line["tier"]].colour, "linestyle": "-", "linewidth": 1.0}
            if against == "limit":
                style["color"] = f"C{KNOB_MARKER.index(marker)}"
            order = "" if line["slope"] is None else f", order {line['slope']:.1f}"
            error = np.maximum(line["error"], 1e-17)
            ax.loglog(line["seconds"], error, marker=marker, label=line["label"] + order, **style)
        ax.set(
            xlabel="seconds", ylabel=f"error against the {'truth' if against == 'truth' else 'limit of the knob'} (BL)"
        )
        ax.grid(True, which="major", lw=0.3, color="0.85")
        if lines:
            ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return axes


@styled
def work_precision_figure(results: Mapping):
    fig, axes = figure(10.0, 3.4, 2)
    work_precision(results, axes[0])
    return fig
