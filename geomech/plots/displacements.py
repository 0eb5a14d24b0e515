"""Displacement per cycle against amplitude: x, y, heading and net distance, a line a tier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from geomech.gaits import Gait
from geomech.plots.style import axes_of, figure, styled
from geomech.studies.tables import ERRORS, QUANTITIES, error_of, of_pose, unit_of
from geomech.tiers import TIERS

LEAST = 1e-3  # body lengths or rad: an axis spans no less, so that rounding is not drawn as motion
BAND = "#E69F00"
BARS = 15  # error bars on a line, at most


@styled
def displacement(
    table: Mapping, *, ax=None, label: str = "", gait: Gait | None = None, quantity: str = "x", legend: bool = True,
    errors: bool = True, **style,
):  # fmt: skip
    """Draw one of QUANTITIES per cycle against amplitude, a line for each tier; ``table`` as `Study.study` returns it.

    errors: with error bars. The table's own units are those of the axis."""
    ax, amplitudes = axes_of(ax), np.asarray(table["amplitude"], float)
    for name, tier in TIERS.items():
        if name in table:
            title = f"{label}, {tier.label}" if label else tier.label
            values = of_pose(table[name])[quantity]
            (line,) = ax.plot(amplitudes, values, label=title, **{**tier.style, **style})
            if errors and all(key in table for key in ERRORS):
                bars = {"fmt": "none", "ecolor": tier.colour, "elinewidth": 0.7, "zorder": line.get_zorder() - 0.5}
                every = max(1, -(-len(amplitudes) // BARS))
                ax.errorbar(amplitudes, values, error_of(table, quantity, name), **bars, errorevery=every)
    _band(ax, table, quantity, amplitudes)
    ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    _widen(ax, LEAST * (1.0 if quantity == "heading" else table.get("body_length", 1.0)))
    what = quantity.replace("_", " ")
    ax.set(xlabel=gait.amplitude_label if gait else "amplitude")
    ax.set_ylabel(f"{what} per cycle ({unit_of(table, quantity)})")
    if legend:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1)
    return ax


def _band(ax, table: Mapping, quantity: str, amplitudes) -> None:
    """Draw the uncertainty by the medium about the best tier, shifted as far as the medium shifts the mean."""
    best = [name for name in TIERS if name in table][-1:]
    if "medium_error_of" in table and best:
        values, error = of_pose(table[best[0]])[quantity], np.array(table["medium_error_of"][quantity])
        shift = np.array(table["medium_shift_of"][quantity]) if "medium_shift_of" in table else 0.0
        medium_band(ax, amplitudes, values + shift, error)


def medium_band(ax, x, values, error) -> None:
    """Draw the uncertainty by a medium of values (B,): error (B,) to either side."""
    look = {"color": BAND, "alpha": 0.4, "label": "medium, one standard deviation", "zorder": 1.5}
    if len(x) == 1:  # no band to see
        ax.vlines(x, values - error, values + error, lw=6, **look)
    else:
        ax.fill_between(x, values - error, values + error, lw=0, **look)


def _widen(ax, least: float) -> None:
    low, high = ax.get_ylim()
    if high - low < least:
        ax.set_ylim((low + high - least) / 2, (low + high + least) / 2)


@styled
def displacement_figure(tables: Mapping[str, Mapping], gaits: Sequence[Gait]):
    """Draw QUANTITIES side by side, a row for each gait's table."""
    fig, axes = figure(10.8, 0.5 + 2.5 * len(tables), len(QUANTITIES), len(tables))
    for row, (name, table), gait in zip(axes, tables.items(), gaits):
        for ax, quantity in zip(row, QUANTITIES):
            displacement(table, ax=ax, gait=gait, quantity=quantity, legend=False, marker="o")
        row[0].set_title(f"{name} (not in the scene)" if "note" in table else name, loc="left")
        if table.get("frequency"):
            _speed_axis(row[-1], table["frequency"], unit_of(table, "x"))
    handles = {label: line for ax in axes[:, 0] for line, label in zip(*ax.get_legend_handles_labels())}
    fig.get_layout_engine().set(rect=(0.0, 0.0, 0.985, 1.0))  # the last labels are wider than their axes
    fig.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=len(handles))
    return fig


def _speed_axis(ax, frequency: float, unit: str) -> None:
    """Draw a scale on the right of net distances: the speed at that frequency."""
    right = ax.secondary_yaxis("right", functions=(lambda d: d * frequency, lambda v: v / frequency))
    right.set_ylabel(f"speed ({unit}/s) at {frequency:g} Hz")
    right.spines["right"].set_visible(True)


def net(poses) -> np.ndarray:
    """Return the net distance (...,) of poses (..., 3), negative where it points backwards (x < 0)."""
    found = of_pose(poses)
    return np.copysign(found["net_distance"], found["x"])
