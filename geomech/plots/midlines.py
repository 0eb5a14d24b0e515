"""Kinematics of midlines: the body on its way, slip and amplitude along it, and what was measured beside what is predicted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.measured.midlines.kinematics import Cycles
from geomech.measured.midlines.predicted import COMPARED, Comparison
from geomech.measured.midlines.question import units_of
from geomech.plots.style import figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MEASURED, PREDICTED = "#0072B2", "#D55E00"
BODIES = 12  # midlines of a cycle that are drawn
PANELS = "speed", "heading", "slip"


@styled
def midlines_figure(result: Result) -> Figure:
    """Draw the way of the body with the midlines of one cycle, and slip and amplitude along the body with intervals; below, if
    there is a prediction, speed, heading and slip of each cycle, measured and predicted, with their means and intervals."""
    comparison = result.subject[1]
    fig, axes = figure(
        9.6, 3.2 if comparison is None else 6.0, 3, 1 if comparison is None else 2
    )
    _track(result, axes[0, 0])
    _along(result, "slip", "rad", axes[0, 1])
    _along(result, "amplitude", "BL", axes[0, 2])
    if comparison is not None:
        for name, ax in zip(PANELS, axes[1]):
            _compared(result, name, ax)
        axes[1, 0].legend(loc="lower center", bbox_to_anchor=(0.62, 1.0), ncols=2)
    return fig


def _track(result: Result, ax) -> None:
    fit, unit = result.subject[0], result.subject[0].trial.unit
    cycles, length = fit.cycles(fit.curve), fit.value("length")[0]
    size = 1.0 if unit == "m" else length
    centre = cycles.place.mean(-1) / size
    for k, path in enumerate(centre):
        ax.plot(
            path.real,
            path.imag,
            color=MEASURED,
            lw=1.2,
            label="mean of the body" if k == 0 else None,
        )
    place = cycles.place[0, :: max(1, cycles.place.shape[1] // BODIES)] / size
    for k, body in enumerate(place):
        ax.plot(
            body.real,
            body.imag,
            color="0.55",
            lw=0.8,
            label="midlines of a cycle" if k == 0 else None,
        )
    ax.plot(
        place[:, -1].real, place[:, -1].imag, "o", color="black", ms=2.5, label="head"
    )
    if (comparison := result.subject[1]) is not None:
        track = _predicted_track(cycles, comparison, length, size)
        ax.plot(
            track.real, track.imag, "--", color=PREDICTED, lw=1.2, label="predicted"
        )
    ax.set(xlabel=f"x ({unit or 'BL'})", ylabel=f"y ({unit or 'BL'})")
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_title(f"{len(fit.used)} cycles", loc="left")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.28), ncols=2)


def _predicted_track(
    cycles: Cycles, comparison: Comparison, length: float, size: float
) -> np.ndarray:
    """Return where the body is after each cycle as predicted (C + 1,), x + i y, from where it was at the start. size: unit of
    the axes in that of the trial."""
    stride, heading, turn = (
        comparison.predicted[COMPARED.index(name)]
        for name in ("stride", "heading", "turn")
    )
    count = len(cycles.duration)
    steps = (
        stride
        * length
        / size
        * np.exp(1j * (heading + turn * (np.arange(count) - (count - 1) / 2)))
    )
    start = complex(*cycles.starts[0, :2]) / size
    return np.concatenate([[0.0], np.cumsum(steps)]) + start


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
    fit, comparison = result.subject
    k, number = COMPARED.index(name), np.arange(1, len(fit.used) + 1)
    pairs = (
        (result["per_cycle"].values[:, list(result["quantity"].values).index(name)], comparison.measured[k],
         comparison.measured_error[k], MEASURED, "measured"),
        (comparison.per_cycle[:, k], comparison.predicted[k], comparison.predicted_error[k], PREDICTED, "predicted"),
    )  # fmt: skip
    for each, mean, error, colour, label in pairs:
        ax.axhspan(mean - error, mean + error, color=colour, alpha=0.2, lw=0)
        ax.axhline(mean, color=colour, lw=1.2, label=label)
        ax.plot(number, each, "o", color=colour, ms=3)
    ax.set(xlabel="cycle", ylabel=f"{name} ({units_of(fit)[name]})")
    ax.set_title(name, loc="left")
    ax.xaxis.get_major_locator().set_params(integer=True)
