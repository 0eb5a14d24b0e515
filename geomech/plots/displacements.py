"""Displacement per cycle against amplitude: x, y, heading and net distance, a line a tier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.errors import choose
from geomech.core.summary import listed
from geomech.core.variables import Result
from geomech.geometry.field import UNKNOWN_UNIT
from geomech.plots.style import axes_of, figure, shared_legend, styled
from geomech.scenes.measurements import converted, units_of
from geomech.studies.tables import QUANTITIES, pose_quantities
from geomech.tiers import TIERS
from rft.core.refusal import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST = 1e-3  # body lengths or rad: an axis spans no less, so that rounding is not drawn as motion
BAND, EDGE = "#E69F00", "#A66F00"  # of the medium: its area and its outline
ERROR, MEDIUM, MEASURED = (
    "estimated error, in the tier's colour",
    "medium, one standard deviation",
    "measured",
)
PANELS = {
    "x": "x",
    "y": "y",
    "theta": "heading",
    "distance": "net_distance",
}  # by the words of --component
SPAN, APART = 1.0, 0.04  # of the axis about one amplitude; of it, between tiers there
ROUNDING = 1e-9  # body lengths or rad: below it a displacement is nothing
TO_ROUNDING = "to rounding, every tier has less than 1e-9"


def _data_units(result: Result, quantity: str) -> dict[str, dict[str, float]]:
    """Return the units that columns of measurements may have beside a result."""
    return units_of(
        "(rad)" in result["amplitude"].label,
        result["x"].unit,
        result.attributes.get("body_length", 1.0),
        angle=quantity == "heading",
    )


@styled
def displacement(
    result: Result,
    *,
    ax: Axes | None = None,
    label: str = "",
    quantity: str = "x",
    legend: bool = True,
    errors: bool = True,
    data: Mapping | None = None,
    **style: Any,
) -> Axes:
    """Draw one of QUANTITIES per cycle against amplitude, a line for each tier of a
    result of displacements; return the Axes.

    errors: with a band of each tier's estimated error, in its colour; an uncertain medium
    has an outlined band of its own. data: measurements to draw as points, "amplitude",
    "value" and "error" (N,), such as a data frame of pandas; the error may be missing. A
    name may end in a unit, as those of a file: "amplitude_deg", "value_cm"; without it the
    unit is that of the axis.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15)
    >>> table = study.displacement([0.5, 1.0], ["path", "direct"])
    >>> geomech.plots.displacement(table, quantity="net_distance").get_ylabel()
    'net distance per cycle (BL)'
    """
    ax = axes_of(ax, 4.4, 3.8)
    variable = result[choose("quantity", quantity, QUANTITIES)]
    amplitudes = result["amplitude"].values
    tiers = result["tier"].values.tolist()
    shown = [name for name in TIERS if name in tiers]
    errors = errors and variable.error is not None
    drawn = amplitudes
    if data is not None:
        data = converted(data, _data_units(result, quantity))
        drawn = np.append(amplitudes, data["amplitude"])
    span = np.ptp(drawn)
    places = _side_by_side(amplitudes, len(shown), span or SPAN)
    for name, x in zip(shown, places):
        tier, row = TIERS[name], tiers.index(name)
        values = variable.values[row]
        title = f"{label}, {tier.label}" if label else tier.label
        # One point is no line.
        point = {"marker": "o", "ms": 5} if len(amplitudes) == 1 else {}
        ax.plot(x, values, label=title, **{**tier.style, **point, **style})
        if errors:
            _error_band(ax, x, values, variable.error[row], tier.colour)
    if errors:
        ax.plot([], [], color="0.5", alpha=0.3, lw=7, label=ERROR)
    if shown and variable.spread is not None:
        best = tiers.index(shown[-1])
        centre = variable.values[best] + _shift(result, quantity)
        medium_band(ax, places[-1], centre, variable.spread[best])
    if data is not None:
        measured(ax, data)
    if not span:
        ax.set(xlim=amplitudes + [-SPAN / 2, SPAN / 2], xticks=amplitudes)
    ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    _widen(ax, LEAST * _scale(result, quantity))
    what = quantity.replace("_", " ")
    ax.set(xlabel=result["amplitude"].label or "amplitude")
    ax.set_ylabel(f"{what} per cycle ({variable.unit or UNKNOWN_UNIT})")
    if legend:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1)
    return ax


def _scale(result: Result, quantity: str) -> float:
    """Return the size of a quantity by which it is large or small: the body's length, or
    1 rad."""
    if quantity == "heading":
        return 1.0
    return float(result.attributes.get("body_length", 1.0))


def _shift(result: Result, quantity: str) -> Any:
    """Return how far an uncertain medium shifts the mean of a quantity, (B,) or 0."""
    if "medium_shift" not in result:
        return 0.0
    row = result["quantity"].values.tolist().index(quantity)
    return result["medium_shift"].values[row]


def _side_by_side(amplitudes: np.ndarray, count: int, span: float) -> np.ndarray:
    """Return where each of so many tiers is drawn (count, B): at the amplitudes or, of one amplitude, about it side by side, so
    that no error bar hides another. span: of the axis."""
    aside = (
        APART * span * (np.arange(count) - (count - 1) / 2)
        if len(amplitudes) == 1
        else np.zeros(count)
    )
    return amplitudes + aside[:, None]


def _error_band(ax, x, values, error, colour: str) -> None:
    """Draw the estimated error (B,) of a tier to either side of its values (B,), outlined so that bands that overlap are told
    apart."""
    from matplotlib.colors import to_rgba

    if len(x) == 1:  # no band to see
        ax.vlines(x, values - error, values + error, colors=colour, lw=1.0, zorder=0.9)
    else:
        look = {
            "facecolor": to_rgba(colour, 0.14),
            "edgecolor": to_rgba(colour, 0.6),
            "lw": 0.5,
            "zorder": 0.5,
        }
        ax.fill_between(x, values - error, values + error, **look)


def medium_band(ax: Axes, x: Any, values: Any, error: Any) -> None:
    """Draw the uncertainty by a medium of values (B,): error (B,) to either side, outlined so that it is seen over the line of
    the tier that it is about."""
    from matplotlib.colors import to_rgba

    if len(x) == 1:  # no band to see
        ax.vlines(
            x,
            values - error,
            values + error,
            lw=6,
            color=BAND,
            alpha=0.6,
            label=MEDIUM,
            zorder=1.5,
        )
    else:
        look = {
            "facecolor": to_rgba(BAND, 0.35),
            "edgecolor": EDGE,
            "lw": 0.8,
            "label": MEDIUM,
            "zorder": 1.5,
        }
        ax.fill_between(x, values - error, values + error, **look)


def measured(ax, data: Mapping) -> None:
    """Draw measurements as points with bars of their errors."""
    x, values, error = data["amplitude"], data["value"], data.get("error")
    look = {
        "fmt": "D",
        "ms": 4,
        "mfc": "white",
        "color": "black",
        "elinewidth": 1.0,
        "capsize": 2.5,
    }
    ax.errorbar(x, values, error, label=MEASURED, zorder=4, **look)


def _widen(ax, least: float) -> None:
    low, high = ax.get_ylim()
    if high - low < least:
        ax.set_ylim((low + high - least) / 2, (low + high + least) / 2)


@styled
def displacement_figure(
    tables: Mapping[str, Result],
    *,
    components: Sequence[str] = (),
    data: Mapping | None = None,
) -> Figure:
    """Draw QUANTITIES side by side, a row for each result of displacements, without those
    that are zero; a line says which and why.

    components: of PANELS, drawn even where they are zero; all of them if left out. data:
    measurements of the first gait, drawn as `displacement` does on the first of the
    components, else on x.

    Examples
    --------
    >>> import geomech
    >>> from geomech.plots import displacement_figure
    >>> study = geomech.study("three-link-viscous", grid=15)
    >>> fig = displacement_figure({"circle": study.displacement([0.5, 1.0])})
    """
    wanted = [PANELS[choose("component", name, PANELS)] for name in components]
    zero = [{} if wanted else _zeros(table) for table in tables.values()]
    if data is not None and not wanted:
        zero[0].pop("x", None)
    moving = [q for q in QUANTITIES if not all(q in one for one in zero)]
    panels = wanted or moving or [*QUANTITIES]
    alone = len(panels) == 1  # with its legend at the right
    fig, axes = figure(
        2.7 * (len(panels) + alone) + 0.3,
        0.5 + 2.5 * len(tables),
        len(panels),
        len(tables),
    )
    for row, (name, table), absent in zip(axes, tables.items(), zero):
        for ax, quantity in zip(row, panels):
            if quantity in absent and len(absent) < len(QUANTITIES):
                _say_zero(ax, quantity, absent[quantity])
                continue
            # x is never left out beside measurements.
            points = data if ax is axes[0, 0] else None
            displacement(
                table, ax=ax, quantity=quantity, legend=False, data=points, marker="o"
            )
        title = printable(name)
        if "note" in table.attributes:
            title = f"{title} (not in the scene)"
        row[0].set_title(title, loc="left")
        frequency = table.attributes.get("frequency")
        if frequency and panels[-1] == "net_distance":
            _speed_axis(row[-1], frequency, table["x"].units)
    # The last labels are wider than their axes.
    fig.get_layout_engine().set(rect=(0.0, 0.0, 0.985, 1.0))
    shared_legend(fig, "outside right center" if alone else "outside upper center")
    if not wanted:
        left_out = {q: why for q, why in zero[0].items() if q not in panels}
        fig.supxlabel(_left_out(left_out), fontsize=8, color="0.3")
    return fig


def _left_out(zero: Mapping[str, str]) -> str:
    """Return lines that say which quantities are zero, and why."""
    lines = []
    for why in dict.fromkeys(zero.values()):
        names = [q.replace("_", " ") for q in QUANTITIES if zero.get(q) == why]
        lines.append(f"{listed(names)}: zero {why}")
    return "\n".join(lines)


def _zeros(table: Result) -> dict[str, str]:
    """Return why quantities of a table are zero, by symmetry or to rounding; none that is
    not."""
    found = {}
    for quantity in QUANTITIES:
        variable = table[quantity]
        if variable.zero:
            found[quantity] = variable.zero
        elif np.all(np.abs(variable.values) <= ROUNDING * _scale(table, quantity)):
            found[quantity] = TO_ROUNDING
    return found


def _say_zero(ax, quantity: str, why: str) -> None:
    """Write in place of a panel why it is zero."""
    import textwrap

    lines = "\n".join(textwrap.wrap(f"{quantity}: zero {why}", 26))
    ax.text(
        0.5,
        0.5,
        lines,
        ha="center",
        va="center",
        transform=ax.transAxes,
        fontsize=8,
        color="0.3",
    )
    ax.set_axis_off()


def _speed_axis(ax, frequency: float, unit: str) -> None:
    """Draw a scale on the right of net distances: the speed at that frequency."""
    right = ax.secondary_yaxis(
        "right", functions=(lambda d: d * frequency, lambda v: v / frequency)
    )
    right.set_ylabel(f"speed ({unit}/s) at {frequency:g} Hz")
    right.spines["right"].set_visible(True)


def net(poses: Any) -> np.ndarray:
    """Return the net distance (...,) of poses (..., 3), negative where it points backwards (x < 0).

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.plots import net
    >>> net(np.array([[0.3, 0.4, 0.0], [-0.3, 0.0, 0.0]]))
    array([ 0.5, -0.3])
    """
    found = pose_quantities(poses)
    return np.copysign(found["net_distance"], found["x"])
